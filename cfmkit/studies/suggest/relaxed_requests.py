"""The nearest requests that can be met: one key is relaxed until a mechanism of some family meets all.

The scaling laws of the families say from where on they have candidates; all keys are relaxed by steps together, so that
what has to be relaxed least is known first. Its first candidate is made and judged as for any other request; if it is
not good, the key is relaxed a little further. Only what a mechanism was found for is named.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from cfmkit.families import family
from cfmkit.families.findings import percent
from cfmkit.families.run_control import Run
from cfmkit.specs.units import format_short, read_quantity
from cfmkit.studies.suggest.proposal_making_and_judging import ProposalJob, make_proposal

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from cfmkit.designing.run_many_starts import Clock
    from cfmkit.families.proposals import Candidate, Request

    Relaxed = tuple[Request, str]
    Relaxation = Callable[[Request, float], Relaxed | None]

RELAXATION_FACTORS, LAST_FACTOR = (1.15, 2.2), 6.0
"""Factors at which a request is relaxed for a family. The last is looked at first: most of what nothing helps ends
there, and a mechanism six times as large is no alternative any more."""
N_HALVINGS = 3  # of the last step, on a logarithmic scale: what is left is less than what the laws leave out
FURTHER_FACTORS = (1.03, 1.15, 1.5, 2.2, 3.6)
"""Beyond the first candidates: laws leave out pads, margins, and what stretches."""
MAX_RIPPLE = 0.5  # ripple and hysteresis above which nobody would speak of a constant force
MAX_NAMED_KEYS = 2  # keys that are named, those first that have to be relaxed least


@dataclass(frozen=True)
class Edge:
    """From where on the laws of a family have candidates, if one key of a request is relaxed."""

    family: str
    key: str
    factor: float


def edges(request: Request, names: Sequence[str], seed: int, clock: Clock) -> Iterator[Edge]:
    """Yield for which keys of a request families have candidates, roughly those first that are relaxed least.

    Families that have candidates already, of which none is good, come first: a little more of any key may be enough.
    """
    relaxations = _relaxations(request)
    reachable = [name for name in names if not clock.late() and _list_candidates(request, name, seed)]
    yield from (Edge(name, key, 1.0) for name in reachable for key in relaxations)
    pairs = [(name, key) for name in names if name not in reachable for key in relaxations]
    left = [
        (name, key)
        for name, key in pairs
        if not clock.late() and _has_candidates(request, name, relaxations[key], LAST_FACTOR, seed)
    ]
    below = 1.0
    for factor in (*RELAXATION_FACTORS, LAST_FACTOR):
        for name, key in tuple(left):
            if clock.late():
                return
            if factor == LAST_FACTOR or _has_candidates(request, name, relaxations[key], factor, seed):
                left.remove((name, key))
                yield Edge(name, key, _bisect(request, name, relaxations[key], (below, factor), seed))
        below = factor


def _has_candidates(request: Request, name: str, relaxation: Relaxation, factor: float, seed: int) -> bool:
    """Return True if a family has candidates for a request that is relaxed by a factor."""
    relaxed = relaxation(request, factor)
    return relaxed is not None and bool(_list_candidates(relaxed[0], name, seed))


def _bisect(request: Request, name: str, relaxation: Relaxation, ends: tuple[float, float], seed: int) -> float:
    """Return nearly the smallest factor between two with which a family has candidates; with the second it has some."""
    below, factor = ends
    for _ in range(N_HALVINGS):
        middle = (below * factor) ** 0.5
        has_some = _has_candidates(request, name, relaxation, middle, seed)
        below, factor = (below, middle) if has_some else (middle, factor)
    return factor


def confirm(request: Request, seed: int, clock: Clock, edge: Edge) -> str | None:
    """Return the value of a key with which a family's first candidate is good; None if none is.

    A little more of it is tried first, then the most: what that does not help, nothing between does.
    """
    relaxation = _relaxations(request)[edge.key]

    def find_value(factor: float, sides_apart: bool = True) -> str | None:
        relaxed = None if clock.late() else relaxation(request, factor)
        if relaxed is None:
            return None
        # the sides that were just enough by the laws may be too little: then all of them
        apart = sides_apart and relaxation is _enlarge_envelope
        choices = [_keep_unneeded_sides(request, (edge.family, seed), relaxed), relaxed] if apart else [relaxed]
        for asked, reported in choices[:1] if choices[0] == choices[-1] else choices:
            candidates = _list_candidates(asked, edge.family, seed)
            if (
                candidates
                and make_proposal(ProposalJob(edge.family, candidates[0], asked, seed, clock.deadline)).passes
            ):
                return reported
        return None

    factors = [edge.factor * more for more in FURTHER_FACTORS if edge.factor * more < LAST_FACTOR]
    if factors and (value := find_value(factors[0])) is not None:
        return value
    if (most := find_value(LAST_FACTOR, sides_apart=False)) is None:
        return None
    return next((value for factor in factors[1:] if (value := find_value(factor)) is not None), most)


def _relaxations(request: Request) -> dict[str, Relaxation]:
    """Return what may be relaxed of a request, by key."""
    relaxations: dict[str, Relaxation] = {"envelope": _enlarge_envelope, request.kind: _weaken_effort}
    relaxations["travel" if request.kind == "force" else "angle"] = _shorten_travel
    relaxations["ripple"] = _relax_ripple
    if request.safety > 1.0:
        relaxations["safety"] = _lower_safety
    if request.hysteresis is not None:
        relaxations["hysteresis"] = _relax_hysteresis
    if request.adjustable is not None:
        relaxations["adjustable"] = _narrow_adjustment
    return relaxations


def _list_candidates(request: Request, name: str, seed: int) -> Sequence[Candidate]:
    """Return a family's candidates, those first that probably fit."""
    propose = family(name).propose
    if not propose:
        return ()
    asked = request.with_strengths[-1]
    candidates = [candidate for candidate in propose(asked, Run(seed)).candidates if request.allows(candidate)]
    return sorted(candidates, key=lambda candidate: candidate.doubtful)


def _keep_unneeded_sides(request: Request, asked: tuple[str, int], relaxed: Relaxed) -> Relaxed:
    """Return a relaxed envelope of which those sides are as they were that need not be larger."""
    for side in reversed(range(len(request.envelope))):
        sides = tuple(
            old if k == side else new
            for k, (old, new) in enumerate(zip(request.envelope, relaxed[0].envelope, strict=True))
        )
        if request.travel >= sides[1] and request.kind == "force":
            continue
        fewer = _resize_envelope(request, sides)
        if _list_candidates(fewer[0], *asked):
            relaxed = fewer
    return relaxed


def _round_written(value: float, dimension: str, digits: int = 3) -> tuple[float, str]:
    """Return a value as a reader of its text has it, and the text."""
    text = format_short(value, dimension, digits)
    return read_quantity(text, dimension), text


def _resize_envelope(request: Request, sides: Sequence[float]) -> Relaxed:
    # a side that stays is as it was, to its last digit
    pairs = [
        _round_written(side, "length", 12 if side == old else 4)
        for side, old in zip(sides, request.envelope, strict=True)
    ]
    return replace(request, envelope=tuple(side for side, _ in pairs)), " x ".join(text for _, text in pairs)


def _enlarge_envelope(request: Request, factor: float) -> Relaxed:
    return _resize_envelope(request, [factor * side for side in request.envelope])


def _weaken_effort(request: Request, factor: float) -> Relaxed | None:
    if request.adjustable is not None:
        return None
    digits = 6 if request.banded else 3
    pairs = [
        _round_written(value / factor, request.kind, digits) for value in (request.low, request.target, request.high)
    ]
    (low, first), (target, middle), (high, last) = pairs
    if request.banded:
        return replace(request, low=low, target=request.target * low / request.low, high=high), f"[{first}, {last}]"
    low, high = target * request.low / request.target, target * request.high / request.target
    return replace(request, target=target, low=low, high=high), middle


def _shorten_travel(request: Request, factor: float) -> Relaxed:
    travel, text = _round_written(request.travel / factor, "length" if request.kind == "force" else "angle")
    return replace(request, travel=travel), text


def _relax_ripple(request: Request, factor: float) -> Relaxed | None:
    text = percent(factor * request.ripple)
    return (replace(request, ripple=share), text) if (share := read_quantity(text, "ratio")) < MAX_RIPPLE else None


def _lower_safety(request: Request, factor: float) -> Relaxed | None:
    text = f"{request.safety / factor:.3g}"
    return (replace(request, safety=float(text)), text) if float(text) >= 1.0 else None


def _relax_hysteresis(request: Request, factor: float) -> Relaxed | None:
    text = percent(factor * (request.hysteresis or 0.0))
    return (replace(request, hysteresis=share), text) if (share := read_quantity(text, "ratio")) < MAX_RIPPLE else None


def _narrow_adjustment(request: Request, factor: float) -> Relaxed | None:
    assert request.adjustable is not None
    pairs = [_round_written(request.target + (end - request.target) / factor, "force", 4) for end in request.adjustable]
    (low, first), (high, last) = pairs
    return (replace(request, adjustable=(low, high)), f"[{first}, {last}]") if low < high else None
