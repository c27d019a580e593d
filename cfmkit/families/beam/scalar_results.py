"""Scalar results of a beam mechanism, beside the constant-force metrics of every family."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.families.beam.constant_force_range_and_extremes import window_of
from cfmkit.families.beam.largest_in_window import largest
from cfmkit.families.beam.network_from_spec import thickest_of
from cfmkit.families.end_stops import CONTACT_QUANTITIES
from cfmkit.families.fem_results import FEM_DEFINITIONS as OF_SOLIDS
from cfmkit.families.rows import ScalarQuantity, or_nan
from cfmkit.numerics.interpolation import value_at

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica import Path
    from cfmkit.elastica.model.beam import Fit
    from cfmkit.families.beam.constant_force_range_and_extremes import AlongMotion, SolvedMechanism
    from cfmkit.families.beam.solution import Solution


def find_in_window(solution: SolvedMechanism, low: float, high: float) -> Any:
    """Return which accurate points of the curve are in a window."""
    x = solution.motion
    slack = 1e-12 * float(np.abs(x).max())
    return (x >= low - slack) & (x <= high + slack) & solution.accurate


def force_at_end(solution: SolvedMechanism) -> float | None:
    """Return the force at the end of the window [N]; None on a curve that turns back or ends before it."""
    if not len(solution.motion) or not (along := solution.along).reaches_end:
        return None
    return along.to_spec_sign(value_at(along.motion, along.effort, along.end))


def target_of(solution: SolvedMechanism) -> float | None:
    """Return the force that `design.rescale` asks for [N], of the sign that the force at the end of the window has."""
    design = solution.spec.design
    if design is None or design.rescale is None or design.rescale.force is None:
        return None
    return math.copysign(design.rescale.force, force_at_end(solution) or 1.0)


# --- parts before any load ------------------------------------------------------------------------------------------


def _gap(solution: Solution, which: int) -> float:
    gap = solution.gaps[which]
    return math.nan if gap is None else gap.size


def _largest_misfit(solution: Solution, misfit: Callable[[Fit], float]) -> float:
    """Return the largest of some misfit between a beam with a length of its own and its nodes."""
    with_length = [name for name, beam in solution.path.network.beams.items() if getattr(beam.shape, "length", None)]
    return max((misfit(solution.path.fits[name]) for name in with_length), default=0.0)


def _least_slenderness(solution: Solution) -> float:
    fits, beams = solution.path.fits, solution.path.network.beams
    return min(float(np.real(fits[name].length)) / thickest_of(beam.section) for name, beam in beams.items())


def _significant(values: FloatArray, error: float) -> float:
    """Return the first value, zero where it is within the error of the path."""
    first = float(values[0])
    return 0.0 if abs(first) <= 10 * error * float(np.nanmax(np.abs(values))) else first


# --- along the motion -----------------------------------------------------------------------------------------------


def _reading_along(read: Callable[[AlongMotion], float], place: bool = True) -> Callable[[SolvedMechanism], float]:
    """Return what reads a place or a force of the range that ends at d; drives by a displacement alone have it."""

    def function(solution: SolvedMechanism) -> float:
        if not solution.spec.mechanism.drive.is_displacement:
            return math.nan
        value = read(solution.along)
        return solution.along.to_spec_sign(value) if place else value

    return function


def _extreme(read: Callable[[AlongMotion], float]) -> Callable[[SolvedMechanism], float]:
    """Return what reads an extreme; none of drives that turn."""
    return lambda solution: math.nan if _turns(solution) else solution.along.to_spec_sign(read(solution.along))


def _turns(solution: SolvedMechanism) -> bool:
    return solution.spec.mechanism.drive.turns


def _event(kind: str, dimension: str) -> Callable[[Solution], float]:
    """Return what reads where the drive, a length or a force, has its first event of a kind."""

    def function(solution: Solution) -> float:
        if _turns(solution) or solution.spec.mechanism.drive.is_displacement != (dimension == "length"):
            return math.nan
        unit = solution.assembly.effort_unit if dimension == "force" else 1
        return next((unit * event.drive for event in solution.path.events if event.kind == kind), math.nan)

    return function


# --- across the motion ----------------------------------------------------------------------------------------------


def _largest_stress(solution: Solution) -> float:
    return or_nan(largest(solution, lambda path: path.beam_stresses()[0], window_of(solution)))


def _largest_size(solution: Solution, read: Callable[[FloatArray, Any], FloatArray]) -> float:
    """Return the largest size in the window of what is read from the driven node's motion (n, 3) and the drive."""
    drive = solution.spec.mechanism.drive

    def observe(path: Path) -> FloatArray:
        values = read(path.motion(solution.assembly.driven), drive)
        return np.array([values, -values])

    return math.nan if drive.turns else or_nan(largest(solution, observe, window_of(solution)))


def _move_across(motion: FloatArray, drive: Any) -> FloatArray:
    return np.asarray(np.cos(drive.direction) * motion[:, 1] - np.sin(drive.direction) * motion[:, 0])


def _smallest_cross_stiffness(solution: Solution) -> float:
    """Return the smallest stiffness across the drive in the window [N/m]; NaN at a pole, or if the drive turns."""
    drive: Any = solution.spec.mechanism.drive
    if drive.turns:
        return math.nan
    window = window_of(solution)

    def observe(path: Path) -> FloatArray:
        return -solution.replace_path(path).cross_stiffness[None]

    if _passes_pole(solution, drive.direction, window) or _has_pole(solution, observe, window):
        return math.nan
    return -or_nan(largest(solution, observe, window))


def _passes_pole(solution: Solution, direction: float, window: tuple[float, float]) -> bool:
    """Return True if the stiffness across the drive has a pole between two points of a path in a window.

    Such is that of a node without a guide, on a part of the path where even a guide would not make it stable.
    """
    from cfmkit.elastica.results.cross_stiffness import poles

    path, node = solution.path, solution.assembly.driven
    x, y, _ = path.motion(node).T
    along = np.cos(direction) * x + np.sin(direction) * y
    inside = (along >= window[0]) & (along <= window[1])
    at_poles = poles(path, node, solution.assembly.direction)
    return bool((at_poles & inside[1:] & inside[:-1]).any())


BIFURCATION_OFFSETS = np.array([-1e-5, -1e-6, 1e-6, 1e-5])
"""Shares of the travel by which places are beside a bifurcation where a value is looked at."""


def _has_pole(solution: Solution, observe: Callable[[Path], FloatArray], window: tuple[float, float]) -> bool:
    """Return True if a value has a pole at a bifurcation in a window: nearer by ten times it is ten times as large.

    Such is the stiffness across the drive of a node that is guided, where the part buckles under its guide.
    """
    law = solution.model_between_points
    if law is None or not solution.spec.mechanism.drive.is_displacement:
        return False
    offsets = BIFURCATION_OFFSETS * float(np.ptp(solution.motion))
    for place in (event.drive for event in solution.path.events if event.kind == "bifurcation"):
        if window[0] <= place <= window[1]:
            far_before, before, after, far_after = np.abs(observe(law.solve_at(place + offsets))[0])
            if before > 5.0 * far_before or after > 5.0 * far_after:
                return True
    return False


# --- natural frequencies --------------------------------------------------------------------------------------------


def natural_frequencies(solution: Solution) -> dict[str, FloatArray]:
    """Return the natural frequencies at every point with the drive "held" and "free", (n, modes) [Hz]; else nan."""
    frequencies = solution.frequencies
    if frequencies is None:
        return {}
    by_motion = solution.spec.mechanism.drive.by_motion
    held = frequencies.held if not by_motion else np.where(solution.stable[:, None], frequencies.held, np.nan)
    free = np.where(solution.stable[:, None], frequencies.free, np.nan)
    return {"held": np.where(solution.accurate[:, None], held, np.nan), "free": free}


def _lowest_frequency(hold: str) -> Callable[[Solution], float]:
    """Return what reads the lowest natural frequency in the window; none where there is a pose without."""

    def function(solution: Solution) -> float:
        frequencies = natural_frequencies(solution) if solution.spec.analysis.modes else {}
        if hold not in frequencies:
            return math.nan
        first = frequencies[hold][find_in_window(solution, *window_of(solution)), 0]
        return float(first.min()) if len(first) and np.isfinite(first).all() else math.nan

    return function


# --- table ----------------------------------------------------------------------------------------------------------


def _quantity(
    dimension: str, definition: str, function: Callable[[Any], float | None], reason: str = ""
) -> ScalarQuantity[Solution]:
    """Return an entry of the table; by its function None is no value, too."""
    return ScalarQuantity(dimension, definition, lambda solution: or_nan(function(solution)), reason)


def _make_solid_quantities(names: Iterable[str]) -> dict[str, ScalarQuantity[Solution]]:
    reason = "only the model of the part as a solid has it"
    return {name: _quantity(*OF_SOLIDS[name], lambda _: None, reason) for name in names}


SCALAR_QUANTITIES: Mapping[str, ScalarQuantity[Solution]] = {
    "nominal_force": _quantity(
        "force",
        "F_d: force at d, the end of the window or of the travel [Lan, sec. 2]",
        _reading_along(lambda a: a.force_at_end),
    ),
    "range_start": _quantity(
        "length", "c: where the force first reaches 0.95 F_d [Lan, sec. 2]", _reading_along(lambda a: a.start)
    ),
    "range_fraction": _quantity(
        "ratio",
        "(d - c)/d, the operational range as a share of the travel [Lan, sec. 2]",
        _reading_along(lambda a: a.fraction(a.start), place=False),
    ),
    "strict_range_start": _quantity(
        "length",
        "smallest c with (max - min) <= 5 % of max of the force on c ... d",
        _reading_along(lambda a: a.strict_start),
    ),
    "strict_range_fraction": _quantity(
        "ratio",
        "(d - c)/d with c of `strict_range_start`",
        _reading_along(lambda a: a.fraction(a.strict_start), place=False),
    ),
    "stress_at_end": _quantity(
        "stress",
        "largest stress at d, the end of the window or of the travel",
        _reading_along(lambda a: a.stress_at_end, place=False),
    ),
    "stress_limit_displacement": _quantity(
        "length",
        "travel at which the stress first reaches the allowable stress",
        _reading_along(lambda a: a.stress_limit),
    ),
    "allowable_stress": _quantity(
        "stress",
        "yield strength over `mechanism.safety_factor`; of several materials, the smallest",
        lambda solution: solution.assembly.allowable_stress,
    ),
    "stress_total_max": _quantity("stress", "largest stress in the window with the axial part", _largest_stress),
    "prestress_force": _quantity(
        "force",
        "force at rest: not zero where beams are forced into place",
        lambda solution: _significant(solution.effort, solution.path.error),
    ),
    "prestress_stress": _quantity(
        "stress", "largest stress at rest", lambda solution: _significant(solution.stress, solution.path.error)
    ),
    "closure_rotation_max": _quantity(
        "angle",
        "largest angle by which a beam was turned to fit between its nodes",
        lambda solution: _largest_misfit(solution, lambda fit: abs(float(np.real(fit.rotation)))),
    ),
    "closure_scale_max": _quantity(
        "ratio",
        "largest relative change of a beam's length to fit between its nodes",
        lambda solution: _largest_misfit(solution, lambda fit: abs(float(np.real(fit.scale)) - 1)),
    ),
    "closure_gap_max": _quantity(
        "length",
        "largest gap between the end of a beam as stated and its node",
        lambda solution: _largest_misfit(solution, lambda fit: fit.gap),
    ),
    "slenderness_min": _quantity(
        "count", "smallest ratio of a beam's length to its largest thickness", _least_slenderness
    ),
    "peak_force": _quantity("force", "first local maximum of the force", _extreme(lambda a: a.peak[1])),
    "peak_displacement": _quantity(
        "length", "where the force has its first local maximum", _extreme(lambda a: a.peak[0])
    ),
    "valley_force": _quantity(
        "force", "first local minimum of the force after its first local maximum", _extreme(lambda a: a.valley[1])
    ),
    "valley_displacement": _quantity(
        "length",
        "where the force has this first minimum after its first local maximum",
        _extreme(lambda a: a.valley[0]),
    ),
    "limit_force": _quantity(
        "force", "first limit point of a growing force: it snaps there", _event("limit point", "force")
    ),
    "limit_displacement": _quantity(
        "length", "first limit point of a growing displacement: it snaps there", _event("limit point", "length")
    ),
    "bifurcation_force": _quantity("force", "first bifurcation under a growing force", _event("bifurcation", "force")),
    "critical_force": _quantity(
        "force", "force of the part as a solid at the first bifurcation on its travel", lambda _: None
    ),
    "critical_error": _quantity(
        "ratio",
        "error of `critical_force` and, of the part as a solid, of `bifurcation_displacement`, relative to each: by "
        "how much they differ on a coarser mesh, at least 1e-4",
        lambda _: None,
    ),
    "bifurcation_displacement": _quantity(
        "length", "first bifurcation under a growing displacement", _event("bifurcation", "length")
    ),
    "error_estimate": _quantity(
        "ratio",
        "estimated error of forces and positions, relative to the largest of the path",
        lambda solution: solution.path.error,
    ),
    "gap_min": _quantity(
        "length",
        "smallest gap between two beams before any load, away from common nodes",
        lambda solution: _gap(solution, 0),
    ),
    "gap_min_moving": _quantity(
        "length", "smallest gap between two beams at sampled places of the travel", lambda solution: _gap(solution, 1)
    ),
    "travel_end": _quantity(
        "length",
        "displacement of the driven node at the end of the path",
        lambda solution: None if _turns(solution) else float(solution.motion[-1]),
    ),
    "parasitic_motion": _quantity(
        "length",
        "largest motion of the driven node across the drive, in the window",
        lambda solution: _largest_size(solution, _move_across),
    ),
    "parasitic_rotation": _quantity(
        "angle",
        "largest rotation of the driven node, in the window",
        lambda solution: _largest_size(solution, lambda motion, _: motion[:, 2]),
    ),
    "cross_stiffness": _quantity(
        "stiffness",
        "smallest stiffness of the driven node across the drive, in the window, of all copies: force over displacement "
        "with the drive held and the rotation as supported, without the guide that holds the node across; no value at "
        "a bifurcation, where it is unbounded",
        _smallest_cross_stiffness,
    ),
    "frequency_held_min": _quantity(
        "frequency", "lowest natural frequency in the window while the drive is held", _lowest_frequency("held")
    ),
    "frequency_free_min": _quantity(
        "frequency", "lowest natural frequency in the window while the drive is free to move", _lowest_frequency("free")
    ),
    "peak_stress_x": _quantity(
        "length", "x of the place of the largest stress in the window, on the part before any load", lambda _: None
    ),
    "peak_stress_y": _quantity(
        "length", "y of the place of the largest stress in the window, on the part before any load", lambda _: None
    ),
    **_make_solid_quantities(OF_SOLIDS),
    "strain_energy_max": _quantity(
        "energy",
        "largest strain energy on the path, of all copies",
        lambda solution: float(solution.path.energy.max()) * solution.assembly.parallel,
    ),
}
"""Every scalar result of the family, in the order in which they are shown."""
SCALAR_DEFINITIONS = {name: quantity.about for name, quantity in SCALAR_QUANTITIES.items()} | CONTACT_QUANTITIES
"""Name -> dimension and definition."""
EXTREME_METRICS = ("peak_displacement", "peak_force", "valley_displacement", "valley_force")
RANGE_METRICS = tuple(SCALAR_QUANTITIES)[: tuple(SCALAR_QUANTITIES).index("allowable_stress")]
"""Those that the curve of any model has."""


def number_of(name: str, solution: SolvedMechanism) -> float | None:
    """Return a scalar result that the curve has [SI]; None if there is none."""
    value = SCALAR_QUANTITIES[name].function(solution)  # type: ignore[arg-type]
    return float(value) if np.isfinite(value) else None
