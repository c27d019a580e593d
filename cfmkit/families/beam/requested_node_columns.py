"""Columns of nodes and beams: those that `analysis.outputs` asks for, of beams and of solids alike, and forces."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from cfmkit.curves import Column

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from cfmkit.arrays import FloatArray
    from cfmkit.families.beam.spec import Outputs

    Read = Callable[[str], FloatArray]  # from a name to three values at each of n points, (n, 3)
    LazyColumns = dict[str, Callable[[], Column]]

MOTION_DIMENSIONS = {"x": "length", "y": "length", "rotation": "angle"}
REACTION_DIMENSIONS = {"fx": "force", "fy": "force", "m": "torque"}
END_FORCES = {"force_x": "force", "force_y": "force", "moment": "torque"}
"""What three columns of a node or a beam are called after its name, and their dimensions."""


def columns_of(name: str, read: Read, endings: Mapping[str, str]) -> LazyColumns:
    """Return three columns of a node or a beam, each as what computes it."""

    def column(k: int, dimension: str) -> Column:
        return Column(read(name)[:, k], dimension)

    return {f"{name}_{end}": partial(column, k, dimension) for k, (end, dimension) in enumerate(endings.items())}


def output_columns(
    outputs: Outputs,
    motion: Read,  # from a node to its x, y [m] and rotation [rad] at the points of the curve, (n, 3)
    # from a node to the force x, y [N] and the moment [N m] that hold it, of support and of a drive by a motion, for
    # one copy, (n, 3)
    reaction: Read,
) -> LazyColumns:
    """Return the columns of the nodes that are named, each as what computes it."""
    columns: LazyColumns = {}
    for name in outputs.nodes:
        columns |= columns_of(name, motion, MOTION_DIMENSIONS)
    for name in outputs.reactions:
        columns |= columns_of(name, reaction, REACTION_DIMENSIONS)
    return columns
