"""Motions and reactions of the nodes of a mechanism whose part is solved as a solid: those of the half described.

A node that is held or driven is a rigid piece; any other goes with the material there.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.families.beam.network_from_spec import constant_load, is_on_axis, mirror_axis

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

        return motion(self.solved, self._place(name), name)

    def reaction(self, name: str) -> Callable[[FloatArray], FloatArray]:
        """Return the force x, y [N] and the moment [N m] that support and drive exert on a node, of one half, (n, 3).

        At a node on the mirror axis both halves press on each other beside it, in the fillets: what holds one half
        there follows from its equilibrium. NaN where two nodes are on the axis.
        """
        from cfmkit.solid.point_motions_and_reactions import reaction

        if not is_on_axis(self.assembly, name):
            return reaction(self.solved, name, self._described)
        others = [
            place.name
            for place in self.solved.part.places
            if place.name in self.assembly.network.nodes and place.name != name
        ]
        if any(is_on_axis(self.assembly, other) for other in others):
            return lambda travel: np.full((len(travel), 3), np.nan)
        load = constant_load(self.assembly, name)
        return lambda travel: -np.sum([self._transfer_reaction(name, other, travel) for other in others], axis=0) - load

    def _transfer_reaction(self, name: str, other: str, travel: FloatArray) -> FloatArray:
        """Return the reaction at another node with its moment about this one, (n, 3)."""
        found = self.reaction(other)(travel) + constant_load(self.assembly, other)
        here, there = ((self._place(node) + self.motion(node)(travel)[:, :2]).T for node in (name, other))
        arm = there - here
        return np.asarray(found + np.outer(arm[0] * found[:, 1] - arm[1] * found[:, 0], [0.0, 0.0, 1.0]))

    def _place(self, name: str) -> FloatArray:
        about = self.assembly.network.nodes[name]
        return np.array([about.x, about.y])

    @cached_property
    def _described(self) -> NDArray[np.bool_] | None:
        """Which elements are of the half that is described: on its side of the mirror axis; None without one."""
        axis = mirror_axis(self.assembly)
        if axis is None:
            return None
        grid, back = self.solved.problem.elements.mesh, np.exp(-1j * axis[1])
        middles = grid.nodes[grid.triangles[:, :3]].mean(axis=1) @ [1.0, 1.0j]
        side = sum(((complex(*self._place(name)) - axis[0]) * back).imag for name in self.assembly.network.nodes)
        return np.asarray(((middles - axis[0]) * back).imag * side > 0.0)
