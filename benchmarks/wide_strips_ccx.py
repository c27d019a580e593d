"""Wide cantilevers in three dimensions against beams with and without `wide_beams`: CalculiX, 20-node bricks.

Run: python benchmarks/wide_strips_ccx.py (needs ccx). One half of the width is meshed; the root is held whole, the end
carries an even shear stress that keeps its direction. The displacement is the one that the stress does work on. Each
line: width over thickness, length over width, deflection over length, and by how much the beam deflects more than the
solid, in per cent: narrow, with `wide_beams` (what is left is the end that cannot curl), and with the root, too, as a
piece of its own that does not curl at all (plane strain): that is no key of the package but a beam in a file.
"""

from __future__ import annotations

import itertools
import subprocess
import sys
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from cfmkit.elastica import CLAMPED_SUPPORT, Beam, Control, Loading, Network, Node, PointLoad, Section, trace

YOUNG, POISSON, THICKNESS = 2000.0, 0.35, 1.0  # MPa, 1, mm
ACROSS, PER_WIDTH = 6, 12  # elements in half the width, and along a length of one width
FLAT = 0.3  # widths of the root that do not curl in the last column: small loads ask for 0.3 (b/t 3) to 0.38 (b/t 10)
LOADS = (0.02, 2.0)  # F L^2/EI: nearly linear, and a deflection of half the length


def bricks(length: float, width: float) -> tuple[Any, list[list[int]]]:
    """Return nodes (n, 3) [mm] and 20-node elements of half a strip, one through the thickness; graded to the root."""
    nx = max(24, int(PER_WIDTH * length / width))
    u = np.linspace(0.0, 1.0, 2 * nx + 1)
    x, y = length * u * (0.3 + 0.7 * u), np.linspace(0.0, 0.5 * width, 2 * ACROSS + 1)
    z = np.array([-0.5, 0.0, 0.5]) * THICKNESS
    number: dict[tuple[int, int, int], int] = {}
    nodes: list[tuple[float, float, float]] = []
    for i, j, k in itertools.product(range(len(x)), range(len(y)), range(3)):
        if (i % 2) + (j % 2) + (k % 2) <= 1:
            nodes.append((float(x[i]), float(y[j]), float(z[k])))
            number[i, j, k] = len(nodes)
    corners = ((0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (0, 0, 2), (2, 0, 2), (2, 2, 2), (0, 2, 2))
    edges = ((0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7))
    places = [*corners, *(tuple((a + b) // 2 for a, b in zip(corners[p], corners[q], strict=True)) for p, q in edges)]
    elements = [[number[2 * e + a, 2 * f + b, c] for a, b, c in places] for e in range(nx) for f in range(ACROSS)]
    return np.array(nodes), elements


def deflection(length: float, width: float, force: float) -> float:
    """Return the deflection of the solid under a force [mm]."""
    nodes, elements = bricks(length, width)
    end = np.flatnonzero(nodes[:, 0] > length * (1 - 1e-9))
    share = _shares(nodes[end])
    deck = ["*NODE, NSET=ALL", *(f"{n + 1}, {p[0]:.12g}, {p[1]:.12g}, {p[2]:.12g}" for n, p in enumerate(nodes))]
    deck.append("*ELEMENT, TYPE=C3D20, ELSET=E")
    for n, e in enumerate(elements):
        deck += [f"{n + 1}, {', '.join(map(str, e[:10]))},", ", ".join(map(str, e[10:]))]
    deck += ["*MATERIAL, NAME=M", "*ELASTIC", f"{YOUNG}, {POISSON}", "*SOLID SECTION, ELSET=E, MATERIAL=M"]
    for name, held in (("ROOT", nodes[:, 0] < 1e-9), ("MIDDLE", nodes[:, 1] < 1e-9), ("END", nodes[:, 0] == length)):
        deck += [f"*NSET, NSET={name}", *(f"{n + 1}," for n in np.flatnonzero(held))]
    deck += ["*BOUNDARY", "ROOT, 1, 3", "MIDDLE, 2, 2", "*STEP, NLGEOM, INC=200", "*STATIC", "0.25, 1., 1e-5, 0.25"]
    deck += ["*CLOAD", *(f"{n + 1}, 3, {0.5 * force * w:.12g}" for n, w in zip(end, share, strict=True))]
    deck += ["*NODE PRINT, NSET=END, FREQUENCY=1000", "U", "*END STEP"]
    with tempfile.TemporaryDirectory() as room:
        (Path(room) / "strip.inp").write_text("\n".join(deck) + "\n")
        done = subprocess.run(["ccx", "strip"], cwd=room, capture_output=True, text=True, check=False)
        rows = (Path(room) / "strip.dat").read_text().split("\n")
    values = [row.split() for row in rows if len(row.split()) == 4 and row.split()[0].isdigit()]
    if len(values) < len(end):
        sys.exit(done.stdout[-2000:])
    moved = {int(row[0]): float(row[3]) for row in values[-len(end) :]}
    return float(sum(w * moved[n + 1] for n, w in zip(end, share, strict=True)))


def _shares(face: Any) -> Any:
    """Return the shares of an even stress on the nodes of the end face: 8-node sides, each with -1/12 and 1/3."""
    share = np.zeros(len(face))
    step = np.unique(face[:, 1])[::2]
    for low, high in itertools.pairwise(step):
        inside = (face[:, 1] > low - 1e-9) & (face[:, 1] < high + 1e-9)
        middle = np.isclose(face[:, 1], 0.5 * (low + high)) | np.isclose(face[:, 2], 0.0)
        share[inside & ~middle] += -1 / 12 / ACROSS
        share[inside & middle] += 1 / 3 / ACROSS
    return share


def beam(length: float, width: float, force: float, wide: bool, flat: float = 0.0) -> float:
    """Return the deflection of a beam that stretches and shears, the first `flat` widths in plane strain [mm]."""
    mm = 1e-3
    section = Section(YOUNG * 1e6, width * mm, THICKNESS * mm, shear=True, poisson_ratio=POISSON, wide=wide)
    nodes = {"root": Node(0, 0, CLAMPED_SUPPORT), "end": Node(length * mm, 0)}
    beams = {"strip": Beam("root", "end", section)}
    if flat:
        stiff = replace(section, youngs_modulus=section.youngs_modulus / (1 - POISSON**2), wide=False)
        nodes["flat"] = Node(flat * width * mm, 0)
        beams = {"root": Beam("root", "flat", stiff), "strip": Beam("flat", "end", section)}
    path = trace(
        Network(nodes, beams),
        Loading((PointLoad("end", 0.0, 1.0, 0.0),), np.array([force])),
        Control(tolerance=1e-7),
    )
    return float(path.motion("end")[-1, 1]) / mm


def main() -> None:
    print("b/t   L/b   deflection/L   narrow   wide_beams   and a flat root")
    for ratio, slender in itertools.product((3, 6, 10), (2, 4, 8)):
        width, length = ratio * THICKNESS, slender * ratio * THICKNESS
        rigidity = YOUNG * width * THICKNESS**3 / 12
        for load in LOADS:
            force = load * rigidity / length**2
            solid = deflection(length, width, force)
            kinds = ((False, 0.0), (True, 0.0), (True, FLAT))
            off = [100 * (beam(length, width, force, *kind) / solid - 1) for kind in kinds]
            reported = "".join(f"{one:+10.2f}" for one in off)
            print(f"{ratio:3d} {slender:5d} {solid / length:12.4f} {reported} %", flush=True)


if __name__ == "__main__":
    main()
