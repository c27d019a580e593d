"""From a candidate to a proposal: designed, written down, read again, analysed with its exact model, and judged."""

from __future__ import annotations

import time
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.designing.run_many_starts import NEVER, Clock
from cfmkit.errors import CfmError
from cfmkit.families import family
from cfmkit.families.base import function_named
from cfmkit.families.run_control import Run
from cfmkit.metrics import check, evaluate, values_of_family
from cfmkit.results import Status
from cfmkit.specs.units import format_short
from cfmkit.specs.yamlio import dump, read_document
from cfmkit.studies.suggest.yield_of_proposal import (
    GoodParts,
    MovedForYield,
    good_parts,
    moved_for_yield,
    with_made_parts,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from cfmkit.families.base import Room
    from cfmkit.families.wishes import Candidate, Wish
    from cfmkit.results import Result
    from cfmkit.specs.spec import Spec

LONGEST = 15.0
"""Seconds that one design may search."""

OUT_OF_TIME = "the time budget ended before it was designed and evaluated"
ENDED_EARLY = f"its design was not finished after {LONGEST:g} s"

LIVES = ("fatigue_life", "spring_life")
"""Metrics that say how many cycles the material, and bought springs, last."""

TRIES = 3
"""How often more is requested than what drawn parts did not have."""

MOST_ASKED = 0.9975
"""For a larger share the drawn parts of the search are too few."""

SLACK = 1e-9
"""On lengths that are compared: what writing a number down does to its last digit."""


@dataclass(frozen=True)
class ProposalJob:
    """A candidate of a family that is to be made and judged against a wish before a deadline, in `time.time` [s].

    `near`: what came of it, to be designed again with margins for the yield that is all it misses.
    """

    family: str
    candidate: Candidate
    wish: Wish
    seed: int
    deadline: float | None = None
    near: Proposal | None = None


@dataclass(frozen=True)
class Proposal:
    """What became of a candidate: plain values, which a journal can keep.

    Attributes
    ----------
    family, variant : str
        Whose it is.
    text : str
        The complete specification with the wish as its requirements; empty where nothing came of the candidate.
    missed : tuple of str
        One sentence for every hard wish that it misses when it is analysed from its file.
    message : str
        Why nothing came of it.
    numbers : mapping of str to float or None
        In SI: ``mean``, ``ripple``, ``hysteresis``, ``safety_factor``, ``across``, ``along``, ``depth``, ``parts``,
        ``life`` (cycles), ``yield`` (share of manufactured parts that are good, where one is wished),
        ``finer_deviation`` (of the mean by a better model, over the one it was judged by, less 1).
    notes : tuple of str
        What a reader has to know: what was assumed, what no model here says.
    movable : bool
        Whether all that it misses is the yield, and a design with margins might have it.
    """

    family: str
    variant: str
    text: str = ""
    missed: tuple[str, ...] = ()
    message: str = ""
    numbers: Mapping[str, float | None] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    movable: bool = False

    @property
    def good(self) -> bool:
        """Whether it does all that is wished."""
        return bool(self.text) and not self.missed

    @property
    def near(self) -> bool:
        """Whether it misses exactly one wish."""
        return bool(self.text) and len(self.missed) == 1

    @property
    def spec(self) -> Spec:
        """The specification."""
        return spec_of(self.family, self.text)

    def as_record(self) -> dict[str, Any]:
        """Return it as plain lists and mappings."""
        return {
            "family": self.family, "variant": self.variant, "text": self.text, "missed": list(self.missed),
            "message": self.message, "numbers": dict(self.numbers), "notes": list(self.notes), "movable": self.movable,
        }  # fmt: skip

    @classmethod
    def of_record(cls, record: Mapping[str, Any]) -> Proposal:
        """Return what a record says."""
        lists = {name: tuple(record[name]) for name in ("missed", "notes")}
        return cls(**{**record, **lists})


def spec_of(name: str, text: str) -> Spec:
    """Return the specification of a family that a text says."""
    return read_document(text, "design.yaml").bind(family(name).spec_type)


def made(job: ProposalJob) -> Proposal:
    """Return what becomes of a candidate; what its design or model refuses is its message, a bug is raised."""
    candidate, clock = job.candidate, Clock(job.deadline)
    try:
        if job.near is not None:
            return _with_margins(job, job.near, clock)
        spec, reported = _designed(job, clock)
        if spec is None:
            return Proposal(job.family, candidate.variant, message=reported)
        return judged(job.family, candidate.variant, spec, job.wish, job.seed, clock)
    except (CfmError, np.linalg.LinAlgError) as problem:  # a shape no solver was made for is no proposal
        return Proposal(job.family, candidate.variant, message=" ".join(str(problem).split())[:300])


def _designed(job: ProposalJob, clock: Clock) -> tuple[Spec | None, str]:
    """Return the candidate's specification, designed and finished; else None with the reason."""
    record, spec = family(job.family), job.candidate.spec
    if clock.late():
        return None, OUT_OF_TIME
    if job.candidate.design and record.design is not None:
        seconds, begun = _seconds(clock), time.time()
        design = record.design(spec, Run(job.seed, time_budget=seconds))
        if design.spec is None or design.status is not Status.COMPLETE:
            ended = time.time() - begun >= seconds
            return None, OUT_OF_TIME if clock.late() else ENDED_EARLY if ended else design.message
        spec = design.spec
    if clock.late():
        return None, OUT_OF_TIME
    if job.candidate.finish:
        spec = function_named(job.candidate.finish)(spec, job.wish)
    return spec, ""


def _with_margins(job: ProposalJob, near: Proposal, clock: Clock) -> Proposal:
    """Return a proposal designed again for the wished yield, or with what is missing of it."""
    if clock.late():
        return Proposal(job.family, near.variant, message=OUT_OF_TIME)

    def judge(spec: Spec) -> Proposal:
        return judged(job.family, near.variant, spec, job.wish, job.seed, clock)

    found = redesigned(near, job.candidate, job.wish, Run(job.seed, time_budget=clock.left()), judge)
    return found if found.good or not clock.late() else Proposal(job.family, near.variant, message=OUT_OF_TIME)


def redesigned(
    near: Proposal, candidate: Candidate, wish: Wish, run: Run, judge: Callable[[Spec], Proposal]
) -> Proposal:
    """Return a proposal whose made parts are good as often as wished, else the best found, with what is missing of it.

    Parameters
    ----------
    near : Proposal
        Which misses the yield alone.
    candidate : Candidate
        What it was made of.
    wish : Wish
        With a share of good parts.
    run : Run
        Seed, and how long it may take.
    judge : callable
        Analyses and judges a specification, drawn parts included.
    """
    clock = Clock.of(run.time_budget)
    wanted = asked = float(wish.good_parts or 0.0)
    best, spec, last, obstacle = near, near.spec, None, ""
    for _ in range(TRIES):
        run = replace(run, time_budget=clock.left())
        moved = None if clock.late() else moved_for_yield(candidate, spec, wish, asked, run)
        if moved is None:
            break
        last, there = moved, judge(moved.spec)
        if there.good:
            return replace(there, notes=(_note(moved), *there.notes))
        if not there.movable:
            obstacle = "; ".join(there.missed) or there.message
            break
        share = float(there.numbers["yield"] or 0.0)
        if share > float(best.numbers["yield"] or 0.0):
            best = there
        if moved.share < asked or asked >= MOST_ASKED:
            break
        asked, spec = min(MOST_ASKED, max(moved.share, asked) + 0.5 * (wanted - share)), there.spec
    return replace(best, missed=(f"{best.missed[0]}; {_tried(last, obstacle)}",), movable=False)


def _note(moved: MovedForYield) -> str:
    shares = f"{100.0 * moved.began:.3g} % of parts were good before and {100.0 * moved.share:.3g} % are now"
    return f"designed with margins for the yield: to first order {shares}"


def _tried(moved: MovedForYield | None, obstacle: str) -> str:
    """Return why margins did not help."""
    if moved is None:
        return "no value of the design may change to improve it"
    reported = f"design margins cannot improve it further, and the tolerance of {moved.costliest} costs most"
    return f"{reported}; larger changes make it fail otherwise: {obstacle}" if obstacle else reported


def _seconds(clock: Clock) -> float:
    """Return how long one design may search [s]."""
    left = clock.left()
    return LONGEST if left is None else min(LONGEST, max(left, 0.1))


def judged(name: str, variant: str, spec: Spec, wish: Wish, seed: int = 0, clock: Clock = NEVER) -> Proposal:
    """Return a specification as a proposal: it is written with the wish as its requirements, read, analysed, judged.

    Where a share of good parts is wished, the file says in its block `sensitivity` how they are made, and parts are
    drawn of what misses nothing else.
    """
    record = family(name)
    called = variant.replace(" ", "-").replace(",", "")
    # read back from its text: what is judged is what stands in the file, whose requirements change no analysis
    plain = spec_of(name, dump(spec.replace({"requirements": (), "design": None, "name": called})))
    result = record.analyze(plain, Run())
    if result.status is not Status.COMPLETE:
        return Proposal(name, variant, message=result.message)
    wished = plain.replace({"requirements": tuple(demanded(wish, result, values_of_family(record.values)))})
    text = dump(with_made_parts(wished, wish, seed))
    space: Room | None = function_named(record.room)(result) if record.room else None
    written = spec_of(name, text)
    outcomes = check(written.requirements, result, values_of_family(record.values))
    missed = [one.sentence for one in outcomes if not one.ok]
    missed += _outside(wish, space)
    missed += _too_short(wish, result)
    missed += _badly_adjusted(wish, result)
    numbers, movable = numbers_of(result, space, wish), False
    if wish.good_parts is not None and len(missed) <= 1:
        parts: GoodParts = good_parts(replace(result, spec=written), wish, clock, draw=not missed)
        if parts.late:
            return Proposal(name, variant, message=OUT_OF_TIME)
        movable = parts.movable and not missed
        missed += [parts.missed] if parts.missed else []
        numbers["yield"] = parts.share
    return Proposal(name, variant, text, tuple(missed), "", numbers, tuple(_notes(space, result)), movable)


def demanded(wish: Wish, result: Result, values: Any) -> Iterator[dict[str, Any]]:
    """Yield the requirements that say what is wished of the curve of a result, over the window of its analysis."""
    dimension = wish.kind
    yield {"metric": f"{wish.kind}_ripple", "max": f"{100 * wish.ripple:.12g} %"}
    low, high = (format_short(value, dimension, 12) for value in (wish.low, wish.high))
    if wish.banded:
        yield {"metric": f"{wish.kind}_min", "min": low}
        yield {"metric": f"{wish.kind}_max", "max": high}
    else:
        yield {"metric": f"{wish.kind}_mean", "min": low, "max": high}
    found = evaluate(result, None, None, values)
    if (factor := found.get("safety_factor")) is not None and factor.value is not None:
        yield {"metric": "safety_factor", "min": "1", "over": _pressed(wish, result)}
    if wish.hysteresis is not None and "unload" in result.curve.branches:
        lost = wish.hysteresis * wish.target * wish.travel
        yield {"metric": "hysteresis_area", "max": format_short(lost, "energy", 12)}
    for name in LIVES:
        life = found.get(name)
        if wish.cycles is not None and life is not None and life.value is not None:
            yield {"metric": name, "min": f"{wish.cycles}"}
    if wish.adjustable is not None and "force_change_max" in found:
        most = max(abs(end - wish.target) for end in wish.adjustable)
        yield {"metric": "force_change_max", "min": format_short(0.99 * most, "force", 12)}


def _pressed(wish: Wish, result: Result) -> tuple[str, str]:
    """Return over what a mechanism has to bear its stress: all it does; of made parts from half of the run-in on.

    A made part begins and ends a little before or after the perfect one: a metric over all that this does has no value.
    """
    window: Any = result.spec.at("analysis.window")
    if wish.good_parts is None or window is None or wish.kind == "torque":
        return "0 %", "100 %"
    return format_short(0.5 * float(window[0]), "length", 12), format_short(float(window[1]), "length", 12)


def _outside(wish: Wish, space: Room | None) -> Iterator[str]:
    """Yield by which sides a mechanism does not stay in the room; one that turns may lie either way in the plane."""
    if space is None:
        yield "the room that it needs is not known"
        return
    sides = [space.across, space.along]
    given = list(wish.room[:2])
    if wish.kind == "torque":
        sides, given = sorted(sides), sorted(given)
    for name, need, have in zip(("across the travel", "along the travel"), sides, given, strict=True):
        if need > have * (1.0 + SLACK):
            needed, given_side = _apart(need, have)
            yield f"needs {needed} {name}: {given_side} given"
    if wish.depth is not None and space.depth is None:
        yield f"its depth is not known: {space.assumed}"
    elif wish.depth is not None and space.depth is not None and space.depth > wish.depth * (1.0 + SLACK):
        needed, given_depth = _apart(space.depth, wish.depth)
        yield f"needs a depth of {needed}: {given_depth} given"


def _apart(one: float, other: float) -> tuple[str, str]:
    """Return two lengths that differ with as many digits as it takes to see that they do.

    Examples
    --------
    >>> _apart(0.012, 0.010), _apart(0.01000004, 0.010)
    (('12 mm', '10 mm'), ('10.00004 mm', '10 mm'))
    """
    for digits in range(4, 17):
        texts = format_short(one, "length", digits), format_short(other, "length", digits)
        if texts[0] != texts[1]:
            break
    return texts


def _too_short(wish: Wish, result: Result) -> Iterator[str]:
    """Yield whether the window that was judged is shorter than the travel that is wished."""
    window: Any = result.spec.at("analysis.window")
    length = 0.0 if window is None else float(window[1]) - float(window[0])
    if length < wish.travel * (1.0 - SLACK):
        dimension = "length" if wish.kind == "force" else "angle"
        reported = format_short(length, dimension), format_short(wish.travel, dimension)
        yield f"is constant over {reported[0]}: {reported[1]} wished"


def _badly_adjusted(wish: Wish, result: Result) -> Iterator[str]:
    """Yield what is wrong with the curves at the ends of the adjustment."""
    if wish.adjustable is None:
        return
    window: Any = result.spec.at("analysis.window")
    means = []
    for curve in result.curves:
        inside = (curve.motion >= float(window[0])) & (curve.motion <= float(window[1]))
        efforts = [curve.effort[inside & (curve.branch == name)] for name in curve.branches]
        if not efforts or not all(len(effort) and np.isfinite(effort).all() for effort in efforts):
            yield "has no force at one end of the adjustment"
            return
        means.append(float(np.mean([effort.mean() for effort in efforts])))
        if (ripple := max(1.0 - float(effort.min() / effort.max()) for effort in efforts)) > wish.ripple:
            at = format_short(means[-1], "force")
            yield f"changes by {100 * ripple:.3g} % at {at}: {100 * wish.ripple:.3g} % wished"
    low, high = wish.adjustable
    if min(means) > low * (1.0 + 0.025) or max(means) < high * (1.0 - 0.025):
        ends = [format_short(end, "force") for end in (min(means), max(means), low, high)]
        yield f"is adjustable from {ends[0]} to {ends[1]}: {ends[2]} to {ends[3]} wished"


def numbers_of(result: Result, space: Room | None, wish: Wish) -> dict[str, float | None]:
    """Return what proposals are compared by, in SI."""
    kind = wish.kind
    found = evaluate(result)

    def worst(name: str) -> float | None:
        values = [one.value for key, one in found.items() if key.partition("[")[0] == name and one.value is not None]
        return max(values) if values else None

    lost = worst("hysteresis_area")
    factor = found.get("safety_factor")
    means = [
        one.value for key, one in found.items() if key.partition("[")[0] == f"{kind}_mean" and one.value is not None
    ]
    mean = float(np.mean(means)) if means else None
    return {
        "mean": mean,
        "ripple": worst(f"{kind}_ripple"),
        "hysteresis": None if lost is None or not mean else lost / (mean * wish.travel),
        "safety_factor": None if factor is None else factor.value,
        "across": None if space is None else space.across,
        "along": None if space is None else space.along,
        "depth": None if space is None else space.depth,
        "parts": None if space is None else float(space.parts),
        "life": _life(found),
        "yield": None,
        "finer_deviation": None,
    }


def _life(found: Mapping[str, Any]) -> float | None:
    """Return the life of what lasts shortest; None where that of the material, or of a bought spring, is not known."""
    lives = [found[name].value for name in LIVES if name in found]
    known = [life for life in lives if life is not None]
    if len(known) < len(lives) or ("wire_stress_max" in found and "spring_life" not in found):
        return None
    return min(known, default=None)


def _notes(space: Room | None, result: Result) -> Iterator[str]:
    if space is not None and space.assumed:
        yield space.assumed
    for finding in result.warnings:
        yield f"{finding.name}: {finding.message}"
