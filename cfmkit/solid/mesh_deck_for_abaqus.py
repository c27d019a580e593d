"""A meshed part as an input deck of Abaqus and CalculiX: plane-stress triangles, supports, hubs, one large step.

Units are mm, N, MPa. CalculiX expands plane elements to wedges, which at a width of many thicknesses cannot bend
anticlastically: 13 % too stiff for Lan's part. The deck's width is therefore a small share of the part's, and its
forces are that share of the part's; a comment at its head says which.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial import Delaunay

from cfmkit.errors import UsageError
from cfmkit.specs.units import to_border

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.solid.adaptive_solution import DrivenPart
    from cfmkit.solid.meshed_part import Meshed, Part
    from cfmkit.solid.plane_stress_law import Law
    from cfmkit.solid.rigid_groups import Group

ELEMENT_WIDTH_RATIO = 0.1
"""Width of the deck's elements, in the thinnest place of the part at most: within 6e-4 of plane stress then."""
NUMBERS_PER_LINE = 12  # numbers on a line of a set
MAX_GUIDE_NODES = 2  # nodes that carry what is prescribed along a direction, at most
POINTS_PER_INCREMENT = 4  # points on the arc of what is turned, to each increment: between them it is led along a chord
HUB_MODULUS_FACTOR = 1e3  # modulus of a hub, in that of the part
LINE_RTOL = 1e-6
"""Height of what counts as a line, in its length: outlines are drawn a little beside the line across a beam."""


def deck(
    name: str,  # for its heading
    driven: DrivenPart,  # its travel is taken in as many even increments as it has stops
) -> bytes:
    """Return a deck that runs as it is, of the mesh of an analysis before it is refined where the error asks for it.

    Raises UsageError if constant loads act on it.
    """
    part, stops = driven.part, driven.stops
    if any(place.load.any() for place in part.places):
        raise UsageError("--format inp: decks have no constant loads; leave out 'mechanism.loads'")
    lines = _deck_lines(name, part, part.create_mesh().refine()[0], stops[-1], len(stops))
    return ("\n".join(lines) + "\n").encode("ascii", "replace")


def _deck_lines(name: str, part: Part, meshed: Meshed, travel: float, poses: int) -> Iterator[str]:
    elements, groups = meshed.problem.elements, meshed.problem.supports.groups
    grid = elements.mesh
    widths = np.unique(elements.width)
    share = min(1.0, ELEMENT_WIDTH_RATIO * part.thinnest / float(widths.max()))
    used = np.zeros(len(grid.nodes), bool)
    used[grid.triangles] = True
    number = np.cumsum(used)
    yield "*HEADING"
    yield f"{name}, from cfmkit; mm, N, MPa"
    yield f"** widths are {share:.9g} times those of the part, and so are forces: divide by it"
    yield "*NODE, NSET=ALL"
    for k, (x, y) in zip(number[used], to_border(grid.nodes[used], "length").tolist(), strict=True):
        yield f"{k}, {x:.10g}, {y:.10g}, 0"
    start = 1
    for index, width in enumerate(widths, start=1):
        of_width = number[grid.triangles[elements.width == width]]
        yield f"*ELEMENT, TYPE=CPS6, ELSET=WIDTH-{index}"
        yield from (f"{start + k}, {', '.join(map(str, row))}" for k, row in enumerate(of_width.tolist()))
        start += len(of_width)
    yield "*MATERIAL, NAME=MATERIAL"
    yield from _material_lines(part.law)
    for index, width in enumerate(widths, start=1):
        yield f"*SOLID SECTION, ELSET=WIDTH-{index}, MATERIAL=MATERIAL"
        yield f"{share * to_border(float(width), 'length'):.10g}"
    held = [
        (f"{_set_name(group.name)}-{k}", group, used[group.nodes])
        for k, group in enumerate(groups, start=1)
        if used[group.nodes].any()
    ]
    spare, moves, turns = int(number[-1]) + 1, list[str](), list[str]()
    for word, group, seen in held:
        nodes = number[group.nodes[seen]].tolist()
        if _is_turned(group):
            places = dict(zip(nodes, grid.nodes[group.nodes[seen]], strict=True))
            hub = Hub.from_nodes(places, group.center, spare)
            yield from _hub_lines(word, hub, start, share * to_border(part.width, "length"), part.law.youngs_modulus)
            nodes, start, spare = list(dict.fromkeys([*nodes, hub.center])), start + len(hub.triangles), hub.spare
            made = _guide_lines(group, travel, hub.center, spare)
            turned = _turn_lines(word, hub, travel * float(group.driven[2]), spare + MAX_GUIDE_NODES, poses)
            spare += MAX_GUIDE_NODES + 2
        elif group.free.shape[1]:
            made, turned = _rigid_body_lines(word, group, travel, spare), Lines()
            spare += 2 + MAX_GUIDE_NODES
        else:
            ends = to_border(travel * group.driven[:2], "length").tolist()
            made, turned = Lines([], [f"{word}, {k}, {k}, {end:.10g}" for k, end in enumerate(ends, start=1)]), Lines()
        yield f"*NSET, NSET={word}"
        yield from (
            ", ".join(map(str, nodes[k : k + NUMBERS_PER_LINE])) + "," for k in range(0, len(nodes), NUMBERS_PER_LINE)
        )
        yield from (*made.model, *turned.model)
        moves, turns = moves + made.moves, turns + turned.moves
    turned_arms = [f"{word}-ARM" for word, group, _ in held if travel * group.driven[2] != 0]
    yield from _step_lines([word for word, _, _ in held], turned_arms, [*moves, *turns], poses)


def _step_lines(sets: list[str], nodes: list[str], moves: list[str], poses: int) -> Iterator[str]:
    """Yield the step: prescribed motions, even increments, total forces on sets, and those on single nodes."""
    yield f"*STEP, NLGEOM, INC={100 * poses}"
    yield "*STATIC"
    yield f"{1 / poses:.10g}, 1., 1e-6, {1 / poses:.10g}"
    yield "*BOUNDARY"
    yield from moves
    for word in (*(f"{name}, TOTALS=ONLY" for name in sets), *nodes):
        yield f"*NODE PRINT, NSET={word}"
        yield "RF"
    yield from ("*NODE FILE", "U, RF", "*EL FILE", "S", "*END STEP")


def _material_lines(law: Law) -> Iterator[str]:
    """Yield a material's law."""
    from cfmkit.solid.plane_stress_law import NeoHookean

    young, poisson = to_border(law.youngs_modulus, "stress"), law.poisson_ratio
    if isinstance(law, NeoHookean):
        yield "** neo-hookean; its energy of volume is 1/D1 (J - 1)^2, which at small strain is cfmkit's"
        yield "*HYPERELASTIC, NEO HOOKE"
        yield f"{0.25 * young / (1 + poisson):.10g}, {6 * (1 - 2 * poisson) / young:.10g}"
        return
    yield "** nlgeom with a linear elastic material: the law that cfmkit calls st-venant-kirchhoff"
    yield "*ELASTIC"
    yield f"{young:.10g}, {poisson:.10g}"


def _set_name(name: str) -> str:
    """Return a name that every solver takes as that of a set."""
    return "".join(char if char.isalnum() or char == "-" else "-" for char in name.upper())[:60].strip("-") or "SET"


@dataclass(frozen=True)
class Lines:
    """Lines of a deck for a support: those of its model, and those of what the step prescribes."""

    model: list[str] = field(default_factory=list)
    moves: list[str] = field(default_factory=list)


def _is_turned(group: Group) -> bool:
    """Return True if a group turns, freely or by the drive: then it is joined by a hub."""
    return bool(np.any(np.abs(group.free[2]) > 0.5) or group.driven[2] != 0)


@dataclass(frozen=True)
class Hub:
    """Stiff triangles that join nodes to a centre, about which they turn.

    CalculiX does not converge where a rigid body turns freely; with a stiff one it does, in four rounds.
    """

    center: int  # number of the node in the centre
    arm: tuple[int, FloatArray]  # (int, (2,): number of the node farthest from it, and from where to there [m]
    added: dict[int, FloatArray]  # nodes that are not of the part [m]
    spare: int  # the next number that is free
    triangles: NDArray[np.int64]  # (m, 3) numbers of nodes, counter-clockwise

    @classmethod
    def from_nodes(cls, places: dict[int, FloatArray], center: FloatArray, spare: int) -> Hub:
        """Return the hub of nodes at some places [m], with own nodes from a number on.

        Nodes on a line across a beam have one more on each side of it.
        """
        places_of_group = np.array(list(places.values()))
        along, across = np.linalg.svd(places_of_group - places_of_group.mean(axis=0), full_matrices=False)[2]
        size = float(np.ptp(places_of_group @ along))
        middle = min(places, key=lambda node: float(np.hypot(*(places[node] - center))))
        added = {}
        if np.hypot(*(places[middle] - center)) > LINE_RTOL * size:
            middle, added = spare, {spare: center}
        if np.ptp(places_of_group @ across) < LINE_RTOL * size:
            added |= {spare + 1: center + 0.5 * size * across, spare + 2: center - 0.5 * size * across}
        every = np.array([*places, *added])
        at = np.array([*places_of_group, *added.values()])
        triangles = Delaunay(at).simplices
        a, b, c = at[triangles].swapaxes(0, 1)
        twice = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
        triangles[twice < 0] = triangles[twice < 0][:, [0, 2, 1]]
        triangles = triangles[np.abs(twice) > LINE_RTOL * size**2 / len(at)]
        far = int(np.hypot(*(at - center).T).argmax())
        return cls(middle, (int(every[far]), at[far] - center), added, max([spare, *added]) + 1, every[triangles])


def _hub_lines(word: str, hub: Hub, start: int, width: float, modulus: float) -> Iterator[str]:
    """Yield a hub's nodes, elements and material; `width` in mm, `modulus` that of the part [Pa]."""
    yield from _node_lines(hub.added)
    yield f"*ELEMENT, TYPE=CPS3, ELSET=HUB-{word}"
    yield from (f"{start + k}, {', '.join(map(str, row))}" for k, row in enumerate(hub.triangles.tolist()))
    yield f"*MATERIAL, NAME=STIFF-{word}"
    yield "*ELASTIC"
    yield f"{HUB_MODULUS_FACTOR * to_border(modulus, 'stress'):.10g}, 0"
    yield f"*SOLID SECTION, ELSET=HUB-{word}, MATERIAL=STIFF-{word}"
    yield f"{width:.10g}"


def _node_lines(places: dict[int, FloatArray]) -> list[str]:
    """Return the lines of nodes at places [m]."""
    rows = [(node, to_border(at, "length").tolist()) for node, at in places.items()]
    return ["*NODE", *(f"{node}, {x:.10g}, {y:.10g}, 0" for node, (x, y) in rows)] if rows else []


def _rigid_body_lines(word: str, group: Group, travel: float, spare: int) -> Lines:
    """Return a rigid body that does not turn, with its guides: a centre, a node that turns with it, and carriers."""
    guided = _guide_lines(group, travel, spare, spare + 2)
    body = f"*RIGID BODY, NSET={word}, REF NODE={spare}, ROT NODE={spare + 1}"
    model = [*_node_lines(dict.fromkeys((spare, spare + 1), group.center)), body, *guided.model]
    return Lines(model, [f"{spare}, 3, 3, 0", f"{spare + 1}, 1, 3, 0", *guided.moves])


def _guide_lines(group: Group, travel: float, center: int, carrier: int) -> Lines:
    """Return what moves a centre along every direction that is not free, by nodes from `carrier` on."""
    model, moves = _node_lines(dict.fromkeys(range(carrier, carrier + MAX_GUIDE_NODES), group.center)), []
    for direction in _prescribed_directions(group.free):
        terms = [(center, 1 + k, float(direction[k])) for k in (0, 1) if abs(direction[k]) > 1e-12]
        terms.sort(key=lambda term: -abs(term[2]))  # the first is eliminated: it must not vanish
        model += _equation_lines(*terms, (carrier, 1, -1.0))
        moves += [f"{carrier}, 1, 1, {to_border(travel * float(direction @ group.driven[:2]), 'length'):.10g}"]
        moves += [f"{carrier}, 2, 3, 0"]
        carrier += 1
    return Lines(model, moves)


def _equation_lines(*terms: tuple[int, int, float]) -> list[str]:
    """Return that terms (node, axis, factor) add up to nothing."""
    reported = ", ".join(f"{node}, {axis}, {factor:.12g}" for node, axis, factor in terms)
    return ["*EQUATION", str(len(terms)), reported]


def _turn_lines(word: str, hub: Hub, angle: float, carrier: int, poses: int) -> Lines:
    """Return what turns a hub by an angle [rad], nothing without one: two nodes lead its arm round the centre.

    The torque is the moment of the force on the arm about the centre.
    """
    if angle == 0:
        return Lines()
    x, y = to_border(hub.arm[1], "length").tolist()
    time = np.linspace(0.0, 1.0, POINTS_PER_INCREMENT * poses + 1)
    c, s = np.cos(angle * time), np.sin(angle * time)
    model = [f"** torque on {word}: x Fy - y Fx, with the force on node {hub.arm[0]}"]
    model += [f"** and (x, y) = ({x:.9g}, {y:.9g}) mm turned by {angle:.9g} rad times the time"]
    model += _node_lines(dict.fromkeys((carrier, carrier + 1), hub.arm[1]))
    moves = []
    for axis, arm in ((1, x * (c - 1) - y * s), (2, x * s + y * (c - 1))):
        node = carrier + axis - 1
        model += _equation_lines((hub.arm[0], axis, 1.0), (hub.center, axis, -1.0), (node, axis, -1.0))
        model += [f"*AMPLITUDE, NAME={word}-{axis}", *(f"{t:.10g}, {u:.10g}" for t, u in zip(time, arm, strict=True))]
        moves += [f"*BOUNDARY, AMPLITUDE={word}-{axis}", f"{node}, {axis}, {axis}, 1"]
        moves += ["*BOUNDARY", f"{node}, {3 - axis}, {3 - axis}, 0", f"{node}, 3, 3, 0"]
    model += [f"*NSET, NSET={word}-ARM", f"{hub.arm[0]},"]
    return Lines(model, moves)


def _prescribed_directions(free: FloatArray) -> list[FloatArray]:
    """Return unit displacements (2,) that are prescribed: those across all free ones."""
    flat = free[:2, np.abs(free[2]) < 0.5]
    if flat.shape[1] == 0:
        return [np.array([1.0, 0.0]), np.array([0.0, 1.0])]
    return [np.array([-flat[1, 0], flat[0, 0]])] if flat.shape[1] == 1 else []
