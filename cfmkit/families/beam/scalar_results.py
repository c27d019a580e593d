"""Scalar results of a beam mechanism, beside the constant-force metrics of every family."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.families.beam.contacts import DEFINITIONS as OF_CONTACTS
from cfmkit.families.beam.contacts import contact_values
from cfmkit.families.beam.curve_along_its_motion import AlongMotion, window_of
from cfmkit.families.beam.largest_in_window import largest
from cfmkit.families.beam.network_from_spec import thickest_of
from cfmkit.families.fem_results import DEFINITIONS as OF_SOLIDS
from cfmkit.families.fem_results import unknown_to_beams
from cfmkit.numerics.cubic_interpolation import bisect, crossing, first_extreme, value_at
from cfmkit.results import Quantity, quantities

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica import Path
    from cfmkit.families.beam.solution import OnCurve, Solution
    from cfmkit.families.run_control import Run


BAND = 0.05
"""Share of F_d by which the force may differ from it: the range begins at 0.95 F_d [Lan, sec. 2]."""


DEFINITIONS = {
    "nominal_force": ("force", "F_d: force at d, the end of the window or of the travel [Lan, sec. 2]"),
    "range_start": ("length", "c: where the force first reaches 0.95 F_d [Lan, sec. 2]"),
    "range_fraction": ("ratio", "(d - c)/d, the operational range as a share of the travel [Lan, sec. 2]"),
    "strict_range_start": ("length", "smallest c with (max - min) <= 5 % of max of the force on c ... d"),
    "strict_range_fraction": ("ratio", "(d - c)/d with c of `strict_range_start`"),
    "stress_at_end": ("stress", "largest stress at d, the end of the window or of the travel"),
    "stress_limit_displacement": ("length", "travel at which the stress first reaches the allowable stress"),
    "allowable_stress": ("stress", "yield strength over `mechanism.safety_factor`; of several materials, the smallest"),
    "stress_total_max": ("stress", "largest stress in the window with the axial part"),
    "prestress_force": ("force", "force at rest: not zero where beams are forced into place"),
    "prestress_stress": ("stress", "largest stress at rest"),
    "closure_rotation_max": ("angle", "largest angle by which a beam was turned to fit between its nodes"),
    "closure_scale_max": ("ratio", "largest relative change of a beam's length to fit between its nodes"),
    "closure_gap_max": ("length", "largest gap between the end of a beam as stated and its node"),
    "slenderness_min": ("count", "smallest ratio of a beam's length to its largest thickness"),
    "peak_force": ("force", "first local maximum of the force"),
    "peak_displacement": ("length", "where the force has its first local maximum"),
    "valley_force": ("force", "first local minimum of the force after its first local maximum"),
    "valley_displacement": ("length", "where the force has this first minimum after its first local maximum"),
    "limit_force": ("force", "first limit point of a growing force: it snaps there"),
    "limit_displacement": ("length", "first limit point of a growing displacement: it snaps there"),
    "bifurcation_force": ("force", "first bifurcation under a growing force"),
    "critical_force": ("force", "force of the part as a solid at the first bifurcation on its travel"),
    "critical_error": (
        "ratio",
        "error of `critical_force` and, of the part as a solid, of `bifurcation_displacement`, relative to each: by "
        "how much they differ on a coarser mesh, at least 1e-4",
    ),
    "bifurcation_displacement": ("length", "first bifurcation under a growing displacement"),
    "error_estimate": ("ratio", "estimated error of forces and positions, relative to the largest of the path"),
    "gap_min": ("length", "smallest gap between two beams before any load, away from common nodes"),
    "gap_min_moving": ("length", "smallest gap between two beams at sampled places of the travel"),
    "travel_end": ("length", "displacement of the driven node at the end of the path"),
    "parasitic_motion": ("length", "largest motion of the driven node across the drive, in the window"),
    "parasitic_rotation": ("angle", "largest rotation of the driven node, in the window"),
    "cross_stiffness": (
        "stiffness",
        "smallest stiffness of the driven node across the drive, in the window, of all copies: force over displacement "
        "with the drive held and the rotation as supported, without the guide that holds the node across; no value at "
        "a bifurcation, where it is unbounded",
    ),
    "frequency_held_min": ("frequency", "lowest natural frequency in the window while the drive is held"),
    "frequency_free_min": ("frequency", "lowest natural frequency in the window while the drive is free to move"),
    "peak_stress_x": ("length", "x of the place of the largest stress in the window, on the part before any load"),
    "peak_stress_y": ("length", "y of the place of the largest stress in the window, on the part before any load"),
    **OF_SOLIDS,
    **OF_CONTACTS,
    "strain_energy_max": ("energy", "largest strain energy on the path, of all copies"),
}


def values_of(solution: Solution, run: Run) -> Mapping[str, Quantity]:
    """Return the scalar results by name; None if a value does not exist, or takes long and is not looked at."""
    numbers: dict[str, float | None] = dict.fromkeys(name for name in DEFINITIONS if name not in OF_CONTACTS) | {
        "allowable_stress": solution.assembly.allowable_stress,
        "error_estimate": solution.path.error,
        "strain_energy_max": float(solution.path.energy.max()) * solution.assembly.parallel,
        "gap_min": None if solution.gaps[0] is None else solution.gaps[0].size,
        "gap_min_moving": None if solution.gaps[1] is None else solution.gaps[1].size,
        **_closure(solution),
        "prestress_force": _significant(solution.effort, solution.path.error),
        "prestress_stress": _significant(solution.stress, solution.path.error),
        **(_across(solution) if run.wants(ACROSS) else {}),
        **_swings(solution),
    }
    if not solution.spec.mechanism.drive.turns:
        numbers["travel_end"] = float(solution.motion[-1])
        numbers |= extremes(solution) | _events(solution)
    if solution.spec.mechanism.drive.is_displacement:
        numbers |= ranges(solution)
    return quantities(DEFINITIONS, numbers) | unknown_to_beams() | contact_values(solution, run)


def within(solution: OnCurve, low: float, high: float) -> Any:
    """Tell which accurate points of the curve are in a window."""
    x = solution.motion
    slack = 1e-12 * float(np.abs(x).max())
    return (x >= low - slack) & (x <= high + slack) & solution.accurate


def force_at_end(solution: OnCurve) -> float | None:
    """Return the force at the end of the window [N]; None on a curve that turns back or ends before it."""
    if not len(solution.motion) or not (along := AlongMotion(solution)).reaches_end:
        return None
    return along.back(value_at(along.motion, along.effort, along.end))


def target_of(solution: OnCurve) -> float | None:
    """Return the force that `design.rescale` asks for [N], of the sign that the force at the end of the window has."""
    design = solution.spec.design
    if design is None or design.rescale is None or design.rescale.force is None:
        return None
    return math.copysign(design.rescale.force, force_at_end(solution) or 1.0)


def ranges(solution: OnCurve) -> dict[str, float | None]:
    """Return what Lan says about the range that ends at d; nothing on a curve that turns back or has no point."""
    numbers: dict[str, float | None] = dict.fromkeys(
        ("nominal_force", "range_start", "range_fraction", "strict_range_start", "strict_range_fraction"),
    )
    numbers |= dict.fromkeys(("stress_at_end", "stress_limit_displacement"))
    if not len(solution.motion):
        return numbers
    along = AlongMotion(solution)
    if not along.reaches_end or not np.isfinite(along.effort).all():
        return numbers
    end, (x, force) = along.end, along.knots
    nominal = value_at(x, force, end)
    numbers |= {"nominal_force": along.back(nominal), "stress_at_end": _stress_at(along, end)}
    if solution.assembly.allowable_stress is not None:
        numbers["stress_limit_displacement"] = along.back(_stress_reaches(along, solution.assembly.allowable_stress))
    known = abs(nominal) > (solution.effort_error or 0.0)  # else 95 % of it are rounding
    start = _settled(lambda x, force: crossing(x, force / nominal, 1 - BAND), along) if known else None
    if start is not None and start <= end and end > 0:
        numbers |= {"range_start": along.back(start), "range_fraction": (end - start) / end}
        if nominal > 0:  # else no band lies around the force there
            strict = _settled(lambda x, force: strict_start(x, force, end), along) or 0.0
            numbers |= {"strict_range_start": along.back(strict), "strict_range_fraction": (end - strict) / end}
    return numbers


def _stress_at(along: AlongMotion, place: float) -> float:
    """Return the largest stress at a place [Pa], beam by beam: the largest of all has kinks."""
    if along.solution.everywhere is not None:
        return float(along.stress_at(np.array([place]))[0])
    return max(value_at(along.motion, value, place) for value, _ in along.solution.stresses.values())


def _stress_reaches(along: AlongMotion, allowable: float) -> float | None:
    """Return where the largest stress first reaches the allowable one, beam by beam."""
    if along.solution.everywhere is None:
        found = [crossing(along.motion, value, allowable) for value, _ in along.solution.stresses.values()]
        return min((place for place in found if place is not None), default=None)
    return along.stress_reaches(allowable)


_ROUNDS = 4
"""Lan's mechanism (`configs/beam_lan2010.yaml`) needs three."""

_SETTLED = 1e-11  # of the travel: a place that moves by less is known


def _settled(find: Callable[[FloatArray, FloatArray], float | None], along: AlongMotion) -> float | None:
    """Return a place that cubics tell, put right by the equilibrium that is solved there, if the model can do so."""
    x, force = along.knots
    place = find(x, force)
    for _ in range(_ROUNDS):
        if along.corners is None or place is None or np.abs(x - place).min() <= _SETTLED * (x[-1] - x[0]):
            break
        at = int(np.searchsorted(x, place))
        x, force = np.insert(x, at, place), np.insert(force, at, along.effort_at(np.array([place])))
        place = find(x, force)
    return place


def strict_start(x: FloatArray, force: FloatArray, end: float, band: float = BAND) -> float:
    """Return the smallest c with (max - min) <= band max of the force on c ... end."""
    before = x < end
    values = np.append(force[before], value_at(x, force, end))
    places = np.append(x[before], end)
    tops = np.maximum.accumulate(values[::-1])[::-1]
    bottoms = np.minimum.accumulate(values[::-1])[::-1]
    bad = np.flatnonzero(tops - bottoms > band * tops)
    if not len(bad):
        return float(places[0])
    last = int(bad[-1])
    top, bottom = float(tops[last + 1]), float(bottoms[last + 1])

    def inside(place: float) -> bool:
        here = value_at(x, force, place)
        return max(top, here) - min(bottom, here) <= band * max(top, here)

    return bisect(inside, float(places[last]), float(places[last + 1]))


def _closure(solution: Solution) -> dict[str, float | None]:
    fits = solution.path.fits
    own = [name for name, beam in solution.path.network.beams.items() if getattr(beam.shape, "length", None)]
    beams = solution.path.network.beams
    return {
        "closure_rotation_max": max((abs(float(np.real(fits[name].rotation))) for name in own), default=0.0),
        "closure_scale_max": max((abs(float(np.real(fits[name].scale)) - 1) for name in own), default=0.0),
        "closure_gap_max": max((fits[name].gap for name in own), default=0.0),
        "slenderness_min": min(
            float(np.real(fits[name].length)) / thickest_of(beam.section) for name, beam in beams.items()
        ),
    }


ACROSS = ("stress_total_max", "parasitic_motion", "parasitic_rotation", "cross_stiffness")
"""What is solved for by itself: it takes a third as long as all else about a path."""


def _across(solution: Solution) -> dict[str, float | None]:
    """Return the stress with all its parts, and how far the driven node goes where it is not to.

    Of drives that turn it, only the stress.
    """
    drive: Any = solution.spec.mechanism.drive
    window, node = window_of(solution), solution.assembly.driven

    def stresses(path: Path) -> FloatArray:
        return path.beam_stresses()[0]

    total = {"stress_total_max": largest(solution, stresses, window)}
    if drive.turns:
        return total

    def across(path: Path) -> FloatArray:
        x, y, _ = path.motion(node).T
        away = np.cos(drive.direction) * y - np.sin(drive.direction) * x
        return np.array([away, -away])

    def turned(path: Path) -> FloatArray:
        turn = path.motion(node)[:, 2]
        return np.array([turn, -turn])

    def gives(path: Path) -> FloatArray:
        return -replace(solution, path=path, keep=np.arange(len(path)), ends=()).cross_stiffness[None]

    unbounded = _passes_pole(solution, drive.direction, window) or _has_pole(solution, gives, window)
    least = None if unbounded else largest(solution, gives, window)
    return total | {
        "parasitic_motion": largest(solution, across, window),
        "parasitic_rotation": largest(solution, turned, window),
        "cross_stiffness": None if least is None else -least,
    }


def _passes_pole(solution: Solution, direction: float, window: tuple[float, float]) -> bool:
    """Return True if the stiffness across the drive has a pole between two points of a path in a window.

    Such is that of a node without a guide, on a part of the path where even a guide would not make it stable.
    """
    from cfmkit.elastica.results.cross_stiffness import poles

    path, node = solution.path, solution.assembly.driven
    x, y, _ = path.motion(node).T
    along = np.cos(direction) * x + np.sin(direction) * y
    inside = (along >= window[0]) & (along <= window[1])
    found = poles(path, node, solution.assembly.direction)
    return bool((found & inside[1:] & inside[:-1]).any())


BESIDE = np.array([-1e-5, -1e-6, 1e-6, 1e-5])
"""Shares of the travel by which places are beside a bifurcation where a value is looked at."""


def _has_pole(solution: Solution, observe: Callable[[Path], FloatArray], window: tuple[float, float]) -> bool:
    """Return True if a value has a pole at a bifurcation in a window: nearer by ten times it is ten times as large.

    Such is the stiffness across the drive of a node that is guided, where the part buckles under its guide.
    """
    law = solution.everywhere
    if law is None or not solution.spec.mechanism.drive.is_displacement:
        return False
    for place in (event.drive for event in solution.path.events if event.kind == "bifurcation"):
        if window[0] <= place <= window[1]:
            far, near, later, farther = np.abs(observe(law.at(place + BESIDE * float(np.ptp(solution.motion))))[0])
            if near > 5.0 * far or later > 5.0 * farther:
                return True
    return False


def natural(solution: Solution) -> dict[str, FloatArray]:
    """Return the natural frequencies at every point with the drive "held" and "free", (n, modes) [Hz]; else nan."""
    found = solution.frequencies
    if found is None:
        return {}
    by_motion = solution.spec.mechanism.drive.by_motion
    held = found.held if not by_motion else np.where(solution.stable[:, None], found.held, np.nan)
    free = np.where(solution.stable[:, None], found.free, np.nan)
    return {"held": np.where(solution.accurate[:, None], held, np.nan), "free": free}


def _swings(solution: Solution) -> dict[str, float | None]:
    """Return the lowest natural frequencies in the window; none where there is a pose without."""
    if not solution.spec.analysis.modes:
        return {}
    inside, numbers = within(solution, *window_of(solution)), {}
    for name, values in natural(solution).items():
        first = values[inside, 0]
        numbers[f"frequency_{name}_min"] = float(first.min()) if len(first) and np.isfinite(first).all() else None
    return numbers


def _significant(values: FloatArray, error: float) -> float:
    """Return the first value, zero where it is within the error of the path."""
    first = float(values[0])
    return 0.0 if abs(first) <= 10 * error * float(np.nanmax(np.abs(values))) else first


def extremes(solution: OnCurve) -> dict[str, float | None]:
    """Return the first local maximum of the force and the minimum after it, on a curve that does not turn back."""
    names = ("peak_displacement", "peak_force", "valley_displacement", "valley_force")
    numbers: dict[str, float | None] = dict.fromkeys(names)
    if not len(solution.motion):
        return numbers
    along = AlongMotion(solution)
    if not (np.diff(along.motion) > 0).all() or not np.isfinite(along.effort).all():
        return numbers
    x, force = along.knots
    # before a contact begins there may be no force at all, but for rounding
    bearing = np.flatnonzero(np.abs(force) > (solution.effort_error or 0.0))
    begin = float(x[bearing[0] - 1]) if len(bearing) and bearing[0] > 1 else -np.inf
    peak = _turn(along, first_extreme(x, force, after=begin, corners=along.corners))
    if peak is None:
        return numbers
    valley = _turn(along, first_extreme(x, force, -1, after=peak[0], corners=along.corners))
    return dict(zip(names, map(along.back, (*peak, *(valley or (None, None)))), strict=True))


_BESIDE = 0.1 * np.arange(-2.0, 3.0)
"""Where equilibria are solved for around an extreme, as shares of the way to the next point: wide enough that what the
solver leaves does not move the place, close enough that a polynomial of degree four does not either."""


def _turn(along: AlongMotion, found: tuple[float, float] | None) -> tuple[float, float] | None:
    """Return place and value of an extreme from equilibria around it, where the model can be asked; else as found."""
    if along.corners is None or found is None or found[0] in along.corners:
        return found
    place, value = found
    clear = np.concatenate([along.motion[[0, -1]], along.corners])
    step = min(float(np.abs(np.diff(along.motion)).max()), float(np.abs(clear - place).min()) / _BESIDE[-1])
    for _ in range(2):
        powers = np.polynomial.polynomial.polyfit(_BESIDE, along.effort_at(place + step * _BESIDE), 4)
        rates = np.polynomial.polynomial.polyder(powers)
        turns = np.roots(rates[::-1])
        real = turns.real[np.isreal(turns)]
        if not len(real) or np.abs(real).min() > _BESIDE[-1]:
            return found
        at = float(real[np.abs(real).argmin()])
        place, value = place + step * at, float(np.polynomial.polynomial.polyval(at, powers))
    return place, value


def _events(solution: Solution) -> dict[str, float | None]:
    """Return where the drive has its first limit point and its first bifurcation."""
    kind = "displacement" if solution.spec.mechanism.drive.is_displacement else "force"
    unit = solution.assembly.effort_unit if kind == "force" else 1
    found: dict[str, float | None] = {}
    for name, event in (("limit", "limit point"), ("bifurcation", "bifurcation")):
        drive = next((one.drive for one in solution.path.events if one.kind == event), None)
        found[f"{name}_{kind}"] = None if drive is None else unit * drive
    return found
