"""Linear estimates of the parts near a design: which share is good, and a test plan with the forces to expect.

The estimate is of first order and takes a few solutions: it says whether a design is worth drawing parts of, no more.

The test plan is one sentence: what to make, what to measure on it, and what force to expect where, of 95 % of parts.
Forces are linear estimates of parts drawn from `design.tolerances`, or from what the process is assumed to hold. The
dimensions are those whose errors move the force most: what is worth measuring before the force is looked at. What is no
dimension and moves it as much, a modulus or the rate of a spring, is named beside them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.designing.robust_design import SIGMA_STEP, NearParts, differentiate
from cfmkit.errors import CfmError
from cfmkit.families import family
from cfmkit.metrics import window_of
from cfmkit.specs.units import format_short
from cfmkit.stock.processes import SPRING_RATE
from cfmkit.studies.parts import requirement_rows as rr
from cfmkit.studies.parts.drawn_parts import FORCE_DIMENSIONS
from cfmkit.studies.parts.parts import MODULUS_KEY, Parts, assume_errors
from cfmkit.studies.parts.share import Share

if TYPE_CHECKING:
    from collections.abc import Callable

    from cfmkit.arrays import FloatArray
    from cfmkit.families.run_control import Run
    from cfmkit.results import Result
    from cfmkit.specs.spec import Spec
    from cfmkit.studies.parts.parts import Assumed
    from cfmkit.studies.parts.requirement_rows import RequirementRows

    Numbers = Callable[[Spec], FloatArray | None]


N_DRAWN = 4000  # parts that are drawn: the standard error of a share is then 0.8 % at most
PROPORTIONALITY_RTOL = 1e-3  # to this share a force goes with the modulus; differences are as good as that
FEW_POINTS, SAME_RTOL = 31, 1e-6
"""Points on the curves of parts, where the design's metrics are the same with so few, but for this share of them."""
MAX_QUICK, MAX_ANALYSES = 24, 12
"""Parts solved for an estimate that nobody requested, by the quick way or by analyses: some tenths of a second."""


class Unknown(Exception):
    """Why nothing is said of parts near a design."""


def near_parts(parts: Parts, middle: FloatArray, numbers: Numbers, exact: FloatArray | None = None) -> NearParts:
    """Return the numbers of parts by linear estimate.

    `middle`: those of the design, (q,); `numbers`: of a part, all of them or those after the exactly known ones;
    `exact`: exact derivatives of the first numbers by all errors, (k, d).

    Raises Unknown if a part near the design has no numbers.
    """
    if exact is not None and len(exact) == len(middle):
        return NearParts(middle, exact)

    def analyze_shifted(k: int, value: float) -> FloatArray:
        return _require(numbers, parts.spec.replace({parts.paths[k]: value}, as_made=True))

    step = SIGMA_STEP * parts.deviations
    derivatives = differentiate(analyze_shifted, np.column_stack([parts.nominal - step, parts.nominal + step]))
    assert derivatives is not None  # a part without numbers has ended the estimate
    return NearParts(middle, derivatives if exact is None else np.concatenate([exact, derivatives]))


def _require(numbers: Numbers, part: Spec) -> FloatArray:
    try:
        return _complete(numbers(part))
    except CfmError as error:
        raise Unknown(str(error)) from None


def _complete(derivatives: FloatArray | None) -> FloatArray:
    """Return the numbers of a part, if it has them all."""
    if derivatives is None or not np.isfinite(derivatives).all():
        raise Unknown(
            "a part near the design has no curve, or it ends within a window of the requirements (windows in shares of "
            "the travel, such as [1 %, 100 %], follow the travel of each part)"
        )
    return derivatives


def _refuse_many(parts: Parts, quick: bool = True) -> None:
    quick = quick and family(parts.spec.family).sample is not None
    count = 2 * len(parts.paths)
    if count > (MAX_QUICK if quick else MAX_ANALYSES):
        raise Unknown(f"it needs {count} {'parts' if quick else 'analyses'}, and takes a while")


def efforts_of_parts(parts: Parts, places: FloatArray, branch: str, run: Run) -> NearParts:
    """Return the effort of parts on one branch at places (p,), by linear estimate.

    Raises Unknown if it would take long, or a part near the design cannot be followed.
    """

    def efforts(part: Spec) -> FloatArray | None:
        sampled = rr.sample_part(part, places, run)
        return None if sampled is None else sampled.effort.get(branch)

    exact = rr.exact_derivatives(parts.spec, places, parts.paths)
    columns = [exact[path].effort.get(branch) for path in parts.paths if path in exact]
    slopes = np.array(columns).T if len(columns) == len(parts.paths) and all(c is not None for c in columns) else None
    if slopes is None:
        _refuse_many(parts)
    return near_parts(parts, _require(efforts, parts.spec), efforts, slopes)


@dataclass(frozen=True)
class ExpectedShares:
    """Yields by linear estimate."""

    good: Share  # of parts as they are made
    measured: Share  # of parts whose modulus is as it should be
    trimmed: Share  # of parts whose mean force is brought to that of the design
    # whether the force goes with the modulus, as that of a part of one material without bought springs does
    proportional: bool


def expected_shares(result: Result, parts: Parts, run: Run) -> ExpectedShares:
    """Return the yields of an analysed design by linear estimate.

    Raises Unknown if it would take long, or a part near the design has no curve.
    """
    spec, places = result.spec, rr.places_of(result)
    quick = rr.sample_quickly(spec, places)
    first = rr.sample_curves(result, places, ()) if quick is None else quick
    if first is None:
        raise Unknown("the design cannot be followed at a few poses")
    rows = rr.rows_of(result, first, places)
    middle = _complete(rr.numbers_of_known(result, quick, rows))
    exact = rr.exact_derivatives(spec, places, parts.paths)
    slopes = None
    if set(parts.paths) <= set(exact):
        slopes = np.array([rr.numbers_in(exact[path]) for path in parts.paths]).T
    if rows.metrics or slopes is None:
        _refuse_many(parts, quick=not rows.metrics)
    if rows.metrics and (thin := _thin_curve(result)) is not None:
        count, numbers = (len(rows.metrics), _require(lambda part: _numbers(part, rows, run, quick is None), thin))
        if np.allclose(numbers[-count:], middle[-count:], rtol=SAME_RTOL, atol=0.0):
            parts, middle = replace(parts, spec=thin), np.concatenate([middle[: len(middle) - len(numbers)], numbers])
    parts_near = near_parts(parts, middle, lambda part: _numbers(part, rows, run, slopes is None), slopes)
    values = parts.draw(N_DRAWN)
    errors, still, proportional = values - parts.nominal, values, False
    if MODULUS_KEY in parts.paths:
        k = parts.paths.index(MODULUS_KEY)
        still = parts.remove_errors(values, (k,))
        change = parts.nominal[k] * parts_near.by_error[: rows.efforts, k]
        proportional = bool(np.allclose(change, middle[: rows.efforts], rtol=PROPORTIONALITY_RTOL, atol=0.0))
    made = parts_near.numbers(errors)

    def share(numbers: FloatArray) -> Share:
        kept = rows.limits(numbers) >= -1e-9 * np.abs(rows.constant)  # a design on its limit keeps it
        return Share(int(kept.all(axis=1).sum()), 0, len(numbers))

    measured, trimmed = parts_near.numbers(still - parts.nominal), _trim_parts(result, rows, middle, made)
    return ExpectedShares(share(made), share(measured), share(trimmed), proportional)


def _numbers(part: Spec, rows: RequirementRows, run: Run, whole: bool) -> FloatArray | None:
    """Return what rows look at of a part, all of it or metrics alone."""
    return rr.numbers_of(part, rows, run, rr.stated_places(part)) if whole else rr.metrics_of_part(part, rows, run)


def _thin_curve(result: Result) -> Spec | None:
    """Return a design whose curve has fewer points; None if metrics are taken from points, or are few already.

    Where the model knows the curve between its points, metrics are those of the whole curve.
    """
    points = getattr(getattr(result.spec, "analysis", None), "points", None)
    if result.closed is None or not isinstance(points, int) or points <= FEW_POINTS:
        return None
    return result.spec.replace({"analysis.points": FEW_POINTS})


def _trim_parts(result: Result, rows: RequirementRows, middle: FloatArray, parts: FloatArray) -> FloatArray:
    """Return the numbers of parts after a trim, (n, q): the mean effort of each on the first branch is the design's.

    Efforts and the metrics that go with them are scaled, stresses stay: as of parts that are analysed.
    """
    window = window_of(result)
    low, high = (rows.places[0], rows.places[-1]) if window is None else (window.lo, window.hi)
    slack = 1e-9 * (rows.places[-1] - rows.places[0])
    at = np.flatnonzero((rows.places >= low - slack) & (rows.places <= high + slack))
    level, means = (np.trapezoid(efforts[..., at], rows.places[at], axis=-1) for efforts in (middle, parts))
    scaled = np.arange(len(middle)) < rows.efforts
    scaled[len(middle) - len(rows.metrics) :] = [metric.dimension in FORCE_DIMENSIONS for metric in rows.metrics]
    with np.errstate(divide="ignore", invalid="ignore"):
        factor = np.where(means, level / means, np.nan)  # without a force there is nothing to trim: never good
    return np.asarray(np.where(scaled, parts * factor[:, None], parts))


def expected_yield(result: Result, run: Run) -> str:
    """Return in a sentence how many parts of a design would be good, or why that is not known; empty of no part."""
    spec = result.spec
    assumed = assume_errors(spec)
    if assumed is None or not spec.part_requirements or not result.curves:
        return ""
    name = assumed.process.name
    again = f"the same command with --set design.process={name}"
    try:
        shares = expected_shares(result, Parts.from_assumed_errors(spec, run.seed), run)
    except Unknown as why:
        return f"not estimated ({name}, assumed tolerances): {why}; {again} draws parts"
    if not family(spec.family).free(spec, spec):
        return f"{_yield_sentence(assumed, shares)}; margins need 'design.free' to name values that may change"
    return f"{_yield_sentence(assumed, shares)}; with margins: {again} --set design.yield=90%"


def _yield_sentence(assumed: Assumed, shares: ExpectedShares) -> str:
    process = assumed.process
    used = {kind: getattr(process, kind) for kind in ("thickness", "position") if kind in assumed.kinds.values()}
    reported = [f"{kind} +- {format_short(sigma, 'length')}" for kind, sigma in used.items()]
    if assumed.modulus is not None:
        low, high = (format_short(end, "stress") for end in assumed.modulus)
        reported.append(f"modulus {low} to {high}")
    if assumed.rates:
        reported.append(f"rates of springs within {100.0 * SPRING_RATE:g} %")
    if assumed.as_stated:
        reported.append("moduli of beams' own materials as stated")
    reason = f": {process.reason}" if "thickness" in used else ""
    text = f"{_format_share(shares.good)} ({process.name}, assumed tolerances)"
    if assumed.modulus is not None:
        text += f", {_format_share(shares.measured)} once the modulus is measured"
    return f"{text}: {', '.join(reported)}{reason}; linear estimate"


def _format_share(share: Share) -> str:
    """Return a share of drawn parts to two digits, and never as all of them or none."""
    if 100.0 * share.value >= 99.5:
        return "over 99 %"
    return f"{100.0 * share.value:.2g} %" if share.good else "hardly any"


NAMED_PARTS_SHARE = 0.95  # share of parts whose forces are named
MAX_NAMED_DIMENSIONS = 3  # how many dimensions are named: more are not measured
SIZE_DIMENSIONS = ("length", "angle")  # what a dimension is measured in


def expected_forces(result: Result, run: Run) -> str:
    """Return the sentence; empty of a part of whose errors nothing is known, or that cannot be followed."""
    if not result.curves:
        return ""
    try:
        parts, whence = Parts.from_expected_errors(result.spec, run.seed)
        if parts is None:
            return ""
        places = _places_to_test(result)
        parts_near = efforts_of_parts(parts, places, result.curve.branches[0], run)
    except (CfmError, Unknown):
        return ""
    errors = parts.draw(N_DRAWN) - parts.nominal
    low, high = np.quantile(
        parts_near.numbers(errors), ((1.0 - NAMED_PARTS_SHARE) / 2.0, (1.0 + NAMED_PARTS_SHARE) / 2.0), axis=0
    )
    weight = (np.abs(parts_near.by_error) * errors.std(axis=0)).sum(axis=0)
    curve = result.curve
    at = [format_short(place, curve.motion_dimension) for place in places]
    ends = [
        [format_short(force, curve.kind, 3) for force in ends_of_place]
        for ends_of_place in zip(parts_near.middle, low, high, strict=True)
    ]
    expected = [
        f"{force} at {place} ({least.partition(' ')[0]} to {most})"
        for place, (force, least, most) in zip(at, ends, strict=True)
    ]
    make = "make the part in geometry/" if family(result.spec.family).outline else "make the part"
    verb = "displace to" if curve.motion_dimension == "length" else "turn to"
    return (
        f"{make}, {_list_what_to_measure(parts, weight)}, {verb} {_list_names(at)}, and expect "
        f"{_list_names(expected)}: each range holds for "
        f"{100 * NAMED_PARTS_SHARE:.0f} % of parts {whence} (linear estimate)"
    )


def _list_what_to_measure(parts: Parts, weight: FloatArray) -> str:
    """Return what to measure, of parameters that move the force by `weight` (d,): the first few dimensions.

    Then what else is among as many of all parameters.
    """
    order = [int(k) for k in np.argsort(-weight) if weight[k] > 0]
    sizes = [k for k in order if parts.parameters[k].dimension in SIZE_DIMENSIONS][:MAX_NAMED_DIMENSIONS]
    others = [k for k in order[:MAX_NAMED_DIMENSIONS] if parts.parameters[k].dimension not in SIZE_DIMENSIONS]
    reported = [f"measure {_list_names([_dimension(parts, k) for k in sizes])}"] if sizes else []
    if others:
        reported.append(f"determine {_list_names([_name_parameter(parts, k) + ' in the design)' for k in others])}")
    return ", ".join(reported)


def _dimension(parts: Parts, k: int) -> str:
    """Return a dimension with its drawn value, as ``bistable.thickness (1.01 mm as drawn)``."""
    parent, _, last = parts.paths[k].rpartition(".")
    thickness = getattr(parts.spec.get_value(parent), "thickness", None)
    if last != "offset" or thickness is None:
        return f"{_name_parameter(parts, k)} as drawn)"
    # an error of all thicknesses is nothing that is drawn
    ends = (min(thickness), max(thickness)) if isinstance(thickness, tuple) else (thickness,)
    reported = " to ".join(format_short(end, "length") for end in ends)
    return f"{parent.removeprefix('mechanism.')}.thickness ({reported} as drawn)"


def _name_parameter(parts: Parts, k: int) -> str:
    """Return the name and the value of a parameter, the bracket still open."""
    value = format_short(float(parts.nominal[k]), parts.parameters[k].dimension)
    return f"{parts.paths[k].removeprefix('mechanism.')} ({value}"


def _list_names(items: list[str]) -> str:
    return ", ".join(items[:-1]) + (" and " if len(items) > 1 else "") + items[-1]


def _places_to_test(result: Result) -> FloatArray:
    """Return the two ends of the window, or the middle and the end of the travel."""
    window, motion = window_of(result), result.curve.motion
    least, most = float(motion.min()), float(motion.max())
    return np.array([window.lo, window.hi] if window else [0.5 * (most + least), most if most > 0.0 else least])
