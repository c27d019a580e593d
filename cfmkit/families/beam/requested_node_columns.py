"""Columns that `analysis.outputs` asks for: motions and reactions of nodes, of beams and of solids alike."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cfmkit.curves import Column

if TYPE_CHECKING:
    from collections.abc import Callable

    from cfmkit.arrays import FloatArray
    from cfmkit.families.beam.spec import Outputs


def output_columns(
    outputs: Outputs, motion: Callable[[str], FloatArray], reaction: Callable[[str], FloatArray]
) -> dict[str, Column]:
    """Return the columns of the nodes that are named.

    Parameters
    ----------
    outputs : Outputs
    motion : callable
        From a node to its x, y [m] and rotation [rad] at the points of the curve, (n, 3).
    reaction : callable
        From a node to the force x, y [N] and the moment [N m] that hold it, of support and of a drive by a motion, for
        one copy, (n, 3).
    """
    columns: dict[str, Column] = {}
    for name in outputs.nodes:
        x, y, turn = motion(name).T
        columns |= {f"{name}_x": Column(x, "length"), f"{name}_y": Column(y, "length")}
        columns[f"{name}_rotation"] = Column(turn, "angle")
    for name in outputs.reactions:
        x, y, moment = reaction(name).T
        columns |= {f"{name}_fx": Column(x, "force"), f"{name}_fy": Column(y, "force")}
        columns[f"{name}_m"] = Column(moment, "torque")
    return columns
