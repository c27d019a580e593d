"""Springs of a catalogue for the joints of a slider-crank: which and how many.

For every joint at most one kind of spring in one number is taken, those with the smallest largest deviation from the
target: every set is accounted for. Springs that the window would overwind, or that do not fit, are left out beforehand.

Sets are enumerated joint by joint. What cannot be part of a set as good as the best so far is left out: linear
programmes bound the rate of each joint, whatever the others are. Of the last two joints all pairs are looked at, since
with one of them the rates of the other are an interval in closed form.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.families.findings import percent
from cfmkit.families.slider_crank.findings import finding
from cfmkit.families.slider_crank.springs.fit_nonnegative_rates import minimax, ranges
from cfmkit.families.slider_crank.springs.largest_turns_and_forces import MotionExtremes
from cfmkit.families.slider_crank.springs.spec import Bought
from cfmkit.families.slider_crank.unit_springs import JOINT_NAMES, JOINTS_BY_NAME
from cfmkit.specs.units import format_short
from cfmkit.stock.springs.kinds import AXIAL_KINDS, TURNED_KINDS
from cfmkit.stock.springs.offers import PIN_SHARE, Miss, Offer, describe_nearest, guide_rod_for
from cfmkit.stock.springs.spec import block_of, offers
from cfmkit.stock.springs.stress_and_life import SpringInUse, orient_to_larger

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cfmkit.arrays import FloatArray
    from cfmkit.families.slider_crank.spec import CrankDesign
    from cfmkit.families.slider_crank.springs.fit_nonnegative_rates import RateGoal
    from cfmkit.families.slider_crank.springs.rate_fit_task import SpringTask
    from cfmkit.stock.material_and_part_spec import Pins


N_BOUND_PLACES = 41  # places of the window that bounds are taken from; sets themselves are judged at all places
BOUND_RTOL = 1e-9  # bounds are wider by this share: rounding must not leave a set out


def best_sets(goal: RateGoal, offered: Sequence[FloatArray], count: int = 1) -> list[tuple[float, FloatArray]]:
    """Return the sets with the smallest largest deviation, the best first: deviation, and rates (m,) of m joints.

    `offered`: rates that each joint may have, increasing; zero among them where it may have no spring. Empty if no set
    keeps what the goal requires beside the deviation.
    """
    if any(not len(rates) for rates in offered):
        return []
    few = goal.select_rows(np.unique(np.linspace(0, len(goal.wanted) - 1, N_BOUND_PLACES).round().astype(int)))
    # limits of single rates are those of what is offered
    scan = _Sets(goal, replace(few, upper=np.full(len(offered), np.inf), lower=None), count)
    scan.begin(offered)
    scan.scan([np.asarray(rates) for rates in offered])
    return sorted(scan.best, key=lambda pair: pair[0])


@dataclass(frozen=True)
class SpringOption:
    """A spring for a joint, in a number."""

    joint: int  # which, an index of `JOINT_NAMES`
    offer: Offer  # the spring
    count: int  # how many in parallel, in one leg
    deflection: float = 0.0  # largest one over the travel [rad or m]

    @property
    def written(self) -> Bought:
        """The same as a specification has it, with a rod where it would buckle."""
        offer = self.offer
        keys: dict[str, object] = {"at": JOINT_NAMES[self.joint], "count": self.count}
        if offer.spring_type.needs_guide:
            keys |= {"loaded": offer.spring_type.kind, "free_length": offer.free_length}
            if offer.guide_tube is None and offer.wound is not None:
                needed = self.deflection > offer.unguided
                guides = offer.guide_rod is not None and offer.guide_rod >= offer.wound.thinnest_guide_rod
                keys["guide_rod"] = (offer.guide_rod if guides else guide_rod_for(offer.wound)) if needed else None
        return Bought.model_validate(block_of(offer, **keys))

    @property
    def rate(self) -> float:
        """Of all of them [N m/rad or N/m]."""
        return self.offer.rate * self.count

    @property
    def label(self) -> str:
        """Number, name and joint."""
        return f"{self.count} x {self.offer.name} at the {JOINTS_BY_NAME[JOINT_NAMES[self.joint]].words}"


@dataclass(frozen=True)
class ChosenSet:
    """Springs for all joints: the options taken, the rates that they add up to, and the largest deviation."""

    options: tuple[SpringOption, ...]
    rates: FloatArray
    deviation: float


def choose(task: SpringTask, goal: RateGoal, window: tuple[float, float]) -> ChosenSet:
    """Return the springs of the catalogue that hold the target best.

    Raises Infeasible if none can be used, or none keeps the tolerance; the message has the nearest three.
    """
    options, refused = _options(task, window)
    if not options:
        reported = describe_nearest(refused) if refused else "it lists none of the kind that 'design.springs' needs"
        raise finding.infeasible("no_spring_fits", f"no spring of the catalogue fits: {reported} ('design.catalogue')")
    tolerance = task.wanted.tolerance
    best = _sets(goal, options, 1)
    if best and (tolerance is None or best[0].deviation <= tolerance * (1 + 1e-9)):
        return best[0]
    misses = [_miss_of(chosen) for chosen in (_sets(goal, options, 3) if best else [])]
    reported = describe_nearest(misses) if misses else _none_together(task, refused)
    allowed = f", 'design.tolerance' allows {percent(tolerance)}" if tolerance and misses else ""
    raise finding.infeasible("no_spring_fits", f"no springs of the catalogue keep the target: {reported}{allowed}")


def next_sets(task: SpringTask, goal: RateGoal, window: tuple[float, float], count: int) -> list[ChosenSet]:
    """Return the sets of springs that hold the target best after the one that `choose` takes, within the tolerance."""
    most = np.inf if task.wanted.tolerance is None else task.wanted.tolerance * (1 + 1e-9)
    sets = _sets(goal, _options(task, window)[0], 1 + count)[1:]
    return [chosen for chosen in sets if chosen.deviation <= most]


def least_deviation(task: SpringTask, goal: RateGoal, window: tuple[float, float]) -> float:
    """Return the deviation of the springs of the catalogue that hold the target best; infinite where none do."""
    sets = _sets(goal, _options(task, window)[0], 1)
    return sets[0].deviation if sets else np.inf


def _sets(goal: RateGoal, options: list[SpringOption], count: int) -> list[ChosenSet]:
    """Return the sets of options that hold the target best."""
    least = np.zeros(len(JOINT_NAMES)) if goal.lower is None else goal.lower
    at = [_group_by_rate(options, joint, low) for joint, low in enumerate(least.tolist())]
    ranked = best_sets(goal, [np.array(sorted(joint_options)) for joint_options in at], count)
    return [
        ChosenSet(
            tuple(
                option
                for joint_options, rate in zip(at, rates.tolist(), strict=True)
                if (option := joint_options[rate])
            ),
            rates,
            off,
        )
        for off, rates in ranked
    ]


def _group_by_rate(options: list[SpringOption], joint: int, least: float) -> dict[float, SpringOption | None]:
    """Return what gives each rate that a joint may have: of equal ones the fewest springs, and none for zero."""
    joint_options = sorted((option for option in options if option.joint == joint), key=lambda option: option.count)
    by_rate: dict[str, SpringOption | None] = {} if least > 0 else {"0": None}
    for option in joint_options:
        if option.rate >= least * (1 - 1e-9):
            by_rate.setdefault(f"{option.rate:.12g}", option)  # three of 0.1 and one of 0.3 are the same
    return {option.rate if option else 0.0: option for option in by_rate.values()}


def _miss_of(chosen: ChosenSet) -> Miss:
    label = " + ".join(option.label for option in chosen.options) or "no spring"
    return Miss(label, chosen.deviation, f"off by {percent(chosen.deviation)}")


def _none_together(task: SpringTask, refused: list[Miss]) -> str:
    """Return why no set does what is required beside the target: to let the force be trimmed."""
    reported = f"; {describe_nearest(refused)}" if refused else ""
    key = "anchor_travel" if task.wanted.anchor_travel is not None else "angle_travel"
    return f"none is stiff enough for 'design.adjustment' within 'design.{key}'{reported}"


def _options(task: SpringTask, window: tuple[float, float]) -> tuple[list[SpringOption], list[Miss]]:
    """Return what can be used at each joint, and what is refused because it does not fit or is moved too far."""
    assembly, wanted = task.assembly, task.wanted
    ends = min(assembly.start, window[0]), max(assembly.start, window[1])
    high, low = (turns[:, 0] for turns in MotionExtremes(assembly, *ends).turns)
    usable: list[SpringOption] = []
    refused: list[Miss] = []
    for joint, name in enumerate(JOINT_NAMES):
        if name not in wanted.springs:
            continue
        spring_types = (AXIAL_KINDS if name == "slider" else TURNED_KINDS).values()
        cap = getattr(wanted.max_rates, name, None) if wanted.max_rates else None
        for offer in offers(wanted.catalogue or (), *spring_types):
            label = f"{offer.name} at the {JOINTS_BY_NAME[name].words}"
            ends = orient_to_larger(float(high[joint]), float(low[joint]))
            pins = task.spec.mechanism.pins if name != "slider" else None
            reason = _why_not(offer, ends, wanted) or _binds(offer, max(map(abs, ends)), pins)
            if reason is not None:
                refused.append(Miss(label, *reason))
                continue
            joint_options = [SpringOption(joint, offer, count, max(map(abs, ends))) for count in offer.counts]
            soft = [option for option in joint_options if cap is None or option.rate <= cap * (1 + 1e-9)]
            if not soft and cap is not None:
                least = min(option.rate for option in joint_options)
                refused.append(Miss(label, least / cap - 1.0, f"stiffer than 'design.max_rates.{name}'"))
            usable += soft
    return usable, refused


def _why_not(offer: Offer, ends: tuple[float, float], wanted: CrankDesign) -> tuple[float, str] | None:
    """Return by what share a spring misses, and why; None if it can be used.

    `ends`: how far its joint is moved from the unloaded position at least and at most, over the travel [rad or m].
    """
    moved = ends[1]
    dimension = offer.spring_type.dimension
    if offer.initial_tension:
        return 1.0, "its initial tension would load it in the unloaded position"
    room = wanted.spring_room
    if dimension == "length" and room is not None and offer.free_length is not None and offer.free_length > room:
        reported = f"too long, {format_short(offer.free_length, dimension)} relaxed"
        return offer.free_length / room - 1.0, f"{reported} ('design.spring_room' {format_short(room, dimension)})"
    if offer.largest is not None and offer.largest < moved * (1 - 1e-9):
        allowed, needed = (format_short(size, dimension) for size in (offer.largest, moved))
        return moved / offer.largest - 1.0, f"deflected by {needed}, it allows {allowed}"
    return SpringInUse.from_offer(offer, *ends).why_too_weak(wanted.spring_life, wanted.spring_safety)


def _binds(offer: Offer, turned: float, pins: Pins | None) -> tuple[float, str] | None:
    """Return by what share a spring that is turned so far [rad] is too narrow for its pin; None if it fits."""
    if offer.wound is None or pins is None:
        return None
    inside, needed = offer.wound.inner_diameter_at(turned), pins.diameter / PIN_SHARE
    if inside >= needed:
        return None
    reported, pin = format_short(max(inside, 0.0), "length"), format_short(pins.diameter, "length")
    return needed / max(inside, 1e-9) - 1.0, f"wound up it is {reported} wide inside, too narrow for a pin of {pin}"


@dataclass
class _Sets:
    """The best sets so far."""

    goal: RateGoal
    few: RateGoal
    count: int
    best: list[tuple[float, FloatArray]] = field(default_factory=list)

    @property
    def bound(self) -> float:
        """Return the deviation that a set must not exceed to be among the best."""
        return self.best[-1][0] if len(self.best) == self.count else np.inf

    def take(self, sets: FloatArray) -> None:
        """Take those of some sets (k, m) that are among the best."""
        if self.goal.least is not None:
            row, least = self.goal.least
            sets = sets[sets @ row >= least - BOUND_RTOL * abs(least)]
        if not len(sets):
            return
        off = np.abs(sets @ self.goal.matrix.T - self.goal.wanted).max(axis=1)
        for k in np.argsort(off, kind="stable")[: self.count].tolist():
            is_known = any(np.array_equal(sets[k], other_set) for _, other_set in self.best)
            if off[k] <= self.bound and not is_known:
                self.best = sorted([*self.best, (float(off[k]), sets[k])], key=lambda pair: pair[0])[: self.count]

    def begin(self, offered: Sequence[FloatArray]) -> None:
        """Take the sets next to the best rates that could be had if every rate could: they bound all others."""
        rates = minimax(self.few)
        if rates is not None:
            neighbours = [
                rates_of_joint[max(0, int(np.searchsorted(rates_of_joint, rate)) - 1) :][:2]
                for rates_of_joint, rate in zip(offered, rates, strict=True)
            ]
            self.take(np.array(list(product(*neighbours))))

    def scan(self, offered: list[FloatArray]) -> None:
        """Look at all sets of what is offered that may be among the best."""
        open_ = [k for k, rates in enumerate(offered) if len(rates) > 1]
        if len(open_) <= 2:
            self._search_pairs(offered, open_)
            return
        offered = self._restrict_to_bound(offered)
        if any(not len(rates) for rates in offered):
            return
        joint = min((k for k in open_ if len(offered[k]) > 1), key=lambda k: len(offered[k]), default=open_[0])
        rates = offered[joint]
        # the middle first: the sooner a good set is found, the more is left out
        for rate in rates[np.argsort(np.abs(rates - 0.5 * (rates[0] + rates[-1])), kind="stable")]:
            self.scan([np.array([rate]) if k == joint else rates_of_joint for k, rates_of_joint in enumerate(offered)])

    def _restrict_to_bound(self, offered: list[FloatArray]) -> list[FloatArray]:
        """Return what is left of each joint's rates if no place may be off by more than the bound."""
        if not np.isfinite(self.bound):
            return offered
        ends = np.array([[rates_of_joint[0], rates_of_joint[-1]] for rates_of_joint in offered])
        worst = self.bound * (1 + BOUND_RTOL) + 1e-12
        limits = ranges(replace(self.few, lower=ends[:, 0], upper=ends[:, 1]), worst)
        if np.isnan(limits).any():
            return [rates_of_joint[:0] for rates_of_joint in offered]
        reach = 1e-6 * np.abs(limits).max(axis=1, keepdims=True) * np.array([-1.0, 1.0])
        return [
            rates_of_joint[(rates_of_joint >= low) & (rates_of_joint <= high)]
            for rates_of_joint, (low, high) in zip(offered, limits + reach, strict=True)
        ]

    def _search_pairs(self, offered: list[FloatArray], open_: list[int]) -> None:
        """Look at all sets in which at most two joints have more than one rate."""
        first, second = (open_ + [k for k in range(len(offered)) if k not in open_])[:2]
        fixed = np.array([rates_of_joint[0] for rates_of_joint in offered])
        fixed[[first, second]] = 0.0
        first_rates, second_rates = offered[first], offered[second]
        base = self.few.matrix @ fixed - self.few.wanted + np.outer(first_rates, self.few.matrix[:, first])
        column = self.few.matrix[:, second]
        for k in np.argsort(np.abs(base).min(axis=1), kind="stable").tolist():
            low, high = _interval(base[k], column, self.bound * (1 + BOUND_RTOL) + 1e-12)
            mates = second_rates[(second_rates >= low) & (second_rates <= high)]
            if len(mates):
                sets = np.tile(fixed, (len(mates), 1))
                sets[:, first], sets[:, second] = first_rates[k], mates
                self.take(sets)


def _interval(base: FloatArray, column: FloatArray, worst: float) -> tuple[float, float]:
    """Return between which rates no place is off by more than `worst`: |base + rate column| <= worst."""
    moved = column != 0.0
    if not np.isfinite(worst):
        return -np.inf, np.inf
    if (np.abs(base[~moved]) > worst).any():
        return np.inf, -np.inf
    ends = np.sort(np.array([-worst - base[moved], worst - base[moved]]) / column[moved], axis=0)
    low, high = (float(ends[0].max()), float(ends[1].min())) if moved.any() else (-np.inf, np.inf)
    reach = 1e-9 * max(abs(low), abs(high)) if np.isfinite([low, high]).all() else 0.0
    return low - reach, high + reach
