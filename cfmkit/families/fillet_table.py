"""The file fillets.csv of a part that is solved as a solid: a row for each fillet, in every family."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.tables import Table, TableColumn, border_column

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cfmkit.solid.fillet_stress import FilletArc


@dataclass(frozen=True, eq=False)
class FilletRow:
    """One fillet with its largest stress.

    Attributes
    ----------
    place : str
        What it joins, by names of the specification.
    arc : FilletArc
    stress : float
        Largest in the window [Pa].
    motion : float
        Where it occurs [m or rad].
    preload : float, optional
        At which it occurs [m], of springs that are preloaded.
    """

    place: str
    arc: FilletArc
    stress: float
    motion: float
    preload: float | None = None


def fillet_table(rows: Sequence[FilletRow], motion: tuple[str, str] = ("displacement", "length")) -> Table:
    """Return the table, with the name and the dimension of the motion."""
    places = np.array([row.arc.middle for row in rows]).reshape(-1, 2)
    columns = [
        TableColumn("fillet", tuple(range(1, len(rows) + 1))),
        TableColumn("place", tuple(row.place for row in rows)),
        border_column("x", places[:, 0], "length"),
        border_column("y", places[:, 1], "length"),
        border_column("radius", np.array([row.arc.radius for row in rows]), "length"),
        border_column("max_stress", np.array([row.stress for row in rows]), "stress"),
        border_column(motion[0], np.array([row.motion for row in rows]), motion[1]),
    ]
    if any(row.preload is not None for row in rows):
        known = [np.nan if row.preload is None else row.preload for row in rows]
        columns.append(border_column("preload", np.array(known), "length"))
    return Table(tuple(columns))
