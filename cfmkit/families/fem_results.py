"""Results of a part that is solved as a solid: scalar results, and the stress in each fillet.

Scalar results are errors of the mesh and the stress concentration; `fillets.csv` has a row for each fillet.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.results import Quantity
from cfmkit.tables import Table, TableColumn, border_column

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cfmkit.arrays import FloatArray
    from cfmkit.solid.stress_along_fillets import FilletArc


FEM_DEFINITIONS = {
    "mesh_force_difference": (
        "ratio",
        "largest difference of the force on the first two meshes, relative to the largest force",
    ),
    "mesh_stress_difference": (
        "ratio",
        "largest difference of a pose's largest stress on the first two meshes, relative to the largest of all poses",
    ),
    "mesh_force_error": (
        "ratio",
        "error of the force, relative to the largest force: what is left of the difference of two meshes on the last "
        "one, by the order of convergence, and `curve_error`; more than `analysis.solid.error` only where "
        "`mesh_coarse` warns",
    ),
    "mesh_stress_error": (
        "ratio",
        "discretisation error of the largest stress, relative to it: `mesh_stress_difference`, at least 3 %",
    ),
    "curve_error": (
        "ratio",
        "difference between the interpolated curve and poses solved between its poses, where it is expected to be "
        "largest, relative to the largest force; poses are added, up to twice as many, until it is at most a fifth "
        "of `analysis.solid.error`",
    ),
    "stress_concentration_max": (
        "factor",
        "largest stress of a fillet over that of beams in large deflection at the same displacement: bending and axial "
        "stress of the section where the fillet ends, at its edge; of the fillets where that is at least a tenth of "
        "the beams' largest",
    ),
}
"""Name -> dimension and definition; computed by `solid.adaptive_solution` and `nominal_stress_beside_fillets`."""


@dataclass(frozen=True, eq=False)
class FilletRow:
    """One fillet with its largest stress."""

    place: str  # what it joins, by names of the specification
    arc: FilletArc
    stress: float  # largest in the window, tension positive [Pa]
    motion: float  # where it occurs [m or rad]
    preload: float | None = None  # at which it occurs [m], of springs that are preloaded
    # stress of beams at the end of the fillet there [Pa], see `nominal_stress_beside_fillets`; NaN where there is none
    nominal: float = math.nan

    @property
    def concentration(self) -> float:
        """Stress over that of beams; NaN where that is not known."""
        return abs(self.stress / self.nominal)


def with_nominal(rows: Sequence[FilletRow], stresses: FloatArray) -> tuple[FilletRow, ...]:
    """Return rows with their nominal stresses (n,) [Pa]."""
    return tuple(replace(row, nominal=float(stress)) for row, stress in zip(rows, stresses, strict=True))


def largest_concentration(rows: Sequence[FilletRow]) -> dict[str, Quantity]:
    """Return the largest stress concentration of some fillets by its name, without a value where none has one."""
    found = max((row.concentration for row in rows if not math.isnan(row.concentration)), default=None)
    name = "stress_concentration_max"
    return {name: Quantity(found, *FEM_DEFINITIONS[name], "" if found else "beams have no stress at any fillet")}


def number_fillets(rows: Sequence[FilletRow], before: int = 0) -> dict[int, FilletArc]:
    """Return fillets by their numbers in the table, where so many rows stand before them."""
    return {number: row.arc for number, row in enumerate(rows, start=before + 1)}


def fillet_table(rows: Sequence[FilletRow], motion: tuple[str, str] = ("displacement", "length")) -> Table:
    """Return the table, with the name and the dimension of the motion."""
    places = np.array([row.arc.middle for row in rows]).reshape(-1, 2)
    columns = [
        TableColumn("fillet", tuple(number_fillets(rows))),
        TableColumn("place", tuple(row.place for row in rows)),
        border_column("x", places[:, 0], "length"),
        border_column("y", places[:, 1], "length"),
        border_column("radius", np.array([row.arc.radius for row in rows]), "length"),
        border_column("max_stress", np.abs([row.stress for row in rows]), "stress"),
        border_column(motion[0], np.array([row.motion for row in rows]), motion[1]),
    ]
    if any(row.preload is not None for row in rows):
        known = [np.nan if row.preload is None else row.preload for row in rows]
        columns.append(border_column("preload", np.array(known), "length"))
    columns += [
        border_column("nominal_stress", np.abs([row.nominal for row in rows]), "stress"),
        border_column("stress_concentration", np.array([row.concentration for row in rows]), "factor"),
    ]
    return Table(tuple(columns))
