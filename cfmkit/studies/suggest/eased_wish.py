"""The nearest wishes that a family can meet: one key of the wish is eased until a mechanism of the family meets all.

The scaling laws of the family say from where on it has candidates. These are made and judged as for any other wish; as
long as none is good, the key is eased further. Only what a mechanism was found for is named.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from cfmkit.families import family
from cfmkit.families.base import function_named
from cfmkit.families.findings import percent
from cfmkit.families.run_control import Run
from cfmkit.specs.units import format_short, read_quantity
from cfmkit.studies.suggest.proposal_making_and_judging import ProposalJob, made

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from cfmkit.designing.run_many_starts import Clock
    from cfmkit.families.wishes import Candidate, Wish

    Eased = tuple[Wish, str]
    Easing = Callable[[Wish, float], Eased | None]

STEPS = (1.0, 1.15, 1.5, 2.5, 6.0, 20.0)
"""Factors at which a family is told the eased wish; a wish that is farther off is not near."""

HALVINGS = 3
"""Of the last step, on a logarithmic scale: what is left is less than what the laws leave out."""

FURTHER = (1.02, 1.1, 1.3, 1.7, 2.5)
"""Beyond the first candidates: laws leave out pads, margins, and what stretches."""

TRIED = 3
"""Candidates that are made of each eased wish."""

LARGEST = 0.5
"""Ripple and hysteresis above which nobody would speak of a constant force."""

NAMED = 2
"""Keys that are named, those first that have to be eased least."""


def nearest(wish: Wish, name: str, seed: int, clock: Clock) -> dict[str, str]:
    """Return keys of a wish -> values with which, the other keys as they are, a family has a mechanism for it."""
    edges = []
    for key, easing in _easings(wish).items():
        factor = _first_offer(wish, (name, seed), easing, clock)
        if factor is not None:
            edges.append((factor, key, easing))
    found: dict[str, str] = {}
    for factor, key, easing in sorted(edges, key=lambda one: one[0]):
        reported = None if len(found) == NAMED else _met(wish, name, (easing, factor), seed, clock)
        if reported is not None:
            found[key] = reported
    return found


def _easings(wish: Wish) -> dict[str, Easing]:
    """Return what may be eased of a wish, by key."""
    found: dict[str, Easing] = {"room": _larger, wish.kind: _weaker}
    found["travel" if wish.kind == "force" else "angle"] = _shorter
    found["ripple"] = _rippled
    if wish.hysteresis is not None:
        found["hysteresis"] = _lossy
    if wish.adjustable is not None:
        found["adjustable"] = _less_adjustable
    return found


def _offered(wish: Wish, name: str, seed: int) -> Sequence[Candidate]:
    propose = family(name).propose
    if not propose:
        return ()
    asked = wish.with_strengths[-1]
    candidates: Sequence[Candidate] = function_named(propose)(asked, Run(seed)).candidates
    return candidates


def _first_offer(wish: Wish, asked: tuple[str, int], easing: Easing, clock: Clock) -> float | None:
    """Return the smallest factor with which a family has candidates; None if it has none."""

    def offers(factor: float) -> bool:
        eased = easing(wish, factor)
        return eased is not None and bool(_offered(eased[0], *asked))

    below = 1.0
    for factor in STEPS:
        if clock.late():
            return None
        if offers(factor):
            break
        below = factor
    else:
        return None
    for _ in range(HALVINGS if factor > 1.0 else 0):
        middle = (below * factor) ** 0.5
        below, factor = (below, middle) if offers(middle) else (middle, factor)
    return factor


def _met(wish: Wish, name: str, eased_by: tuple[Easing, float], seed: int, clock: Clock) -> str | None:
    """Return the value of a key with which one of a family's first candidates is good; None if none is."""
    easing, first = eased_by
    for more in FURTHER:
        eased = easing(wish, first * more)
        if eased is None:
            return None
        # the sides that were just enough by the laws may be too little: then all of them
        choices = [_only_needed(wish, (name, seed), eased), eased] if easing is _larger else [eased]
        for asked, reported in {text: (one, text) for one, text in choices}.values():
            for candidate in _offered(asked, name, seed)[:TRIED]:
                if clock.late():
                    return None
                if made(ProposalJob(name, candidate, asked, seed, clock.deadline)).passes:
                    return reported
    return None


def _only_needed(wish: Wish, asked: tuple[str, int], eased: Eased) -> Eased:
    """Return an eased room of which those sides are as they were that need not be larger."""
    for side in reversed(range(len(wish.room))):
        sides = tuple(
            old if k == side else new for k, (old, new) in enumerate(zip(wish.room, eased[0].room, strict=True))
        )
        if wish.travel >= sides[1] and wish.kind == "force":
            continue
        fewer = _in_room(wish, sides)
        if _offered(fewer[0], *asked):
            eased = fewer
    return eased


def _written(value: float, dimension: str, digits: int = 3) -> tuple[float, str]:
    """Return a value as a reader of its text has it, and the text."""
    text = format_short(value, dimension, digits)
    return read_quantity(text, dimension), text


def _in_room(wish: Wish, sides: Sequence[float]) -> Eased:
    # a side that stays is as it was, to its last digit
    pairs = [_written(side, "length", 12 if side == old else 4) for side, old in zip(sides, wish.room, strict=True)]
    return replace(wish, room=tuple(side for side, _ in pairs)), " x ".join(text for _, text in pairs)


def _larger(wish: Wish, factor: float) -> Eased:
    return _in_room(wish, [factor * side for side in wish.room])


def _weaker(wish: Wish, factor: float) -> Eased | None:
    if wish.adjustable is not None:
        return None
    digits = 6 if wish.banded else 3
    pairs = [_written(value / factor, wish.kind, digits) for value in (wish.low, wish.target, wish.high)]
    (low, first), (target, middle), (high, last) = pairs
    if wish.banded:
        return replace(wish, low=low, target=wish.target * low / wish.low, high=high), f"[{first}, {last}]"
    low, high = target * wish.low / wish.target, target * wish.high / wish.target
    return replace(wish, target=target, low=low, high=high), middle


def _shorter(wish: Wish, factor: float) -> Eased:
    travel, text = _written(wish.travel / factor, "length" if wish.kind == "force" else "angle")
    return replace(wish, travel=travel), text


def _rippled(wish: Wish, factor: float) -> Eased | None:
    text = percent(factor * wish.ripple)
    return (replace(wish, ripple=share), text) if (share := read_quantity(text, "ratio")) < LARGEST else None


def _lossy(wish: Wish, factor: float) -> Eased | None:
    text = percent(factor * (wish.hysteresis or 0.0))
    return (replace(wish, hysteresis=share), text) if (share := read_quantity(text, "ratio")) < LARGEST else None


def _less_adjustable(wish: Wish, factor: float) -> Eased | None:
    assert wish.adjustable is not None
    pairs = [_written(wish.target + (end - wish.target) / factor, "force", 4) for end in wish.adjustable]
    (low, first), (high, last) = pairs
    return (replace(wish, adjustable=(low, high)), f"[{first}, {last}]") if low < high else None
