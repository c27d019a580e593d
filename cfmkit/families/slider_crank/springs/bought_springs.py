"""Springs of a catalogue for the joints of a slider-crank: which and how many.

For every joint at most one kind of spring in one number is taken, those with the smallest largest deviation from the
target (`best_sets`). Springs that the window would overwind, or that do not fit, are left out beforehand.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from cfmkit.families.findings import percent
from cfmkit.families.no_mechanism import Infeasible
from cfmkit.families.slider_crank.findings import finding
from cfmkit.families.slider_crank.springs.best_sets import best_sets
from cfmkit.families.slider_crank.springs.largest_turns_and_forces import MotionExtremes
from cfmkit.families.slider_crank.springs.spec import Bought
from cfmkit.families.slider_crank.unit_springs import JOINTS
from cfmkit.specs.units import format_short
from cfmkit.stock.springs.offers_and_generic_series import Miss, Offer, nearest
from cfmkit.stock.springs.spec import offers, wire_of
from cfmkit.stock.springs.stress_and_life import SpringInUse

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.families.slider_crank.spec import CrankDesign
    from cfmkit.families.slider_crank.springs.fit_rates import RateGoal
    from cfmkit.families.slider_crank.springs.targets import Task


@dataclass(frozen=True)
class SpringOption:
    """A spring for a joint, in a number.

    Attributes
    ----------
    joint : int
        Which, an index of `JOINTS`.
    offer : Offer
        The spring.
    count : int
        How many in parallel, in one leg.
    """

    joint: int
    offer: Offer
    count: int

    @property
    def written(self) -> Bought:
        """The same as a specification has it."""
        about = {"wound": wire_of(self.offer), "life": self.offer.life}
        return Bought.model_validate(
            {"at": JOINTS[self.joint], "name": self.offer.name, "count": self.count}
            | {key: value for key, value in about.items() if value is not None}
        )

    @property
    def rate(self) -> float:
        """Of all of them [N m/rad or N/m]."""
        return self.offer.rate * self.count

    @property
    def label(self) -> str:
        """Number, name and joint."""
        return f"{self.count} x {self.offer.name} at the {JOINTS[self.joint].replace('_', ' ')}"


@dataclass(frozen=True)
class Chosen:
    """Springs for all joints: the options taken, the rates that they add up to, and the largest deviation."""

    options: tuple[SpringOption, ...]
    rates: FloatArray
    deviation: float


def choose(task: Task, goal: RateGoal, window: tuple[float, float]) -> Chosen:
    """Return the springs of the catalogue that hold the target best.

    Raises
    ------
    Infeasible
        If none can be used, or none keeps the tolerance; the message has the nearest three.
    """
    options, refused = _options(task, window)
    if not options:
        told = nearest(refused) if refused else "it lists none of the kind that 'design.springs' needs"
        raise Infeasible(finding("no_spring_fits", f"no spring of the catalogue fits: {told} ('design.catalogue')"))
    tolerance = task.wanted.tolerance
    best = _sets(goal, options, 1)
    if best and (tolerance is None or best[0].deviation <= tolerance * (1 + 1e-9)):
        return best[0]
    misses = [_missed(one) for one in (_sets(goal, options, 3) if best else [])]
    told = nearest(misses) if misses else _none_together(task, refused)
    allowed = f", 'design.tolerance' allows {percent(tolerance)}" if tolerance and misses else ""
    raise Infeasible(finding("no_spring_fits", f"no springs of the catalogue hold the target: {told}{allowed}"))


def next_sets(task: Task, goal: RateGoal, window: tuple[float, float], count: int) -> list[Chosen]:
    """Return the sets of springs that hold the target best after the one that `choose` takes, within the tolerance."""
    most = np.inf if task.wanted.tolerance is None else task.wanted.tolerance * (1 + 1e-9)
    found = _sets(goal, _options(task, window)[0], 1 + count)[1:]
    return [one for one in found if one.deviation <= most]


def least_deviation(task: Task, goal: RateGoal, window: tuple[float, float]) -> float:
    """Return the deviation of the springs of the catalogue that hold the target best; infinite where none do."""
    found = _sets(goal, _options(task, window)[0], 1)
    return found[0].deviation if found else np.inf


def _sets(goal: RateGoal, options: list[SpringOption], count: int) -> list[Chosen]:
    """Return the sets of options that hold the target best."""
    least = np.zeros(len(JOINTS)) if goal.lower is None else goal.lower
    at = [_by_rate(options, joint, low) for joint, low in enumerate(least.tolist())]
    found = best_sets(goal, [np.array(sorted(one)) for one in at], count)
    return [
        Chosen(tuple(option for one, rate in zip(at, rates.tolist(), strict=True) if (option := one[rate])), rates, off)
        for off, rates in found
    ]


def _by_rate(options: list[SpringOption], joint: int, least: float) -> dict[float, SpringOption | None]:
    """Return what gives each rate that a joint may have: of equal ones the fewest springs, and none for zero."""
    own = sorted((one for one in options if one.joint == joint), key=lambda one: one.count)
    found: dict[str, SpringOption | None] = {} if least > 0 else {"0": None}
    for one in own:
        if one.rate >= least * (1 - 1e-9):
            found.setdefault(f"{one.rate:.12g}", one)  # three of 0.1 and one of 0.3 are the same
    return {one.rate if one else 0.0: one for one in found.values()}


def _missed(one: Chosen) -> Miss:
    label = " + ".join(option.label for option in one.options) or "no spring"
    return Miss(label, one.deviation, f"off by {percent(one.deviation)}")


def _none_together(task: Task, refused: list[Miss]) -> str:
    """Return why no set does what is required beside the target: to let the force be trimmed."""
    told = f"; {nearest(refused)}" if refused else ""
    way = "anchor_travel" if task.wanted.anchor_travel is not None else "angle_travel"
    return f"none is stiff enough for 'design.adjustment' within 'design.{way}'{told}"


def _options(task: Task, window: tuple[float, float]) -> tuple[list[SpringOption], list[Miss]]:
    """Return what can be used at each joint, and what is refused because it does not fit or is moved too far."""
    assembly, wanted = task.assembly, task.wanted
    ends = min(assembly.start, window[0]), max(assembly.start, window[1])
    moved = MotionExtremes(assembly, *ends).largest_turns
    usable: list[SpringOption] = []
    refused: list[Miss] = []
    for joint, name in enumerate(JOINTS):
        if name not in wanted.springs:
            continue
        kinds = ("torsion",) if joint < 3 else ("extension", "compression")
        cap = getattr(wanted.max_rates, name, None) if wanted.max_rates else None
        for offer in offers(wanted.catalogue or (), *kinds):
            label = f"{offer.name} at the {name.replace('_', ' ')}"
            reason = _why_not(offer, float(moved[joint]), wanted)
            if reason is not None:
                refused.append(Miss(label, *reason))
                continue
            own = [SpringOption(joint, offer, count) for count in offer.counts]
            soft = [one for one in own if cap is None or one.rate <= cap * (1 + 1e-9)]
            if not soft and cap is not None:
                least = min(one.rate for one in own)
                refused.append(Miss(label, least / cap - 1.0, f"stiffer than 'design.max_rates.{name}'"))
            usable += soft
    return usable, refused


def _why_not(offer: Offer, moved: float, wanted: CrankDesign) -> tuple[float, str] | None:
    """Return by what share a spring misses, and why; None where it can be used.

    `moved`: how far its joint is moved from the unloaded position at most, over the travel [rad or m].
    """
    kind: Literal["angle", "length"] = "angle" if offer.kind == "torsion" else "length"
    if offer.initial_tension:
        return 1.0, "its initial tension would load it in the unloaded position"
    room = wanted.spring_room
    if kind == "length" and room is not None and offer.free_length is not None and offer.free_length > room:
        told = f"too long, {format_short(offer.free_length, kind)} relaxed"
        return offer.free_length / room - 1.0, f"{told} ('design.spring_room' {format_short(room, kind)})"
    if offer.largest is not None and offer.largest < moved * (1 - 1e-9):
        allowed, needed = format_short(offer.largest, kind), format_short(moved, kind)
        return moved / offer.largest - 1.0, f"moved by {needed}, it allows {allowed}"
    return SpringInUse.of(offer, 0.0, moved).misses_life(wanted.spring_life) if wanted.spring_life is not None else None
