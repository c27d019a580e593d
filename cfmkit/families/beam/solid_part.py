"""A beam mechanism's part as a solid that is to be solved: outline, what is held, driven and loaded, and the travels.

Under a force or a moment the part is the same with its node moved, far enough for the load.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.elastica import trace
from cfmkit.export.fixing_holes_and_labels import remove_screws
from cfmkit.families.beam.network_from_spec import assemble, constant_load, is_on_axis
from cfmkit.families.beam.outline import drawing
from cfmkit.families.beam.part import regions, standing_frame
from cfmkit.families.beam.solution import Solution
from cfmkit.families.fem_results import drop_repeats, remove_frame
from cfmkit.specs.units import window_places

if TYPE_CHECKING:
    from collections.abc import Callable

    from cfmkit.arrays import FloatArray
    from cfmkit.families.beam.network_from_spec import Assembly
    from cfmkit.families.beam.part import HeldPlace
    from cfmkit.families.beam.spec import BeamSpec
    from cfmkit.solid.adaptive_solution import DrivenPart
    from cfmkit.solid.meshed_part import Part


def part_of(spec: BeamSpec, assembly: Assembly) -> Part:
    """Return the part as it is solved: its outline, with what is held and driven."""
    from cfmkit.solid.meshed_part import HeldOrDriven, Part, largest_size_ratio, rings_of
    from cfmkit.solid.plane_stress_law import MATERIAL_LAWS

    frame = standing_frame(spec)
    pads = [shape for place in regions(spec) for shape in place.shapes if place.padded]
    bare = remove_screws(spec)
    drawn = drawing(remove_frame(bare, frame, pads) if frame else bare)
    cut = [contour for contour in drawn.contours if contour.layer == "cut"]
    material, width = (next(iter(spec.mechanism.collect_beam_values(key).values())) for key in ("material", "width"))
    law = MATERIAL_LAWS[material.law](material.modulus, material.poisson)
    places = [
        HeldOrDriven(at.name, at.shapes, at.at, *_motions(assembly, at), at.seams, _load(assembly, at))
        for at in regions(spec)
    ]
    rings, thinnest = rings_of(cut, assembly.thinnest), assembly.thinnest
    return Part(
        rings, thinnest, width, law, tuple(places), (), largest_size_ratio(rings, thinnest), frame, drawn.sections
    )


def driven_part(spec: BeamSpec, assembly: Assembly) -> DrivenPart:
    """Return the part with the travels that it is solved for."""
    from cfmkit.solid.adaptive_solution import DrivenPart

    analysis, reacting = spec.analysis, bool(spec.analysis.outputs.reactions)
    return DrivenPart("beams", part_of(spec, assembly), analysis.solid.error, tuple(_list_travels(spec)), reacting)


def _list_travels(spec: BeamSpec) -> list[float]:
    """Return the travels to solve for [m or rad]: even ones, and the ends of every window."""
    end = spec.extent
    inside = [place for place in ends_of_windows(spec, end) if 0.0 < place / end < 1.0]
    even = np.linspace(0.0, end, spec.analysis.solid.poses)
    # ends of windows that are an even pose but for rounding are that pose
    return drop_repeats(np.concatenate([even, inside]), end)[:: 1 if end > 0 else -1].tolist()  # type: ignore[no-any-return]


def _motions(assembly: Assembly, place: HeldPlace) -> tuple[FloatArray, FloatArray]:
    """Return how a region is driven, (3,), and which motions it is free in, (3, f)."""
    support, mirror = assembly.network.nodes[place.node].support, assembly.mirror
    flip = place.name != place.node
    direction = 2 * mirror.direction - support.direction if flip and mirror is not None else support.direction
    driven = np.zeros(3)
    along, across, turn = support.along, support.across, support.rotation
    if place.node == assembly.driven:
        if assembly.spec.mechanism.drive.turns:
            driven[2], turn = (-1.0 if flip else 1.0), True
        else:
            direction, along = assembly.direction, True
            driven[:2] = np.cos(direction), np.sin(direction)
    c, s = np.cos(direction), np.sin(direction)
    ways = ((along, (c, s, 0.0)), (across, (-s, c, 0.0)), (turn, (0.0, 0.0, 1.0)))
    return driven, np.array([direction for held, direction in ways if not held]).reshape(-1, 3).T


def _load(assembly: Assembly, place: HeldPlace) -> FloatArray:
    """Return the constant load on a region (3,): force [N] and moment [N m]; on the mirror axis of both halves."""
    load = constant_load(assembly, place.node)
    if assembly.mirror is None:
        return load
    image = assembly.mirror.reflect_motion(load)
    return load + image if is_on_axis(assembly, place.node) else load if place.name == place.node else image


def ends_of_windows(spec: BeamSpec, end: float) -> list[float]:
    """Return where every window starts and ends on a travel [m or rad]."""
    windows = [spec.analysis.window, *(requirement.over for requirement in spec.requirements)]
    return [place for window in windows if window is not None for place in window_places(window, (0.0, end))]


INITIAL_TRAVEL = 1e-3  # travel that is looked at first where beams have no pose under the load, in m or rad


def with_moved_node(spec: BeamSpec, travel: float) -> BeamSpec:
    """Return a mechanism that a load drives with its node moved by that load's motion instead [m or rad]."""
    drive: Any = spec.mechanism.drive
    if drive.turns:
        drive_keys, extent = {"kind": "rotation", "node": drive.node}, f"{travel!r} rad"
    else:
        drive_keys = {"kind": "displacement", "node": drive.node, "direction": drive.direction}
        extent = f"{travel!r} m"
    dropped = {"analysis.force": None, "analysis.moment": None, "analysis.through_folds": False}
    return spec.replace({"mechanism.drive": drive_keys, "analysis.travel": extent, **dropped})


def move_far_enough(spec: BeamSpec, report: Callable[[float, str], None] = lambda _share, _text: None) -> BeamSpec:
    """Return a mechanism that a load drives with its node moved until a coarse mesh of the part carries the load.

    Raises GeometryError if the part cannot be meshed.
    """
    from cfmkit.solid.path_up_to_load import travel_for

    guess = _travel_of_beams(assemble(spec))
    moved = with_moved_node(spec, guess)
    mesh, poses = part_of(moved, assemble(moved)).create_mesh(), max(spec.analysis.solid.poses, 5)

    def tell(share: float) -> None:
        report(share, "travel at the load")

    travel = travel_for(mesh, load_of_drawn_leg(spec), guess, poses, spec.analysis.through_folds, tell)
    return with_moved_node(spec, travel)


def load_of_drawn_leg(spec: BeamSpec) -> float:
    """Return the load at the end of the drive on what is drawn: one leg, with its mirror image [N or N m]."""
    return spec.extent / spec.mechanism.legs


def _travel_of_beams(assembly: Assembly) -> float:
    """Return how far the load moves the beams [m or rad]: as far as they go."""
    path = trace(assembly.network, assembly.drive(), assembly.control())
    kept = np.asarray(path.at_requested, np.int64)
    moved = float(Solution(assembly, path, kept).motion[-1]) if len(kept) > 1 else 0.0
    return moved if moved * assembly.spec.extent > 0 else float(np.sign(assembly.spec.extent)) * INITIAL_TRAVEL
