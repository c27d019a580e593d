"""Tables of a mechanism: what each preload gives, and what other readings of a paper's table of sizes would give."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.families.vcfm.leaf_laws_from_spec import share_of, strip_of
from cfmkit.families.vcfm.leaves.positive_stiffness_springs import measured_stiffness_for
from cfmkit.families.vcfm.solution import MEAN_PLACES
from cfmkit.tables import Table, TableColumn, border_column

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cfmkit.arrays import FloatArray
    from cfmkit.families.vcfm.solution import Solution


def adjustability(solution: Solution) -> Table:
    """Return what each preload gives: force in the window, its change, rest position, start of the constant force."""
    flat, forces = np.transpose(solution.curves.flat_parts(solution.spec.analysis.flatness)), solution.window_forces[0]
    stresses = (
        stress(solution.window[1]).tolist() for stress in (solution.curves.leaf_stress, solution.curves.spring_stress)
    )
    rows = []
    for push, (start, end), force, leaves, spring in zip(solution.pushes, flat, forces, *stresses, strict=True):
        row: dict[str, Any] = {"preload": push.preload, "rest_position": push.rest} | spread(force)
        row |= {"force_change": float(force.mean() - forces[0].mean())}
        row |= {"spring_stress_max": spring, "bistable_stress_max": leaves}
        if np.isfinite(start):
            row |= {"window_start": start, "window_end": end, "window_length": end - start}
            row |= {"window_start_from_rest": start - push.rest if push.rest is not None else None}
        rows.append(row)
    return _table(rows, _PRELOAD_COLUMNS)


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


def spread(force: FloatArray) -> dict[str, float]:
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
    for one in _readings(solution):
        found = spread(_force(solution, one))
        about = {"reading": one.text, "half_beams": one.half_beams, "positive_stiffness": one.positive_stiffness}
        rows.append(about | found)
    return _table(rows, _READING_COLUMNS)


_READING_COLUMNS = {
    "reading": "text",
    "half_beams": "count",
    "positive_stiffness": "stiffness",
    "force_mean": "force",
    "force_min": "force",
    "force_max": "force",
    "force_ripple": "ratio",
}


def _readings(solution: Solution) -> Iterator[TableReading]:
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


def _force(solution: Solution, one: TableReading) -> FloatArray:
    """Return the force of a reading without preload at even places of the window [N]."""
    places = np.linspace(*solution.window_of_one, MEAN_PLACES)
    if one.truss and (truss := solution.leaf_kind.truss) is not None:
        law = truss(solution.parts.strip)
        return np.asarray(one.half_beams * law.force(places) + one.positive_stiffness * places)
    leaves = solution.sampler.leaves(places).force / solution.parts.half_beams
    spring = solution.sampler.spring(places)[0] / solution.character.positive_stiffness
    return np.asarray(one.half_beams * leaves + one.positive_stiffness * spring)


def _table(rows: list[dict[str, Any]], columns: dict[str, str]) -> Table:
    found = []
    for name, dimension in columns.items():
        values = [row.get(name) for row in rows]
        if dimension in ("text", "count"):
            found.append(TableColumn(name, tuple(values)))
        else:
            known = np.array([np.nan if value is None else value for value in values])
            found.append(border_column(name, known, dimension))
    return Table(tuple(found))
