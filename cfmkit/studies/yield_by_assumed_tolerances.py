"""What yield is to be expected of a design without tolerances, by those that its process is assumed to hold.

The estimate is of first order and takes a few solutions: it says whether a design is worth drawing parts of, no more.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.errors import CfmError
from cfmkit.families import family
from cfmkit.families.base import function_named
from cfmkit.metrics import window_of
from cfmkit.specs.units import format_short
from cfmkit.stock.processes import SPRING_RATE
from cfmkit.studies.design_derivatives import exact_slopes, most_parts, slopes, step_of
from cfmkit.studies.parts_scaled_by_a_factor import SCALED
from cfmkit.studies.requirement_constraints import (
    metrics_of_part,
    numbers_in,
    numbers_of,
    numbers_of_known,
    places_of,
    quickly_sampled,
    rows_of,
    sampled_on_curves,
    stated_places,
)
from cfmkit.studies.stated_or_assumed_tolerances import MODULUS, assumed

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cfmkit.arrays import FloatArray
    from cfmkit.families.run_control import Run
    from cfmkit.results import Result
    from cfmkit.specs.spec import Spec
    from cfmkit.studies.requirement_constraints import RequirementRows
    from cfmkit.studies.stated_or_assumed_tolerances import Assumed

PARTS = 4000
"""The standard error of a share is then 0.8 % at most."""

PROPORTIONAL = 1e-3
"""To this share a force goes with the modulus; differences are as good as that."""

FEW_POINTS, ALIKE = 31, 1e-6
"""Points on the curves of parts, where the design's metrics are the same with so few, but for this share of them."""


def expected(result: Result, run: Run) -> str:
    """Return in a sentence how many parts of a design would be good, or why that is not known; empty of no part.

    Parameters
    ----------
    result : Result
        The analysis of the design.
    run : Run
        Seed of the parts.
    """
    spec = result.spec
    found = assumed(spec)
    if found is None or not spec.part_requirements or not result.curves:
        return ""
    name = found.process.name
    again = f"the same command with --set design.process={name}"
    try:
        shares = first_order_shares(result, found, run)
    except YieldUnknown as why:
        return f"no yield is estimated for the assumed tolerances of {name}: {why}; {again} draws parts"
    chosen = family(spec.family).free
    if chosen is None or not function_named(chosen)(spec, spec):
        return f"{_reported(found, shares)}; margins need 'design.free' to name values that may change"
    return f"{_reported(found, shares)}; with margins: {again} --set 'design.yield=90 %'"


class YieldUnknown(Exception):
    """Why nothing is said of a yield."""


@dataclass(frozen=True)
class FirstOrderShares:
    """Which share of parts is good, to first order."""

    good: float  # of parts as they are made
    measured: float  # of parts whose modulus is as it should be
    trimmed: float  # of parts whose mean force is brought to that of the design
    # whether the force goes with the modulus, as that of a part of one material without bought springs does
    proportional: bool


def _reported(found: Assumed, shares: FirstOrderShares) -> str:
    process = found.process
    used = {kind: getattr(process, kind) for kind in ("thickness", "position") if kind in found.kinds.values()}
    reported = [f"{kind} +- {format_short(sigma, 'length')}" for kind, sigma in used.items()]
    if found.modulus is not None:
        low, high = (format_short(end, "stress") for end in found.modulus)
        reported.append(f"modulus {low} to {high}")
    if found.rates:
        reported.append(f"rates of springs within {100.0 * SPRING_RATE:g} %")
    if found.as_stated:
        reported.append("moduli of beams' own materials as stated")
    reason = f": {process.reason}" if "thickness" in used else ""
    text = f"{_share(shares.good)} parts would meet the requirements if made by {process.name} "
    text += f"({', '.join(reported)}; assumed{reason}; to first order)"
    return text if found.modulus is None else f"{text}, {_share(shares.measured)} parts once the modulus is measured"


def _share(share: float) -> str:
    """Return a share of drawn parts, before the word 'parts': to two digits, and never as all of them or none."""
    if 100.0 * share >= 99.5:
        return "over 99 % of"
    return f"about {100.0 * share:.2g} % of" if share * PARTS >= 1.0 else "hardly any"


def first_order_shares(result: Result, found: Assumed, run: Run) -> FirstOrderShares:
    """Return the share of good parts, as they are, with the modulus as it should be, and after a trim.

    Parameters
    ----------
    result : Result
        The analysis of the design, with the requirements that its parts have to meet.
    found : Assumed
        The tolerances of its process.
    run : Run
        Seed of the parts.

    Raises
    ------
    YieldUnknown
        If it would take long, or a part near the design has no curve.
    """
    spec = result.spec
    paths = [*found.deviations, *found.ranges]
    places = places_of(result)
    quick = quickly_sampled(spec, places)
    first = sampled_on_curves(result, places, ()) if quick is None else quick
    if first is None:
        raise YieldUnknown("the design cannot be followed at a few poses")
    rows = rows_of(result, first, places)
    middle = _complete(numbers_of_known(result, quick, rows))
    exact = {path: numbers_in(one) for path, one in exact_slopes(spec, places, paths).items()}
    by_looks = bool(rows.metrics) or len(exact) < len(paths)
    if by_looks and 2 * len(paths) > most_parts(spec, by_looks=not rows.metrics):
        looks = family(spec.family).sampled is not None and not rows.metrics
        raise YieldUnknown(f"it needs {2 * len(paths)} {'parts' if looks else 'analyses'}, and takes a while")
    if rows.metrics and (thin := _thinned(result)) is not None:
        count = len(rows.metrics)
        numbers = _numbers(thin, rows, run, whole=quick is None)
        if np.allclose(numbers[-count:], middle[-count:], rtol=ALIKE, atol=0.0):
            spec, middle = thin, np.concatenate([middle[: len(middle) - len(numbers)], numbers])
    generator = np.random.default_rng([run.seed, 17])
    moved, by_modulus, proportional = np.zeros((PARTS, len(middle))), np.zeros((PARTS, len(middle))), False
    nominal = {path: float(spec.at(path)) for path in paths}
    steps = {path: (nominal[path], step_of(sigma)) for path, sigma in found.deviations.items()}
    steps |= {path: (nominal[path], 1e-3 * nominal[path]) for path in found.ranges}
    for path, slope in _slopes(spec, rows, steps, exact, run).items():
        if path in found.ranges:
            errors = generator.uniform(*found.ranges[path], PARTS) - nominal[path]
        else:
            errors = found.deviations[path] * generator.standard_normal(PARTS)
        if path == MODULUS:
            efforts = slice(len(rows.branches) * len(rows.places))
            proportional = np.allclose(nominal[path] * slope[efforts], middle[efforts], rtol=PROPORTIONAL, atol=0.0)
        change = np.outer(errors, slope)
        moved += change
        by_modulus = change if path == MODULUS else by_modulus
    parts = middle + moved, middle + moved - by_modulus, _trimmed(result, rows, middle, middle + moved)
    slack = 1e-9 * np.abs(rows.constant)  # a design on its limit keeps it
    good, measured, trimmed = (
        float((one @ rows.matrix.T + rows.constant >= -slack).all(axis=1).mean()) for one in parts
    )
    return FirstOrderShares(good, measured, trimmed, proportional)


def _trimmed(result: Result, rows: RequirementRows, middle: FloatArray, parts: FloatArray) -> FloatArray:
    """Return the numbers of parts after a trim, (n, q): the mean effort of each on the first branch is the design's.

    Efforts and the metrics that go with them are scaled, stresses stay: as `yield_of_drawn_parts` has it.
    """
    window = window_of(result)
    low, high = (rows.places[0], rows.places[-1]) if window is None else (window.lo, window.hi)
    slack = 1e-9 * (rows.places[-1] - rows.places[0])
    at = np.flatnonzero((rows.places >= low - slack) & (rows.places <= high + slack))
    level, means = (np.trapezoid(one[..., at], rows.places[at], axis=-1) for one in (middle, parts))
    scaled = [one.dimension in SCALED for one in rows.metrics]
    efforts = np.arange(len(middle)) < len(rows.branches) * len(rows.places)
    efforts[len(middle) - len(scaled) :] = scaled
    with np.errstate(divide="ignore", invalid="ignore"):
        factor = np.where(means, level / means, np.nan)  # without a force there is nothing to trim: never good
    return np.asarray(np.where(efforts, parts * factor[:, None], parts))


def _slopes(
    spec: Spec,
    rows: RequirementRows,
    steps: Mapping[str, tuple[float, float]],
    exact: Mapping[str, FloatArray],
    run: Run,
) -> dict[str, FloatArray]:
    """Return the derivatives of what rows look at; `exact`: those of effort and stress that are known."""
    whole = exact.keys() < steps.keys()
    if not whole and not rows.metrics:
        return {path: exact[path] for path in steps}

    def numbers(part: Spec) -> FloatArray | None:
        return _numbers(part, rows, run, whole)

    found = slopes(numbers, spec, steps)
    assert found is not None  # a part without numbers has ended the estimate
    if whole:
        return dict(zip(steps, found, strict=True))
    return {path: np.concatenate([exact[path], one]) for path, one in zip(steps, found, strict=True)}


def _thinned(result: Result) -> Spec | None:
    """Return a design whose curve has fewer points; None if metrics are taken from points, or are few already.

    Where the model knows the curve between its points, metrics are those of the whole curve.
    """
    points = getattr(getattr(result.spec, "analysis", None), "points", None)
    if result.closed is None or not isinstance(points, int) or points <= FEW_POINTS:
        return None
    return result.spec.replace({"analysis.points": FEW_POINTS})


def _numbers(spec: Spec, rows: RequirementRows, run: Run, whole: bool = True) -> FloatArray:
    """Return what rows look at of a part, all of it or metrics alone; a part without it ends the estimate."""
    try:
        found = numbers_of(spec, rows, run, stated_places(spec)) if whole else metrics_of_part(spec, rows, run)
    except CfmError as error:
        raise YieldUnknown(str(error)) from None
    return _complete(found)


def _complete(found: FloatArray | None) -> FloatArray:
    """Return numbers of a part, if it has them all: else the estimate ends."""
    if found is None or not np.isfinite(found).all():
        raise YieldUnknown(
            "a part near the design has no curve, or it ends within a window of the requirements (windows in shares of "
            "the travel, such as [1 %, 100 %], follow the travel of each part)"
        )
    return found
