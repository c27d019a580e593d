"""The largest stress of a beam mechanism's part in each of its fillets, with the node and the beams that it joins.

Nominal stresses are those of the network that the part is drawn from, with stretching and shear.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.families.beam.drawn_pieces import both_halves
from cfmkit.families.beam.network_from_spec import mirror_axis
from cfmkit.families.beam.part import POINT_TOLERANCE_FACTOR, strips_of
from cfmkit.families.beam.strips_and_gaps import mirror_points
from cfmkit.families.fem_results import FilletRow, both_images, nominal_stresses, with_nominal

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.families.beam.network_from_spec import Assembly
    from cfmkit.solid.meshed_part import MeshSolution

EDGE_TOLERANCE = 1e-3
"""Lines between points of a beam are no farther from its edges than this, in thicknesses of the thinnest one."""


def fillets(assembly: Assembly, solved: MeshSolution, window: tuple[float, float]) -> tuple[FilletRow, ...]:
    """Return the fillets with their largest stress in a window [m or rad]; those of a mirrored half with a prime."""
    from cfmkit.solid.stress_along_fillets import stressed_fillets

    spec = assembly.spec
    beams, nodes = _name_polygons(assembly)
    rows = []
    for one in stressed_fillets(solved, spec.mechanism.fillet):
        joined = one.arc.find_touched(beams)
        node = min(nodes, key=lambda name: float(np.hypot(*(nodes[name] - one.arc.middle))))
        if (found := one.largest(*window)) is not None:
            rows.append(FilletRow(f"{node}: {', '.join(joined)}" if joined else node, one.arc, *found))
    travel = np.array([row.motion for row in rows])
    drive: Any = assembly.drive()  # through a displacement or a rotation: a solid has no other
    paths = partial(both_images, assembly.network, lambda points: replace(drive, points=points))
    return with_nominal(rows, nominal_stresses(rows, travel, paths, partial(_described_half, assembly)))


def _described_half(assembly: Assembly, points: FloatArray) -> FloatArray:
    """Return points of the part (m, 2), and where in the half that is described they are if they are mirrored [m]."""
    axis = mirror_axis(assembly)
    return points if axis is None else np.concatenate([points, mirror_points(points, *axis)])


def _name_polygons(assembly: Assembly) -> tuple[dict[str, list[FloatArray]], dict[str, FloatArray]]:
    """Return the polygons of the beams and the places of the nodes, of both halves, by name [m]."""
    network, axis = assembly.network, mirror_axis(assembly)
    exact = EDGE_TOLERANCE * min(beam.section.thinnest for beam in network.beams.values())
    halves = both_halves(assembly, strips_of(assembly, exact / POINT_TOLERANCE_FACTOR))
    beams = {name: [polygon for strip in found for polygon in strip.polygons] for name, found in halves.items()}
    nodes = {name: np.array([node.x, node.y]) for name, node in network.nodes.items()}
    if axis is not None:
        others = {name: mirror_points(place[None], *axis)[0] for name, place in nodes.items()}
        nodes |= {f"{name}'": place for name, place in others.items() if np.hypot(*(place - nodes[name])) > exact}
    return beams, nodes
