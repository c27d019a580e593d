"""Scalar results of snap-through leaves beside a preloaded spring; tables of its force by preload and by leaves."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.families.end_stops import STOP_QUANTITIES
from cfmkit.families.fem_results import FEM_DEFINITIONS as OF_SOLIDS
from cfmkit.families.findings import newton
from cfmkit.families.rows import ScalarQuantity, columns_of_absent_values, or_nan, quantity_of_each
from cfmkit.families.vcfm.leaf_laws_from_spec import share_of, strip_of
from cfmkit.families.vcfm.leaves.positive_stiffness_springs import measured_stiffness_for
from cfmkit.families.vcfm.solution import MEAN_PLACES
from cfmkit.stock.springs.stress_and_life import WIRE_DEFINITIONS, SpringInUse, wire_quantities
from cfmkit.tables import Table, TableColumn, border_column

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from cfmkit.arrays import FloatArray
    from cfmkit.families.vcfm.solution import Solution
    from cfmkit.results import Quantity


def _read_mesh_error(name: str) -> Callable[[Solution], float]:
    """Return what reads an error of the mesh: solids alone have one."""

    def read(solution: Solution) -> float:
        error = getattr(solution.sampler, "mesh_error", None)
        return or_nan(None if error is None else error.values().get(name))

    return read


def _is_solid(solution: Solution) -> bool:
    return hasattr(solution.sampler, "mesh_error")


def _linear_stroke(solution: Solution) -> FloatArray:
    low, high = solution.linear_range
    return np.where(np.isfinite(high - low), high - low, 0.0)


def _why_not_constant(solution: Solution) -> str:
    """Return why no single force stands for the curve."""
    alone, flat = float(solution.spring_alone[0]), float(solution.window_force[0])
    if np.isnan(alone):
        return "the leaves carry a force where they are flat, or the spring has no constant stiffness"
    flat_part = "" if np.isnan(flat) else f"; its flat part is at {newton(flat)}"
    return f"where the leaves carry nothing the force is {newton(alone)}, but the curve is not flat there{flat_part}"


def _rest_shift_max(solution: Solution) -> FloatArray:
    shift = np.abs(solution.split_by_mechanism(solution.curves.rest))
    return np.where(np.isnan(shift).all(axis=1), np.nan, np.where(np.isnan(shift), 0.0, shift).max(axis=1))


def _stiffness_mismatch(solution: Solution) -> FloatArray:
    character, alone = solution.character, solution.spring_alone
    difference = solution.spread_over_mechanisms(np.abs(character.positive_stiffness - character.negative_stiffness))
    is_known = np.abs(alone) > solution.effort_error
    return np.where(
        is_known, difference * (solution.window[1] - solution.window[0]) / np.where(is_known, alone, 1.0), np.nan
    )


def _travel_stress_max(solution: Solution) -> FloatArray:
    return np.asarray(np.maximum(solution.travel_leaf_stress, solution.travel_spring_stress.max(axis=1)))


def _travel_safety_factor(solution: Solution) -> FloatArray:
    stress = _travel_stress_max(solution)
    return np.where(stress > 0, solution.allowable_stress / np.where(stress > 0, stress, 1.0), np.nan)


def _spring_stress_max(solution: Solution) -> FloatArray:
    ends = np.repeat(solution.window[1], solution.preloads)
    stress = solution.split_by_mechanism(solution.curves.spring_stress(ends)).max(axis=1)
    return stress if solution.spec.mechanism.springs is None else np.full(len(solution), np.nan)


def _largest_change(solution: Solution) -> tuple[FloatArray, FloatArray]:
    """Return the largest change of the mean force due to a preload [N], and the change of that preload [m]."""
    means = solution.window_forces.mean(axis=2)
    changes, preload = means - means[:, :1], solution.split_by_mechanism(solution.curves.preload[:, 0])
    sizes = np.where(np.isnan(changes), -1.0, np.abs(changes))[:, 1:]
    if not sizes.shape[1]:
        return np.full(len(means), np.nan), np.full(len(means), np.nan)
    rows, largest = np.arange(len(means)), sizes.argmax(axis=1) + 1
    return changes[rows, largest], (preload - preload[:, :1])[rows, largest]


def _value_over_preloads(solution: Solution, read: Callable[[FloatArray], FloatArray]) -> FloatArray:
    """Return a value of the forces (m, p, places) of all preloads; NaN where one of them has no force in the window."""
    forces = solution.window_forces
    is_known = (np.isfinite(forces).all(axis=2) & (forces.max(axis=2) > 0)).all(axis=1)
    return np.where(is_known, read(forces), np.nan)


def _spring_deflection_max(solution: Solution) -> FloatArray:
    curves = solution.curves
    return np.asarray(np.maximum(solution.split_by_mechanism(curves.ends[1] + curves.preload[:, 0]).max(axis=1), 0.0))


def _is_bought(solution: Solution) -> bool:
    return solution.spec.mechanism.springs is not None


def _list_springs_in_use(solution: Solution, number: int) -> list[SpringInUse]:
    """Return what bought springs of a mechanism are put through between rest and the end of the travel."""
    springs = solution.specs[number].mechanism.springs
    if springs is None:
        return []
    rows, curves = slice(number * solution.preloads, (number + 1) * solution.preloads), solution.curves
    ends = [(end[rows] + curves.preload[rows, 0]).tolist() for end in curves.ends]
    return [springs.put_under(springs.load(first), springs.load(last)) for first, last in zip(*ends, strict=True)]


def _wires(solution: Solution) -> Iterator[Mapping[str, Quantity]]:
    """Yield the largest stress in the wire of bought springs, and their shortest life, of each mechanism."""
    return (wire_quantities(_list_springs_in_use(solution, number)) for number in range(len(solution)))


SCALAR_QUANTITIES: Mapping[str, ScalarQuantity[Solution]] = {
    **{
        name: ScalarQuantity(
            *about,
            _read_mesh_error(name),
            lambda solution: "there is none" if _is_solid(solution) else "only the model of the part as a solid has it",
        )
        for name, about in OF_SOLIDS.items()
    },
    "positive_stiffness": ScalarQuantity(
        "stiffness", "K_p of the unloaded spring", lambda solution: solution.character.positive_stiffness
    ),
    "negative_stiffness": ScalarQuantity(
        "stiffness",
        "size of the leaves' negative stiffness: constant where they are buckled",
        lambda solution: solution.character.negative_stiffness,
    ),
    "first_stiffness": ScalarQuantity(
        "stiffness", "stiffness K_b1 of the unloaded leaves", lambda solution: solution.character.first_stiffness
    ),
    "rise": ScalarQuantity(
        "length", "h of the leaves: travel to the flat pose", lambda solution: solution.parts.strip.rise
    ),
    "slenderness": ScalarQuantity(
        "factor",
        "rise over thickness of the leaves, Q: above pi they buckle, above 3.195 they are bistable",
        lambda solution: solution.parts.strip.slenderness,
    ),
    "linear_start": ScalarQuantity(
        "length", "travel at which the leaves buckle", lambda solution: solution.linear_range[0]
    ),
    "linear_end": ScalarQuantity(
        "length", "travel at which they straighten again", lambda solution: solution.linear_range[1]
    ),
    "linear_stroke": ScalarQuantity("length", "length of the linear negative stiffness", _linear_stroke),
    "constant_force": ScalarQuantity(
        "force",
        "force of the spring where the leaves carry no force, K_p (h + dr) for straight leaves; none unless at least "
        "half of the window is flat at that force",
        lambda solution: solution.constant_force,
        _why_not_constant,
    ),
    "window_start": ScalarQuantity(
        "length", "start of the longest window within analysis.flatness", lambda solution: solution.flat[0]
    ),
    "window_end": ScalarQuantity(
        "length", "end of the longest window within analysis.flatness", lambda solution: solution.flat[1]
    ),
    "window_length": ScalarQuantity(
        "length",
        "length of the longest window within analysis.flatness; 0 if there is none",
        lambda solution: np.nan_to_num(solution.flat[1] - solution.flat[0]),
    ),
    "window_force": ScalarQuantity(
        "force", "mean force in the longest window within analysis.flatness", lambda solution: solution.window_force
    ),
    "rest_position": ScalarQuantity(
        "length",
        "rest position of the shuttle at the nominal preload, from the unloaded position",
        lambda solution: solution.nominal.rest,
    ),
    "rest_shift_max": ScalarQuantity(
        "length", "largest distance of a rest position from the unloaded position, over all preloads", _rest_shift_max
    ),
    "force_change_max": ScalarQuantity(
        "force",
        "largest change of the mean force due to a preload, relative to the nominal one",
        lambda solution: _largest_change(solution)[0],
    ),
    "adjusted_force_min": ScalarQuantity(
        "force",
        "smallest mean force over the window, of all preloads",
        lambda solution: _value_over_preloads(solution, lambda forces: forces.mean(axis=2).min(axis=1)),
    ),
    "adjusted_force_max": ScalarQuantity(
        "force",
        "largest mean force over the window, of all preloads",
        lambda solution: _value_over_preloads(solution, lambda forces: forces.mean(axis=2).max(axis=1)),
    ),
    "adjusted_ripple_max": ScalarQuantity(
        "ratio",
        "largest (max - min)/max of the force over the window, of all preloads",
        lambda solution: _value_over_preloads(
            solution, lambda forces: (1.0 - forces.min(axis=2) / forces.max(axis=2)).max(axis=1)
        ),
    ),
    "force_per_preload": ScalarQuantity(
        "stiffness",
        "largest change of the mean force due to a preload, over the change of the preload",
        lambda solution: np.divide(*_largest_change(solution)),
    ),
    "least_force": ScalarQuantity(
        "force",
        "smallest force beyond the peak of the leaves; positive: the shuttle returns by itself",
        lambda solution: solution.least[1],
    ),
    "stiffness_mismatch": ScalarQuantity(
        "ratio",
        "|K_p - K_n| times the length of the window over the force of the spring where the leaves carry none",
        _stiffness_mismatch,
    ),
    "allowable_stress": ScalarQuantity(
        "stress", "yield strength over `mechanism.safety_factor`", lambda solution: solution.allowable_stress
    ),
    "spring_stress_max": ScalarQuantity(
        "stress", "largest stress of the spring up to the end of the window, over all preloads", _spring_stress_max
    ),
    "bistable_stress_max": ScalarQuantity(
        "stress",
        "largest stress of the leaves up to the end of the window, over all preloads",
        lambda solution: solution.leaf_stress(solution.window[1]),
    ),
    "travel_stress_max": ScalarQuantity(
        "stress",
        "largest stress of leaves and spring over the whole travel and all preloads; decisive unless a stop ends "
        "the travel at the end of the window",
        _travel_stress_max,
    ),
    "travel_safety_factor": ScalarQuantity(
        "factor", "allowable stress over `travel_stress_max`", _travel_safety_factor
    ),
    "spring_deflection_max": ScalarQuantity(
        "length",
        "largest deflection of bought springs over the travel and all preloads",
        _spring_deflection_max,
        applies=_is_bought,
    ),
    **{name: quantity_of_each(name, about, _wires) for name, about in WIRE_DEFINITIONS.items()},
}
"""Every scalar result of the family, in the order in which they are shown."""
ROW_COLUMNS = columns_of_absent_values(STOP_QUANTITIES) | dict(SCALAR_QUANTITIES)
"""What studies may ask of rows; a mechanism with stops is solved by itself."""
SCALAR_DEFINITIONS = {name: quantity.about for name, quantity in SCALAR_QUANTITIES.items()} | STOP_QUANTITIES
"""Name -> dimension and definition."""


def adjustability(solution: Solution) -> Table:
    """Return what each preload gives: force in the window, its change, rest position, start of the constant force."""
    flat, forces = np.transpose(solution.curves.flat_parts(solution.spec.analysis.flatness)), solution.window_forces[0]
    stresses = (
        stress(solution.window[1]).tolist() for stress in (solution.curves.leaf_stress, solution.curves.spring_stress)
    )
    rows = []
    for push, (start, end), force, leaves, spring in zip(solution.pushes, flat, forces, *stresses, strict=True):
        row: dict[str, Any] = {"preload": push.preload, "rest_position": push.rest} | force_statistics(force)
        row |= {"force_change": float(force.mean() - forces[0].mean())}
        row |= {"spring_stress_max": spring, "bistable_stress_max": leaves}
        if np.isfinite(start):
            row |= {"window_start": start, "window_end": end, "window_length": end - start}
            row |= {"window_start_from_rest": start - push.rest if push.rest is not None else None}
        rows.append(row)
    return _make_table(rows, _PRELOAD_COLUMNS)


_PRELOAD_COLUMNS = {
    "preload": "length",
    "force_mean": "force",
    "force_change": "force",
    "force_min": "force",
    "force_max": "force",
    "force_ripple": "ratio",
    "rest_position": "length",
    "window_start": "length",
    "window_end": "length",
    "window_start_from_rest": "length",
    "window_length": "length",
    "spring_stress_max": "stress",
    "bistable_stress_max": "stress",
}


def force_statistics(force: FloatArray) -> dict[str, float]:
    """Return mean, extremes and (max - min)/max of a force [N]."""
    high, low = float(force.max()), float(force.min())
    ripple = (high - low) / high if high > 0 else np.nan
    return {"force_mean": float(force.mean()), "force_min": low, "force_max": high, "force_ripple": ripple}


@dataclass(frozen=True)
class TableReading:
    """One way to read a table of sizes: how many leaves there are, and how stiff the spring is [N/m]."""

    text: str
    half_beams: int
    positive_stiffness: float
    truss: bool = False


def readings(solution: Solution) -> Table:
    """Return what the mechanism would give without preload with other numbers of leaves and parts of the spring.

    Where a measured force and stiffness are stated, also with those.
    """
    rows = []
    for reading in _list_readings(solution):
        spread_values = force_statistics(_force(solution, reading))
        about = {
            "reading": reading.text,
            "half_beams": reading.half_beams,
            "positive_stiffness": reading.positive_stiffness,
        }
        rows.append(about | spread_values)
    return _make_table(rows, _READING_COLUMNS)


_READING_COLUMNS = {
    "reading": "text",
    "half_beams": "count",
    "positive_stiffness": "stiffness",
    "force_mean": "force",
    "force_min": "force",
    "force_max": "force",
    "force_ripple": "ratio",
}


def _list_readings(solution: Solution) -> Iterator[TableReading]:
    mechanism, reported = solution.spec.mechanism, solution.spec.analysis.measured
    if mechanism.positive is None:
        for leaves in sorted({2, 4, mechanism.bistable.half_beams}):
            mark = ", as specified" if leaves == mechanism.bistable.half_beams else ""
            yield TableReading(f"{leaves} half-beams{mark}", leaves, solution.character.positive_stiffness)
        return
    whole = solution.character.positive_stiffness / share_of(mechanism.flexures)
    for leaves in sorted({2, 4, mechanism.bistable.half_beams}):
        for name, share in (("half", 0.5), ("whole", 1.0)):
            same = leaves == mechanism.bistable.half_beams and name == mechanism.flexures.loaded
            mark = ", as specified" if same else ""
            yield TableReading(f"{leaves} half-beams, {name} spring{mark}", leaves, share * whole)
    truss = mechanism.flexures.kind.truss
    if truss is not None and solution.leaf_kind.truss is not None:
        one_chain = truss(strip_of(mechanism.flexures, mechanism.material), 0.5).stiffness
        yield TableReading("the paper's eq. 19 as printed: truss law", 2, float(one_chain), truss=True)
    if reported is not None:
        yield TableReading("measured stiffness, 2 half-beams", 2, reported.positive_stiffness)
        yield TableReading("twice the measured stiffness, 4 half-beams", 4, 2.0 * reported.positive_stiffness)
        needed = measured_stiffness_for(reported.force, solution.parts.balance)
        yield TableReading("the stiffness that the measured force needs, 4 half-beams", 4, needed)


def _force(solution: Solution, reading: TableReading) -> FloatArray:
    """Return the force of a reading without preload at even places of the window [N]."""
    places = np.linspace(*solution.window_of_one, MEAN_PLACES)
    if reading.truss and (truss := solution.leaf_kind.truss) is not None:
        law = truss(solution.parts.strip)
        return np.asarray(reading.half_beams * law.force(places) + reading.positive_stiffness * places)
    leaves = solution.sampler.leaves(places).force / solution.parts.half_beams
    spring = solution.sampler.spring(places)[0] / solution.character.positive_stiffness
    return np.asarray(reading.half_beams * leaves + reading.positive_stiffness * spring)


def _make_table(rows: list[dict[str, Any]], columns: dict[str, str]) -> Table:
    table_columns = []
    for name, dimension in columns.items():
        values = [row.get(name) for row in rows]
        if dimension in ("text", "count"):
            table_columns.append(TableColumn(name, tuple(values)))
        else:
            numbers = np.array([or_nan(value) for value in values])
            table_columns.append(border_column(name, numbers, dimension))
    return Table(tuple(table_columns))
