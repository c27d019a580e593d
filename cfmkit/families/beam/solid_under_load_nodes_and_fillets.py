"""A beam mechanism's part as a solid: motions, reactions and stresses at its nodes and fillets, and under a load.

Motions and reactions of nodes are those of the half described: a node that is held or driven is a rigid piece, any
other goes with the material there. A fillet has its largest stress, with the node and the beams that it joins; nominal
stresses are those of the network that the part is drawn from, with stretching and shear. Under a force or a moment the
part is the same with its node moved, far enough for the load.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.elastica import trace
from cfmkit.families.beam.drawn_pieces import both_halves
from cfmkit.families.beam.network_from_spec import assemble, constant_load, is_on_axis, mirror_axis
from cfmkit.families.beam.part import POINT_TOLERANCE_FACTOR, strips_of
from cfmkit.families.beam.solution import Solution
from cfmkit.families.beam.strips_and_gaps import mirror_points
from cfmkit.families.fem_results import FilletRow, both_images, nominal_stresses, with_nominal

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.families.beam.network_from_spec import Assembly
    from cfmkit.families.beam.spec import BeamSpec
    from cfmkit.solid.meshed_part import MeshSolution, Part


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
        if any(is_on_axis(self.assembly, neighbour) for neighbour in others):
            return lambda travel: np.full((len(travel), 3), np.nan)
        load = constant_load(self.assembly, name)
        return lambda travel: (
            -np.sum([self._transfer_reaction(name, neighbour, travel) for neighbour in others], axis=0) - load
        )

    def _transfer_reaction(self, name: str, neighbour: str, travel: FloatArray) -> FloatArray:
        """Return the reaction at another node with its moment about this one, (n, 3)."""
        reaction = self.reaction(neighbour)(travel) + constant_load(self.assembly, neighbour)
        place, neighbour_place = (
            (self._place(node) + self.motion(node)(travel)[:, :2]).T for node in (name, neighbour)
        )
        arm = neighbour_place - place
        return np.asarray(reaction + np.outer(arm[0] * reaction[:, 1] - arm[1] * reaction[:, 0], [0.0, 0.0, 1.0]))

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
    beams = {name: [polygon for strip in strips for polygon in strip.polygons] for name, strips in halves.items()}
    nodes = {name: np.array([node.x, node.y]) for name, node in network.nodes.items()}
    if axis is not None:
        others = {name: mirror_points(place[None], *axis)[0] for name, place in nodes.items()}
        nodes |= {f"{name}'": place for name, place in others.items() if np.hypot(*(place - nodes[name])) > exact}
    return beams, nodes


INITIAL_TRAVEL = 1e-3  # travel that is looked at first where beams have no pose under the load, in m or rad


def driven_by_load(spec: BeamSpec) -> bool:
    """Return True if a force or a moment drives a mechanism."""
    return spec.mechanism.drive.by_load


def moved_by(spec: BeamSpec, travel: float) -> BeamSpec:
    """Return a mechanism that a load drives with its node moved by that load's motion instead [m or rad]."""
    drive: Any = spec.mechanism.drive
    if drive.turns:
        drive_keys, extent = {"kind": "rotation", "node": drive.node}, f"{travel!r} rad"
    else:
        drive_keys = {"kind": "displacement", "node": drive.node, "direction": drive.direction}
        extent = f"{travel!r} m"
    return spec.replace(
        {
            "mechanism.drive": drive_keys,
            "analysis.travel": extent,
            "analysis.force": None,
            "analysis.moment": None,
            "analysis.through_folds": False,
        }
    )


def moved_far_enough(
    spec: BeamSpec,
    part: Callable[[BeamSpec, Assembly], Part],  # returns the part of a mechanism whose node is moved
    # is given the share that is done, and what is being done
    report: Callable[[float, str], None] = lambda _share, _text: None,
) -> BeamSpec:
    """Return a mechanism that a load drives with its node moved until a coarse mesh of the part carries the load.

    Raises GeometryError if the part cannot be meshed.
    """
    from cfmkit.solid.path_up_to_load import travel_for

    guess = _travel_of_beams(assemble(spec))
    moved = moved_by(spec, guess)
    moved_part = part(moved, assemble(moved))
    travel = travel_for(
        moved_part.create_mesh(),
        load_of_one(spec),
        guess,
        max(spec.analysis.solid.poses, 5),
        spec.analysis.through_folds,
        lambda share: report(share, "travel at the load"),
    )
    return moved_by(spec, travel)


def load_of_one(spec: BeamSpec) -> float:
    """Return the load at the end of the drive on what is drawn: one leg, with its mirror image [N or N m]."""
    copies = spec.mechanism.copies
    return spec.extent / (copies.legs if copies is not None else 1)


def _travel_of_beams(assembly: Assembly) -> float:
    """Return how far the load moves the beams [m or rad]: as far as they go."""
    path = trace(assembly.network, assembly.drive(), assembly.control())
    kept = np.asarray(path.at_requested, np.int64)
    moved = float(Solution(assembly, path, kept).motion[-1]) if len(kept) > 1 else 0.0
    return moved if moved * assembly.spec.extent > 0 else float(np.sign(assembly.spec.extent)) * INITIAL_TRAVEL
