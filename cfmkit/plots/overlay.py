"""The curve of an earlier run, to be drawn beside that of a new one."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.errors import CfmError, UsageError, visible
from cfmkit.tables import read_csv

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.curves import Kind
    from cfmkit.tables import Table

MOTION_COLUMNS: dict[Kind, str] = {"force": "displacement [mm]", "torque": "angle [deg]"}
EFFORT_COLUMNS: dict[Kind, str] = {"force": "force [N]", "torque": "torque [N*mm]"}
"""Columns of curve.csv by the kind of the curve."""


@dataclass(frozen=True)
class EarlierCurve:
    """The nominal curve of an earlier run, in border units."""

    name: str  # of its folder
    kind: Kind
    branches: tuple[FloatArray, ...]  # (n, 2) motion and effort of each, in the order of the path

    def require(self, kind: Kind) -> None:
        """Raise if it cannot be drawn beside a curve of a kind.

        Raises UsageError if it is of the other one.
        """
        if kind != self.kind:
            raise UsageError(f"--overlay {visible(self.name)}: a curve of {self.kind}, and this one is of {kind}")


def read_earlier(folder: str) -> EarlierCurve:
    """Return the nominal curve in the output folder of `design` or `analyze`.

    Raises UsageError if there is no curve.csv, or it is not one of cfmkit.
    """
    file = Path(folder, "curve.csv")
    if not file.is_file():
        raise UsageError(f"--overlay {visible(folder)}: there is no curve.csv; name the folder of a design or analysis")
    try:
        table = read_csv(file)
        kind: Kind = "force" if EFFORT_COLUMNS["force"] in table.headers else "torque"
        return EarlierCurve(Path(folder).name or folder, kind, _first_curve_branches(table, kind))
    except (CfmError, KeyError, ValueError) as error:
        raise UsageError(f"--overlay {visible(folder)}: curve.csv is not a curve of cfmkit: {error}") from None


def _first_curve_branches(table: Table, kind: Kind) -> tuple[FloatArray, ...]:
    """Return the branches of the first curve: of several, the varied values lead."""
    motion, effort, branch = (
        np.asarray(table[name]) for name in (MOTION_COLUMNS[kind], EFFORT_COLUMNS[kind], "branch")
    )
    first = np.ones(len(table), dtype=bool)
    for header in table.headers[: table.headers.index("branch")]:
        first &= np.asarray(table[header]) == np.asarray(table[header])[0]
    names = dict.fromkeys(branch[first].tolist())
    return tuple(
        np.column_stack([motion[first & (branch == name)], effort[first & (branch == name)]]) for name in names
    )
