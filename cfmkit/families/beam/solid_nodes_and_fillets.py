"""A beam mechanism's part as a solid: motions, reactions and stresses at its nodes and fillets.

Motions and reactions of nodes are those of the half described: a node that is held or driven is a rigid piece, any
other goes with the material there. A fillet has its largest stress, with the node and the beams that it joins; nominal
stresses are those of the network that the part is drawn from, with stretching and shear.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.families.beam.drawn_pieces import both_halves
from cfmkit.families.beam.network_from_spec import constant_load, is_on_axis, node_place
from cfmkit.families.beam.part import POINT_TOLERANCE_FACTOR, strips_of
from cfmkit.families.fem_results import FilletRow, both_images, nominal_stresses, with_nominal

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.families.beam.network_from_spec import Assembly
    from cfmkit.solid.meshed_part import MeshSolution


@dataclass(frozen=True, eq=False)
class SolidNodes:
    """Nodes of a solved part."""

    assembly: Assembly  # the network that the part is drawn from
    solved: MeshSolution

    def motion(self, name: str) -> Callable[[FloatArray], FloatArray]:
        """Return x, y [m] and rotation [rad] as a function of travels (n,), (n, 3); NaN where there is no material."""
        from cfmkit.solid.point_motions_and_reactions import motion

        return motion(self.solved, self._node_place(name), name)

    def reaction(self, name: str) -> Callable[[FloatArray], FloatArray]:
        """Return the force x, y [N] and the moment [N m] that support and drive exert on a node, of one half, (n, 3).

        At a node on the mirror axis both halves press on each other beside it, in the fillets: what holds one half
        there follows from its equilibrium. NaN where two nodes are on the axis.
        """
        from cfmkit.solid.point_motions_and_reactions import reaction

        if not is_on_axis(self.assembly, name):
            return reaction(self.solved, name, self._described)
        nodes = self.assembly.network.nodes
        others = [place.name for place in self.solved.part.places if place.name in nodes and place.name != name]
        if any(is_on_axis(self.assembly, neighbour) for neighbour in others):
            return lambda travel: np.full((len(travel), 3), np.nan)
        load = constant_load(self.assembly, name)
        return lambda travel: (
            -np.sum([self._transfer_reaction(name, neighbour, travel) for neighbour in others], axis=0) - load
        )

    def _transfer_reaction(self, name: str, neighbour: str, travel: FloatArray) -> FloatArray:
        """Return the reaction at another node with its moment about this one, (n, 3)."""
        reaction = self.reaction(neighbour)(travel) + constant_load(self.assembly, neighbour)
        place, end = ((self._node_place(node) + self.motion(node)(travel)[:, :2]).T for node in (name, neighbour))
        arm = end - place
        return np.asarray(reaction + np.outer(arm[0] * reaction[:, 1] - arm[1] * reaction[:, 0], [0.0, 0.0, 1.0]))

    def _node_place(self, name: str) -> FloatArray:
        return node_place(self.assembly.network, name)

    @cached_property
    def _described(self) -> NDArray[np.bool_] | None:
        """Which elements are of the half that is described: on its side of the mirror axis; None without one."""
        mirror = self.assembly.mirror
        if mirror is None:
            return None
        grid, back = self.solved.problem.elements.mesh, np.exp(-1j * mirror.direction)
        middles = grid.nodes[grid.triangles[:, :3]].mean(axis=1) @ [1.0, 1.0j]
        side = sum(((complex(*self._node_place(name)) - mirror.at) * back).imag for name in self.assembly.network.nodes)
        return np.asarray(((middles - mirror.at) * back).imag * side > 0.0)


EDGE_TOLERANCE = 1e-3
"""Lines between points of a beam are no farther from its edges than this, in thicknesses of the thinnest one."""


def fillets(assembly: Assembly, solved: MeshSolution, window: tuple[float, float]) -> tuple[FilletRow, ...]:
    """Return the fillets with their largest stress in a window [m or rad]; those of a mirrored half with a prime."""
    from cfmkit.solid.stress_along_fillets import stressed_fillets

    spec = assembly.spec
    beams, nodes = _name_polygons(assembly)
    rows = []
    for fillet in stressed_fillets(solved, spec.mechanism.fillet):
        joined = fillet.arc.find_touched(beams)
        node = min(nodes, key=lambda name: float(np.hypot(*(nodes[name] - fillet.arc.middle))))
        if (largest := fillet.largest(*window)) is not None:
            rows.append(FilletRow(f"{node}: {', '.join(joined)}" if joined else node, fillet.arc, *largest))
    travel = np.array([row.motion for row in rows])
    drive: Any = assembly.drive()  # through a displacement or a rotation: a solid has no other
    paths = partial(both_images, assembly.network, lambda points: replace(drive, points=points))
    # a point of the mirrored half is one of the half that is described
    stresses = nominal_stresses(rows, travel, paths, lambda points: np.concatenate(assembly.add_images([points])))
    return with_nominal(rows, stresses)


def _name_polygons(assembly: Assembly) -> tuple[dict[str, list[FloatArray]], dict[str, FloatArray]]:
    """Return the polygons of the beams and the places of the nodes, of both halves, by name [m]."""
    exact, mirror = EDGE_TOLERANCE * assembly.thinnest, assembly.mirror
    halves = both_halves(assembly, strips_of(assembly, exact / POINT_TOLERANCE_FACTOR))
    beams = {name: [polygon for strip in strips for polygon in strip.polygons] for name, strips in halves.items()}
    nodes = {name: node_place(assembly.network, name) for name in assembly.network.nodes}
    if mirror is not None:
        images = {name: mirror.reflect(place) for name, place in nodes.items()}
        nodes |= {f"{name}'": place for name, place in images.items() if np.hypot(*(place - nodes[name])) > exact}
    return beams, nodes
