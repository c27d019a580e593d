"""Geometry of a beam mechanism over its motion: unloaded strips and blocks, what of them is held, and all as it moves.

At clamps and at the part that is guided the beams end in pads, at pinned supports in eyes with a hole; rigid links and
what joins two mirrored halves are bars. Stages in series are drawn above each other, legs side by side once.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.arrays import distinct
from cfmkit.elastica import Path, PointLoad
from cfmkit.elastica.model.beam_fits import BeamFits
from cfmkit.export.contours import Contour
from cfmkit.export.ground_frame import ground_frame, move_polygon
from cfmkit.export.posed_part import PosedBody, PosedPart, rectangle, swept
from cfmkit.families.beam.drawn_pieces import (
    EYE_RADIUS,
    HOLE_RADIUS,
    BeamEnd,
    bars_between_halves,
    disc,
    drawn_parts,
    ends_at,
    is_padded,
    mitre_direction,
    pads_behind,
    section_at_bend,
)
from cfmkit.families.beam.network_from_spec import Mirror, assemble, is_on_axis, node_place, thickest_of
from cfmkit.families.beam.strips_and_gaps import BeamStrip, strips
from cfmkit.families.run_control import Run

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator, Sequence

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.export.posed_part import Role
    from cfmkit.families.beam.network_from_spec import Assembly
    from cfmkit.families.beam.solution import Solution
    from cfmkit.families.beam.spec import BeamSpec
    from cfmkit.results import Result

OUTLINE_TOLERANCE = 2e-4
"""How far outlines may be from the exact ones unless somebody states another value, in thicknesses of the thinnest
beam: both edges together change its bending stiffness by 1.2e-3 at most."""
MIN_FILLET_RATIO = 1e-4  # fillets smaller than this are not drawn, in thicknesses of the thinnest beam
N_SWEPT = 25  # poses at which what moves must be clear of the frame: in between beams go by less than their thickness
N_POSES = 13
"""Poses that a box counts: between two of them, a twelfth of the travel apart, beams bulge by next to nothing."""
BOX_TOLERANCE = 5e-5  # tolerance of the outline of a box: it is wanted to a tenth of a millimetre [m]
POLYGON_TOLERANCE_SHARE = 0.2  # part of the tolerance that polygons of eyes may be off
POINT_TOLERANCE_FACTOR = 5.0
"""How far lines between the points of a beam may be from its edges, in tolerances: edges are cubics between the points,
which are nearer by the square of that again."""


@dataclass(frozen=True)
class HeldPlace:
    """A place of the part that is held or driven and moves as one rigid piece."""

    name: str  # of its node; of the mirrored half with a prime
    node: str
    at: FloatArray  # (2,) where the node is [m]
    # polygons that it covers [m]; a line (2, 2) across a beam where the node is neither a pad nor an eye
    shapes: tuple[FloatArray, ...]
    seams: tuple[FloatArray, ...] = ()  # lines at which it begins [m]
    padded: bool = False  # whether its shapes are pads

    def reflect(self, mirror: Mirror) -> HeldPlace:
        """Return the same place of the mirrored half."""
        at, shapes, seams = mirror.reflect(self.at), map(mirror.reflect, self.shapes), map(mirror.reflect, self.seams)
        return replace(self, name=f"{self.node}'", at=at, shapes=tuple(shapes), seams=tuple(seams))


def regions(spec: BeamSpec, tolerance: float | None = None) -> tuple[HeldPlace, ...]:
    """Return where the part of `drawing` is held, driven or loaded: pads from the root plane on, the holes of eyes."""
    assembly = assemble(spec)
    tolerance = tolerance or fine_tolerance(assembly)
    beams = strips_of(assembly, tolerance)
    loaded = {load.node for load in assembly.network.loads if isinstance(load, PointLoad)}
    return tuple(held_places(assembly, beams, tolerance, loaded))


def strips_of(assembly: Assembly, tolerance: float = np.inf) -> dict[str, list[BeamStrip]]:
    """Return every beam in smooth pieces, as exact as a drawing of some tolerance [m] needs them."""
    network = assembly.network
    fits = BeamFits(network)
    return {name: strips(network, fits, name, POINT_TOLERANCE_FACTOR * tolerance) for name in network.beams}


def held_places(
    assembly: Assembly, beams: dict[str, list[BeamStrip]], tolerance: float, loaded: Collection[str] = ()
) -> Iterator[HeldPlace]:
    """Yield where a part is held or driven, or loaded at some nodes; `strips_of` gives its beams."""
    network, moving, bars = assembly.network, assembly.moving_nodes, bars_between_halves(assembly, beams)
    for node, about in network.nodes.items():
        ends = ends_at(assembly, beams, node)
        held = about.support.along or about.support.across or about.support.rotation
        if not ends or not (held or node in moving or node in loaded):
            continue
        region = _region(assembly, node, ends, POLYGON_TOLERANCE_SHARE * tolerance)
        joined = (bars[node],) if node in bars else ()
        yield replace(region, shapes=(*region.shapes, *joined))
        if assembly.mirror is not None and not is_on_axis(assembly, node):
            yield region.reflect(assembly.mirror)


def _region(assembly: Assembly, node: str, ends: list[BeamEnd], bulge: float) -> HeldPlace:
    """Return the place of the described half at which a node is held or driven."""
    at, support, mirror = node_place(assembly.network, node), assembly.network.nodes[node].support, assembly.mirror
    pads = list(pads_behind(assembly, node, ends)) if is_padded(assembly, node) else []
    if pads:
        return HeldPlace(node, node, at, tuple(pad for pad, _ in pads), tuple(end.cap for _, end in pads), True)
    end = ends[0]
    on_axis = is_on_axis(assembly, node)
    if support.across and not support.rotation and not on_axis:
        return HeldPlace(node, node, at, (disc(end.at, HOLE_RADIUS * end.thickness, bulge),))
    mitre = mirror.direction if mirror is not None and on_axis else mitre_direction(ends)
    section = end.cap if mitre is None else section_at_bend(ends, mitre, drawn_fillet(assembly.spec))
    return HeldPlace(node, node, at, (section,), (section,))


def drawn_fillet(spec: BeamSpec) -> float:
    """Return the radius of inside corners as drawn [m]: those much smaller than the beams are sharp corners."""
    fillet = spec.mechanism.fillet
    return fillet if fillet >= MIN_FILLET_RATIO * spec.mechanism.thinnest else 0.0


def fine_tolerance(assembly: Assembly) -> float:
    """Return how far an outline may be from the exact one where nobody states it [m]."""
    return OUTLINE_TOLERANCE * assembly.thinnest


def standing_frame(spec: BeamSpec) -> tuple[FloatArray, ...]:
    """Return the polygons of the frame around the part and of the bars to its pads [m], if one is requested."""
    assembly = assemble(spec)
    tolerance = fine_tolerance(assembly)
    return drawn_frame(assembly, strips_of(assembly, tolerance), tolerance)


def drawn_frame(assembly: Assembly, beams: dict[str, list[BeamStrip]], tolerance: float) -> tuple[FloatArray, ...]:
    """Return the same for a mechanism that is built."""
    frame = assembly.spec.mechanism.cut_part.frame
    if frame is None or frame.ground is None:
        return ()
    pads: dict[str, FloatArray] = {}
    covered: list[FloatArray] = []
    places = tuple(held_places(assembly, beams, tolerance))
    for place in places:
        if assembly.stands(place.node) and place.padded:
            pads |= {f"{place.name} ({k})" if k else place.name: shape for k, shape in enumerate(place.shapes)}
        else:
            holes = [shape for shape in place.shapes if len(shape) > 4]
            covered += [*place.shapes, *(place.at + EYE_RADIUS / HOLE_RADIUS * (hole - place.at) for hole in holes)]
    swept_area = _swept(assembly, places)
    return ground_frame(pads, swept_area, covered, frame.ground, frame.clearance, frame.inside).pieces


def _swept(assembly: Assembly, places: Sequence[HeldPlace]) -> Any:
    """Return all that beams, and pads that move, cover at rest and over the travel; all beams as thick as any."""
    from cfmkit.families.beam.model import solve

    spec = assembly.spec
    solid = spec.analysis.fidelity == "solid"
    solution = solve(spec.replace({"analysis.fidelity": "inextensible"}) if solid else spec)
    rest = list(itertools.chain.from_iterable(strips_of(assembly).values()))
    half = 0.5 * max(float(strip.thickness.max()) for strip in rest)
    lines = with_image(assembly, [PosedBody.line("beam", "free", strip.points, half) for strip in rest])
    poses = bodies(solution, choose_points(solution, N_SWEPT), places)
    moving = (body if body.closed else replace(body, half_thickness=half) for body in poses if body.role != "held")
    return swept([*lines, *moving])


# --- over the motion --------------------------------------------------------------------------------------------


def part_over_motion(result: Result) -> PosedPart | None:
    """Return a solved mechanism as it is cut, and as it moves along its drive; equal legs stand side by side in depth.

    A part that was solved as a solid moves as its beams do, to a fraction of a thickness. None if nothing was solved.
    """
    if hasattr(result.state, "fine"):
        from cfmkit.families.beam.model import analyze

        as_specified: Any = result.spec
        result = analyze(as_specified.replace({"analysis.fidelity": "reissner", "requirements": ()}), Run())
    if result.state is None:
        return None
    solution: Solution = result.state
    assembly, mechanism = solution.assembly, solution.spec.mechanism
    moving = bodies(solution, choose_points(solution, N_POSES), regions(solution.spec, BOX_TOLERANCE))
    return PosedPart(
        (*as_made(assembly), *moving),
        direction=0.5 * np.pi if mechanism.drive.turns else assembly.direction,
        depth=mechanism.legs * max(mechanism.width, *mechanism.collect_beam_values("width").values()),
        pieces=mechanism.legs,
    )


def as_made(assembly: Assembly) -> Iterator[PosedBody]:
    """Yield the boxes of all that a part is united from, and of the frame around it."""
    beams = strips_of(assembly, BOX_TOLERANCE)
    for piece in drawn_parts(assembly, beams, POLYGON_TOLERANCE_SHARE * BOX_TOLERANCE).pieces:
        yield PosedBody.polygon("as cut", "free", rectangle(*Contour(piece.edges, "cut").box))
    yield from (PosedBody.polygon("frame", "held", shape) for shape in drawn_frame(assembly, beams, BOX_TOLERANCE))


def bodies(
    solution: Solution,
    points: NDArray[Any],  # (p,) of int
    places: Sequence[HeldPlace] = (),  # whose pads are returned, as they move
    # from a path, a beam and a point of the path to its line (n, 2) [m]
    centre_line: Callable[[Path, str, int], FloatArray] = Path.shape,
) -> tuple[PosedBody, ...]:
    """Return beams and pads, those of a mirrored half included, at points of the curve."""
    assembly, path = solution.assembly, solution.path
    at = [int(solution.keep[point]) for point in points]
    beams = []
    for name, beam in path.network.beams.items():
        line = np.array([centre_line(path, name, point) for point in at]).reshape(len(at), -1, 2)
        beams.append(PosedBody.line("beam", "free", line, 0.5 * thickest_of(beam.section)))
    return (
        *with_image(assembly, beams),
        *(body for place in places for body in _moved_bodies(assembly, path, place, at)),
    )


def _moved_bodies(assembly: Assembly, path: Path, place: HeldPlace, at: Sequence[int]) -> Iterator[PosedBody]:
    """Yield the shapes of what moves as one rigid piece."""
    motion, mirror = path.motion(place.node), assembly.mirror
    role: Role = "driven" if place.node == assembly.driven else "free"
    if not np.abs(motion).max(initial=0.0) > 0.0:
        role = "held"
    poses = motion[at]
    if place.name != place.node and mirror is not None:
        poses = mirror.reflect_motion(poses)
    for shape in (shape for shape in place.shapes if len(shape) > 2):
        cores = [move_polygon(shape, pose[:2], pose[2], place.at) for pose in poses] if role != "held" else [shape]
        yield PosedBody.polygon("pad", role, np.array(cores).reshape(-1, *shape.shape))


def made_strips(assembly: Assembly) -> list[PosedBody]:
    """Return the smooth pieces of all unloaded beams."""
    made = itertools.chain.from_iterable(strips_of(assembly).values())
    return with_image(assembly, [PosedBody.polygon("strip", "free", strip.polygon) for strip in made])


def with_image(assembly: Assembly, described: Sequence[PosedBody]) -> list[PosedBody]:
    """Return bodies of the described half, and those of its mirror image."""
    mirror = assembly.mirror
    return [*described, *(replace(body, core=mirror.reflect(body.core)) for body in described if mirror is not None)]


def choose_points(solution: Solution, count: int) -> NDArray[Any]:
    """Return so many points of the curve, evenly, its ends included; none if it has none."""
    if not len(solution.keep):
        return np.zeros(0, int)
    return distinct(np.linspace(0, len(solution.keep) - 1, count).astype(int))
