"""Springs of a catalogue for the joints of a slider-crank: which and how many, by a mixed-integer linear programme.

For every joint at most one kind of spring in one number is taken; the largest deviation from the target is linear in
these yes-or-no choices, and HiGHS minimises it. Springs that the window would overwind are left out beforehand.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.families.findings import percent
from cfmkit.families.no_mechanism import Infeasible
from cfmkit.families.slider_crank.findings import finding
from cfmkit.families.slider_crank.springs.spec import Bought
from cfmkit.families.slider_crank.unit_springs import JOINTS
from cfmkit.specs.units import format_short
from cfmkit.stock.springs.catalogue import Miss, Offer, nearest
from cfmkit.stock.springs.in_use import SpringInUse
from cfmkit.stock.springs.spec import offers, wire_of

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cfmkit.arrays import FloatArray
    from cfmkit.families.slider_crank.springs.fit_rates import RateGoal
    from cfmkit.families.slider_crank.springs.targets import Task

PLACES = 41
"""Places of the window at which the programme looks."""

MOST = 80
"""Different rates that are tried per joint: of longer lists those that differ least from a neighbour are left out."""

SECONDS = 20.0
"""Time for the programme of one set; what it has found by then is taken."""


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
    few = goal.at(np.unique(np.linspace(0, len(goal.wanted) - 1, PLACES).round().astype(int)))
    best = _best(few, goal, options, ())
    tolerance = task.wanted.tolerance
    if best is not None and (tolerance is None or best.deviation <= tolerance * (1 + 1e-9)):
        return best
    misses: list[Miss] = []
    cuts: list[tuple[SpringOption, ...]] = []
    while best is not None and len(misses) < 3:
        label = " + ".join(one.label for one in best.options) or "no spring"
        misses.append(Miss(label, best.deviation, f"off by {percent(best.deviation)}"))
        cuts.append(best.options)
        best = _best(few, goal, options, tuple(cuts))
    told = nearest(misses) if misses else "none can be put together"
    allowed = f", 'design.tolerance' allows {percent(tolerance)}" if tolerance else ""
    raise Infeasible(finding("no_spring_fits", f"no springs of the catalogue hold the target: {told}{allowed}"))


def _options(task: Task, window: tuple[float, float]) -> tuple[list[SpringOption], list[Miss]]:
    """Return what can be used at each joint, and what is refused because the window moves it too far."""
    assembly, wanted = task.assembly, task.wanted
    ends = min(assembly.start, window[0]), max(assembly.start, window[1])
    moved = np.abs(assembly.units(np.linspace(*ends, 401)).turn).max(axis=1)
    usable: list[SpringOption] = []
    refused: list[Miss] = []
    for joint, name in enumerate(JOINTS):
        if name not in wanted.springs:
            continue
        kinds = ("torsion",) if joint < 3 else ("extension", "compression")
        own = []
        for offer in offers(wanted.catalogue or (), *kinds):
            reason = _why_not(offer, float(moved[joint]), joint)
            if reason is None and wanted.spring_life is not None:
                reason = SpringInUse.of(offer, 0.0, float(moved[joint])).misses_life(wanted.spring_life)
            if reason is not None:
                refused.append(Miss(f"{offer.name} at the {name.replace('_', ' ')}", *reason))
                continue
            own += [SpringOption(joint, offer, count) for count in offer.counts]
        cap = getattr(wanted.max_rates, name, None) if wanted.max_rates else None
        usable += _thinned([one for one in own if cap is None or one.rate <= cap])
    return usable, refused


def _why_not(offer: Offer, moved: float, joint: int) -> tuple[float, str] | None:
    """Return by what share a spring misses, and why; None where it can be used."""
    if offer.initial_tension:
        return 1.0, "its initial tension would load it in the unloaded position"
    if offer.largest is not None and offer.largest < moved * (1 - 1e-9):
        kind = "angle" if joint < 3 else "length"
        allowed, needed = format_short(offer.largest, kind), format_short(moved, kind)
        return moved / offer.largest - 1.0, f"moved by {needed}, it allows {allowed}"
    return None


def _thinned(options: list[SpringOption]) -> list[SpringOption]:
    """Return options of different rates, few and single springs first; of too many those evenly spread."""
    kept: dict[float, SpringOption] = {}
    for one in sorted(options, key=lambda one: (one.rate, one.count)):
        kept.setdefault(float(f"{one.rate:.3g}"), one)
    found = list(kept.values())
    if len(found) <= MOST:
        return found
    return [found[k] for k in np.unique(np.linspace(0, len(found) - 1, MOST).round().astype(int))]


def _best(
    few: RateGoal, goal: RateGoal, options: list[SpringOption], cuts: tuple[tuple[SpringOption, ...], ...]
) -> Chosen | None:
    """Return the set with the smallest largest deviation that is none of those cut off."""
    from scipy.optimize import Bounds, LinearConstraint, milp

    columns = np.column_stack([few.matrix[:, one.joint] * one.rate for one in options])
    count, one = len(options), np.ones((len(few.wanted), 1))
    rules = [
        LinearConstraint(np.hstack([columns, -one]), -np.inf, few.wanted),
        LinearConstraint(np.hstack([-columns, -one]), -np.inf, -few.wanted),
        LinearConstraint(np.array(list(_rows(options))), 0.0, 1.0),
    ]
    if goal.least is not None:
        row = np.array([goal.least[0][one.joint] * one.rate for one in options])
        rules.append(LinearConstraint(np.append(row, 0.0)[None], goal.least[1], np.inf))
    for cut in cuts:
        inside = np.array([1.0 if option in cut else -1.0 for option in options])
        rules.append(LinearConstraint(np.append(inside, 0.0)[None], -np.inf, len(cut) - 1.0))
    cost = np.append(np.zeros(count), 1.0)
    solved = milp(
        cost,
        constraints=rules,
        integrality=np.append(np.ones(count), 0.0),
        bounds=Bounds(0.0, np.append(np.ones(count), np.inf)),
        options={"time_limit": SECONDS, "mip_rel_gap": 1e-4},
    )
    if solved.x is None:
        return None
    taken = tuple(option for option, share in zip(options, solved.x[:count], strict=True) if share > 0.5)
    rates = np.zeros(len(JOINTS))
    for option in taken:
        rates[option.joint] += option.rate
    return Chosen(taken, rates, goal.deviation(rates))


def _rows(options: list[SpringOption]) -> Iterator[list[float]]:
    """Yield for each joint which options are its own: it takes one of them at most."""
    for joint in range(len(JOINTS)):
        yield [*(float(option.joint == joint) for option in options), 0.0]
