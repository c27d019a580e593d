"""A meshed part as an input deck of Abaqus and CalculiX: six-node plane-stress triangles, supports, one large step.

Units are mm, N, MPa. CalculiX expands plane elements to wedges, which at a width of many thicknesses cannot bend
anticlastically: 13 % too stiff for Lan's part. The deck's width is therefore a small share of the part's, and its
forces are that share of the part's; a comment at its head says which.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cfmkit.specs.units import to_border

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cfmkit.arrays import FloatArray
    from cfmkit.solid.meshed_part import Meshed, Part
    from cfmkit.solid.rigid_groups import Group
    from cfmkit.solid.two_meshes import DrivenPart

THIN = 0.1
"""Width of the deck's elements, in the thinnest place of the part at most: within 6e-4 of plane stress then."""
ROW = 12
"""Numbers on a line of a set."""


def deck(name: str, driven: DrivenPart) -> bytes:
    """Return a deck of the finer mesh that runs as it is.

    Parameters
    ----------
    name : str
        For its heading.
    driven : DrivenPart
        Its travel is taken in as many even increments as it has stops.
    """
    part, stops = driven.part, driven.stops
    lines = _lines(name, part, part.meshed(driven.size), stops[-1], len(stops))
    return ("\n".join(lines) + "\n").encode("ascii", "replace")


def _lines(name: str, part: Part, meshed: Meshed, travel: float, poses: int) -> Iterator[str]:
    elements, groups = meshed.problem.elements, meshed.problem.supports.groups
    grid = elements.mesh
    widths = np.unique(elements.width)
    share = min(1.0, THIN * part.thinnest / float(widths.max()))
    used = np.zeros(len(grid.nodes), bool)
    used[grid.triangles] = True
    number = np.cumsum(used)
    yield "*HEADING"
    yield f"{name}, from cfmkit; mm, N, MPa"
    yield f"** widths are {share:.9g} times those of the part, and so are forces: divide by it"
    yield "** nlgeom with a linear elastic material: the law that cfmkit calls st-venant-kirchhoff"
    yield "*NODE, NSET=ALL"
    for k, (x, y) in zip(number[used], to_border(grid.nodes[used], "length").tolist(), strict=True):
        yield f"{k}, {x:.10g}, {y:.10g}, 0"
    start = 1
    for index, width in enumerate(widths, start=1):
        own = number[grid.triangles[elements.width == width]]
        yield f"*ELEMENT, TYPE=CPS6, ELSET=WIDTH-{index}"
        yield from (f"{start + k}, {', '.join(map(str, row))}" for k, row in enumerate(own.tolist()))
        start += len(own)
    law = part.law
    yield "*MATERIAL, NAME=MATERIAL"
    yield "*ELASTIC"
    yield f"{to_border(law.youngs_modulus, 'stress'):.10g}, {law.poisson_ratio:.10g}"
    for index, width in enumerate(widths, start=1):
        yield f"*SOLID SECTION, ELSET=WIDTH-{index}, MATERIAL=MATERIAL"
        yield f"{share * to_border(float(width), 'length'):.10g}"
    held = [
        (f"{_word(group.name)}-{k}", group, number[group.nodes[used[group.nodes]]])
        for k, group in enumerate(groups, start=1)
        if used[group.nodes].any()
    ]
    for word, _, nodes in held:
        yield f"*NSET, NSET={word}"
        rows = nodes.tolist()
        yield from (", ".join(map(str, rows[k : k + ROW])) + "," for k in range(0, len(rows), ROW))
    spare, moves = int(number[-1]) + 1, []
    for word, group, _ in held:
        made = list(_rigid(word, group, travel, spare)) if _moves_freely(group) else None
        if made is None:
            ends = to_border(travel * group.driven[:2], "length").tolist()
            moves += [f"{word}, {k}, {k}, {end:.10g}" for k, end in enumerate(ends, start=1)]
        else:
            yield from (line for line in made if not line.startswith("="))
            moves += [line[1:] for line in made if line.startswith("=")]
            spare += 5
    yield f"*STEP, NLGEOM, INC={100 * poses}"
    yield "*STATIC"
    yield f"{1 / poses:.10g}, 1., 1e-6, {1 / poses:.10g}"
    yield "*BOUNDARY"
    yield from moves
    for word, _, _ in held:
        yield f"*NODE PRINT, NSET={word}, TOTALS=ONLY"
        yield "RF"
    yield "*NODE FILE"
    yield "U, RF"
    yield "*EL FILE"
    yield "S"
    yield "*END STEP"


def _word(name: str) -> str:
    """Return a name that every solver takes as that of a set."""
    return "".join(char if char.isalnum() or char == "-" else "-" for char in name.upper())[:60].strip("-") or "SET"


def _moves_freely(group: Group) -> bool:
    """Tell whether a group moves in a way that is not prescribed, or turns: then it is a rigid body."""
    return bool(group.free.shape[1] > 0 or group.driven[2] != 0)


def _rigid(word: str, group: Group, travel: float, spare: int) -> Iterator[str]:
    """Yield a rigid body with its guides; lines of prescribed motions begin with ``=``.

    Node `spare` is its centre, the next one turns with it, the others carry what is prescribed along a direction.
    """
    x, y = to_border(group.center, "length").tolist()
    yield "*NODE"
    yield from (f"{spare + k}, {x:.10g}, {y:.10g}, 0" for k in range(5))
    yield f"*RIGID BODY, NSET={word}, REF NODE={spare}, ROT NODE={spare + 1}"
    ways = _fixed(group.free)
    carriers = iter((spare + 2, spare + 3, spare + 4))
    yield f"={spare}, 3, 3, 0"
    yield f"={spare + 1}, 1, 2, 0"
    for way in ways:
        if abs(way[2]) > 0.5:
            yield f"={spare + 1}, 3, 3, {travel * float(way @ group.driven):.10g}"
            continue
        carrier = next(carriers)
        terms = [(spare, 1 + k, float(way[k])) for k in (0, 1) if abs(way[k]) > 1e-12]
        terms.sort(key=lambda term: -abs(term[2]))  # the first is eliminated: it must not vanish
        yield "*EQUATION"
        yield str(len(terms) + 1)
        yield ", ".join(f"{node}, {axis}, {factor:.12g}" for node, axis, factor in [*terms, (carrier, 1, -1.0)])
        yield f"={carrier}, 1, 1, {to_border(travel * float(way @ group.driven), 'length'):.10g}"
        yield f"={carrier}, 2, 3, 0"


def _fixed(free: FloatArray) -> list[FloatArray]:
    """Return unit motions (3,) that are prescribed: those across all free ones, turns apart from displacements."""
    found = []
    turn = np.array([0.0, 0.0, 1.0])
    if not np.any(np.abs(free[2]) > 0.5):
        found.append(turn)
    flat = free[:2, np.abs(free[2]) < 0.5]
    if flat.shape[1] == 0:
        found += [np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])]
    elif flat.shape[1] == 1:
        found.append(np.array([-flat[1, 0], flat[0, 0], 0.0]))
    return found
