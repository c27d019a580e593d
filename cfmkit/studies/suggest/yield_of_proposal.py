"""The share of a proposal's manufactured parts that would meet the wish: to first order, then by random parts.

Parts have the tolerances that are assumed of the process (`cfmkit.studies.stated_or_assumed_tolerances`). They are
drawn as `cfmkit sensitivity` draws them of the block `sensitivity` that the proposal's file says, so that its answer
is the same.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.families.base import Run
from cfmkit.studies.sensitivity.parameters import parameters_of
from cfmkit.studies.stated_or_assumed_tolerances import DesignTolerances, assumed, tolerances
from cfmkit.studies.yield_by_assumed_tolerances import YieldUnknown, first_order_shares
from cfmkit.studies.yield_of_drawn_parts import judge

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from cfmkit.designing.run_many_starts import Clock
    from cfmkit.families.wishes import Wish
    from cfmkit.results import Result
    from cfmkit.specs.spec import Spec
    from cfmkit.studies.stated_or_assumed_tolerances import Assumed

PARTS = 100
"""Parts that are drawn of a proposal, each analysed in full: one standard deviation is 3 % where 90 % are good."""

AT_ONCE = 10
"""Parts between two looks at whether too many are bad already, or the time is up."""

OUT_OF_TIME = "the time budget ended before its manufactured parts were evaluated"


@dataclass(frozen=True)
class GoodParts:
    """What is known of a proposal's made parts.

    Attributes
    ----------
    share : float or None
        Of them that are good: of `PARTS`, or to first order where `missed` says so; None where nothing is known.
    missed : str
        Why that is not what is wished; empty where it is.
    late : bool
        Whether the time ended it before anything was known.
    """

    share: float | None
    missed: str = ""
    late: bool = False


def with_made_parts(spec: Spec, wish: Wish, seed: int) -> Spec:
    """Return a specification whose block `sensitivity` says how its parts are made; as it is where nobody knows."""
    stated = tolerances(spec, wish.process) if wish.good_parts is not None else {}
    if not stated:
        return spec
    parameters: dict[str, Any] = {
        path: {"normal": one.normal} if hasattr(one, "normal") else one for path, one in stated.items()
    }
    block = {
        "method": "tolerance", "parameters": parameters, "samples": PARTS, "seed": seed,
        "min_yield": f"{100.0 * float(wish.good_parts or 0.0):.12g} %",
    }  # fmt: skip
    return spec.replace({"sensitivity": block})


def good_parts(result: Result, wish: Wish, clock: Clock, draw: bool) -> GoodParts:
    """Return what becomes of the made parts of a mechanism.

    Parameters
    ----------
    result : Result
        Its analysis, with the wish as its requirements and the block `sensitivity` of `with_made_parts`.
    wish : Wish
        With a share of good parts.
    clock : Clock
        Late, no more parts are judged.
    draw : bool
        Whether to draw parts where the estimate of first order is good enough; else that is the answer.
    """
    wanted = float(wish.good_parts or 0.0)
    found = assumed(result.spec, wish.process)
    if found is None or result.spec.sensitivity is None:
        return GoodParts(None, "its yield is not known: the errors of its dimensions by the process are not known")
    first = _first_order(result, found)
    if first is not None and first[0] < wanted:
        return GoodParts(
            first[0], _reported(first[0], f"made by {found.process.name}, to first order", wanted, first[1])
        )
    if not draw:
        return GoodParts(None if first is None else first[0])
    return _drawn(result, found, wanted, clock)


def _first_order(result: Result, found: Assumed) -> tuple[float, float] | None:
    """Return the share of good parts and that with the modulus measured; None where only drawn parts can say it."""
    try:
        return first_order_shares(result, found, Run())
    except YieldUnknown:
        return None


def _drawn(result: Result, found: Assumed, wanted: float, clock: Clock) -> GoodParts:
    """Return how many drawn parts are good; the first that are too many bad ones end it."""
    good, looked, most_bad = 0, 0, (1.0 - wanted) * PARTS + 1e-9
    for met in _met(result):
        if clock.late():
            return GoodParts(None, OUT_OF_TIME, late=True)
        looked += len(met)
        good += int(met.sum())
        if looked - good > most_bad:
            made = f"of {looked} parts made by {found.process.name}"
            return GoodParts(good / looked, _reported(good / looked, made, wanted))
    return GoodParts(good / looked)


def _met(result: Result) -> Iterator[NDArray[np.bool_]]:
    """Yield which of the next parts are good, (n,) of bool."""
    spec = result.spec
    block = spec.sensitivity
    assert block is not None
    made = DesignTolerances(spec, block, parameters_of(spec, block), PARTS, block.seed or 0)
    values = made.drawn()
    for begin in range(0, PARTS, AT_ONCE):
        yield np.asarray(judge(made, values[begin : begin + AT_ONCE], result, Run()).met.all(axis=1))


def _reported(share: float, made: str, wanted: float, measured: float | None = None) -> str:
    text = f"yield {_percent(share)} {made}, wanted at least {_percent(wanted)}"
    better = measured is not None and measured > share + 0.005
    return f"{text} ({_percent(float(measured or 0.0))} once the modulus is measured)" if better else text


def _percent(share: float) -> str:
    return f"{100.0 * share:.3g} %"
