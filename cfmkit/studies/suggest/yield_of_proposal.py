"""The share of a proposal's manufactured parts that would meet the requirements, and values moved until it suffices.

The share is estimated to first order, then counted in random parts. Parts have the tolerances that are assumed of the
process (`cfmkit.studies.parts.parts`) and are drawn as `cfmkit sensitivity` draws them of the block
`sensitivity` that the proposal's file says, so that its answer is the same.

A proposal that misses the required yield alone is designed again: with margins, as by `design.yield`. What may
move is what the design of the family chooses, in the same ranges, under the tolerances that the file of the proposal
states. To first order the search takes a moment; whether its estimate holds, parts say which are drawn of the new
design as of any other proposal. Where it does not, more is requested.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.designing.robust_design import NoPart, with_margins
from cfmkit.designing.rounded_and_reported_values import range_about
from cfmkit.designing.run_many_starts import Clock
from cfmkit.families import family
from cfmkit.families.run_control import Run
from cfmkit.results import Status
from cfmkit.specs.units import format_short
from cfmkit.studies.parts.drawn_parts import analyze_parts
from cfmkit.studies.parts.near_parts import Unknown, expected_shares
from cfmkit.studies.parts.parts import Parts, assume_errors, tolerances
from cfmkit.studies.parts.redesign import PartNumbers
from cfmkit.studies.parts.requirement_rows import requirement_rows
from cfmkit.studies.parts.share import percent

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from cfmkit.families.proposals import Candidate, Request
    from cfmkit.results import Result
    from cfmkit.specs.spec import Spec
    from cfmkit.studies.parts.near_parts import ExpectedShares
    from cfmkit.studies.parts.parts import Assumed

N_DRAWN = 100
"""Parts that are drawn of a proposal, each analysed in full: one standard deviation is 3 % where 90 % are good."""
AT_ONCE = 10  # parts between two looks at whether too many are bad already, or the time is up
MAX_REDESIGN_STEPS = 15
"""Steps of one redesign, which is ended by them and not by a clock: what can be reached is nearly reached in ten."""
OUT_OF_TIME = "the time budget ended before its manufactured parts were evaluated"


@dataclass(frozen=True)
class GoodParts:
    """Yield of a proposal's made parts, and its assumptions."""

    # of them that are good: of `N_DRAWN`, or to first order where `missed` says so; None if nothing is known
    share: float | None
    missed: str = ""  # why that is not what is required; empty where it is
    late: bool = False  # whether the time ended it before anything was known
    movable: bool = False  # whether a design with margins might have what is missing


@dataclass(frozen=True)
class MovedForYield:
    """A mechanism whose values were moved for a yield."""

    spec: Spec  # with the values moved
    # began, share: of good parts to first order, before and after
    began: float
    share: float
    costliest: str  # the value whose tolerance costs most


def with_made_parts(spec: Spec, request: Request, seed: int) -> Spec:
    """Return a specification whose block `sensitivity` says how its parts are made; as it is where nobody knows."""
    stated = tolerances(spec, request.stated.process) if request.stated.min_yield is not None else {}
    if not stated:
        return spec
    parameters: dict[str, Any] = {
        path: tolerance if isinstance(tolerance, tuple) else tolerance.model_dump(exclude_none=True)
        for path, tolerance in stated.items()
    }
    block = {
        "method": "tolerance", "parameters": parameters, "samples": N_DRAWN, "seed": seed,
        "min_yield": f"{100.0 * float(request.stated.min_yield or 0.0):.12g} %",
    }  # fmt: skip
    return spec.replace({"sensitivity": block})


def good_parts(
    # its analysis, with the request as its requirements and the block `sensitivity` of `with_made_parts`
    result: Result,
    request: Request,  # with a share of good parts
    clock: Clock,  # late, no more parts are judged
    draw: bool,  # whether to draw parts where the estimate of first order is good enough; else that is the answer
) -> GoodParts:
    """Return what becomes of the made parts of a mechanism."""
    wanted = float(request.stated.min_yield or 0.0)
    assumed = assume_errors(result.spec, request.stated.process)
    if assumed is None or result.spec.sensitivity is None:
        return GoodParts(
            None, "its yield is not known: the errors that the process causes in its dimensions are not known"
        )
    parts = Parts.from_block(result.spec, result.spec.sensitivity, N_DRAWN, result.spec.sensitivity.seed or 0)
    first = _estimate_shares(result, parts)
    most = 1.0 if first is None else _largest_possible_yield(first, assumed, request)
    if first is not None and first.good.value < wanted:
        text = _report_yield(first.good.value, f"made by {assumed.process.name}, linear estimate", wanted)
        return GoodParts(first.good.value, text + _remedy(first, assumed, most, wanted), movable=most >= wanted)
    if not draw:
        return GoodParts(None if first is None else first.good.value)
    drawn = _draw_parts(result, parts, assumed, wanted, clock)
    return replace(drawn, movable=first is not None and bool(drawn.missed) and most >= wanted)


def _largest_possible_yield(first: ExpectedShares, assumed: Assumed, request: Request) -> float:
    """Return the largest yield of any shape, by the modulus alone, which no shape makes any surer.

    A force that goes with a modulus between E0 and E1, all equally likely, is within [F0, F1] for a share of
    (1 - F0/F1) E1/(E1 - E0) at most: the range of moduli that give such forces is widest at its upper end.
    """
    if assumed.modulus is None or not first.proportional:
        return 1.0
    low, high = assumed.modulus
    return min(1.0, (1.0 - request.low / request.high) * high / (high - low))


def _remedy(first: ExpectedShares, assumed: Assumed, most: float, wanted: float) -> str:
    """Return what a yield would be without errors that a whole part has in common, and how one gets there."""
    better = {"once the modulus is measured": first.measured, "after a trim of each part's force": first.trimmed}
    least = first.good.value + 0.005
    shown = [f"{percent(share.value)} {words}" for words, share in better.items() if share.value > least]
    text = f" ({', '.join(shown)})" if shown else ""
    if most >= wanted or assumed.modulus is None:
        return text
    ends = " to ".join(format_short(end, "stress") for end in assumed.modulus)
    return (
        f"{text}; no shape exceeds {percent(most)}, because its force is proportional to the modulus of {ends}: "
        "measure it on a coupon and state it as material, fit it to a measured part with 'cfmkit "
        "calibrate', or trim the force of each part"
    )


def _estimate_shares(result: Result, parts: Parts) -> ExpectedShares | None:
    """Return the shares of good parts; None if only drawn parts can say them."""
    try:
        return expected_shares(result, parts, Run())
    except Unknown:
        return None


def _draw_parts(result: Result, parts: Parts, assumed: Assumed, wanted: float, clock: Clock) -> GoodParts:
    """Return how many drawn parts are good; the first that are too many bad ones end it."""
    good, looked, most_bad = 0, 0, (1.0 - wanted) * N_DRAWN + 1e-9
    for met in _judge_parts(result, parts):
        if clock.late():
            return GoodParts(None, OUT_OF_TIME, late=True)
        looked += len(met)
        good += int(met.sum())
        if looked - good > most_bad:
            made = f"of {looked} parts made by {assumed.process.name}"
            return GoodParts(good / looked, _report_yield(good / looked, made, wanted))
    return GoodParts(good / looked)


def _judge_parts(result: Result, parts: Parts) -> Iterator[NDArray[np.bool_]]:
    """Yield which of the next parts are good, (n,) of bool."""
    values = parts.draw()
    for begin in range(0, len(values), AT_ONCE):
        yield np.asarray(analyze_parts(parts, values[begin : begin + AT_ONCE], result, Run()).met.all(axis=1))


def _report_yield(share: float, made: str, wanted: float) -> str:
    return f"yield {percent(share)} {made}, wanted at least {percent(wanted)}"


def move_for_yield(candidate: Candidate, spec: Spec, request: Request, asked: float, run: Run) -> MovedForYield | None:
    """Return a proposal with the largest share of good parts that is found to first order, up to what is asked.

    Parameters
    ----------
    candidate : Candidate
        What it was made of: its block `design` says what may move.
    spec : Spec
        The proposal as it stands in its file, with requirements and the block `sensitivity`.
    request : Request
        Its thinnest leaf and its depth limit what moves.
    asked : float
        Share of good parts.
    run : Run
        Seed, and how long it may search.

    Returns
    -------
    MovedForYield or None
        None if nothing may move, or the proposal cannot be followed at a few poses.
    """
    block = spec.sensitivity
    free = _free(candidate, spec, request)
    nominal = family(spec.family).analyze(spec, Run())
    if not free or block is None or nominal.status is not Status.COMPLETE:
        return None
    rows = requirement_rows(nominal, spec, run)
    if rows is None:
        return None
    parts = Parts.from_block(spec, block, block.samples or N_DRAWN, run.seed)
    numbers = PartNumbers(parts, tuple(free), rows, run)
    problem = numbers.problem(free, asked, Clock.from_budgets(run.time_budget))
    try:
        redesigned = with_margins(problem, numbers.start, MAX_REDESIGN_STEPS)
    except NoPart:
        return None
    return MovedForYield(
        numbers.build_spec(redesigned, problem),
        redesigned.began,
        redesigned.share,
        numbers.costliest(redesigned, problem),
    )


def _free(candidate: Candidate, spec: Spec, request: Request) -> dict[str, tuple[float, float]]:
    """Return what may move, and in which ranges [SI]."""
    spec_of_candidate = candidate.spec
    ranges: dict[str, tuple[float, float]] = {}
    if candidate.design:
        ranges |= family(spec.family).free(spec_of_candidate, spec)
    for path in candidate.free:
        value: Any = spec.get_value(path)
        if isinstance(value, float):
            thin = path.endswith("thickness")
            ranges[path] = range_about(
                value, low=request.thinnest if thin else None, high=None if thin else request.depth
            )
    # a value at the end of its range, as a leaf as thin as can be made, may still move away from it
    at = {path: float(spec.get_value(path)) for path in ranges}
    inside = {path: (min(low, at[path]), max(high, at[path])) for path, (low, high) in ranges.items()}
    return {path: ends for path, ends in inside.items() if ends[0] < ends[1]}
