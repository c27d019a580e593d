"""Solids by cfmkit and by CalculiX, on the same meshes: `python benchmarks/solid_ccx.py [--3d] [SPEC ...]`.

Needs ``ccx`` (Debian: calculix-ccx). Every deck of `cfmkit export --format inp` is run to its end; its largest reaction
is set beside the force that cfmkit finds for the same part, mesh and travel. CalculiX stays on the form that Newton's
method leads to, cfmkit on the stable branch: compare parts before they buckle.

With ``--3d`` the coarser mesh is extruded over half the width to 15-node wedges: what plane stress leaves out.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

import cfmkit
from cfmkit.families import family

if TYPE_CHECKING:
    from cfmkit.solid.adaptive_solution import DrivenPart
    from cfmkit.solid.meshed_part import Meshed

SPECS = {
    "configs/vcfm_u_shape.yaml": ["analysis.travel=0.8 mm"],
    "configs/vcfm_ding2022.yaml": ["analysis.travel=0.8 mm", "analysis.preloads=[0 mm]"],
    "configs/slider_crank_tapered.yaml": ["analysis.travel=[0 mm, 4 mm]"],
    "configs/beam_lan2010.yaml": ["analysis.travel=2 mm"],
}
"""Travels end before a leaf buckles; specifications that cannot be solids are named and left out."""


def by_ccx(data: bytes) -> tuple[float, float]:
    """Return the largest total reaction of a set at the end [N], and the processor time [s]."""
    share = float(re.search(rb"widths are (\S+) times", data)[1])  # type: ignore[index]
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "part.inp").write_bytes(data)
        begun = time.perf_counter()
        subprocess.run(["ccx", "-i", "part"], cwd=folder, check=True, capture_output=True)
        took = time.perf_counter() - begun
        reported = (Path(folder) / "part.dat").read_text()
    ends = re.findall(r"for set \S+ and time  0.1000000E\+01\s+(\S+)\s+(\S+)\s+\S+", reported)
    return max(np.hypot(float(x), float(y)) for x, y in ends) / share, took


def by_cfmkit(spec: cfmkit.Spec) -> list[float]:
    """Return the same of every part of a specification, in the order of its decks."""
    return [reaction(one, one.part.create_mesh().refine()[0]) for one in family(spec.family).elastic.solids(spec)]


LAYERS, GRADED = 3, 1.5
"""Wedges over half the width, thinner towards the free side."""
FIRST = "0.005, 1., 1e-6, 0.1"
"""First increment, the travel, smallest and largest increment. A straight strip bows at once: in one step of a fiftieth
of the travel, `slider_crank_tapered` came to another form."""


def extruded(one: DrivenPart) -> bytes:
    """Return a deck of the part in three dimensions, one half of its width, moved as in the plane."""
    meshed = one.part.create_mesh()
    grid, widths = meshed.problem.elements.mesh, meshed.problem.elements.width
    if np.ptp(widths) > 0:
        raise ValueError("several widths")
    width = 0.5e3 * float(widths.max())
    heights = width * (1 - (1 - np.linspace(0.0, 1.0, 2 * LAYERS + 1)) ** GRADED)
    corners = np.unique(grid.triangles[:, :3])
    used = np.unique(grid.triangles)
    number: dict[tuple[int, int], int] = {}
    lines = ["*NODE, NSET=ALL"]
    for layer, z in enumerate(heights.tolist()):
        for k in (used if layer % 2 == 0 else corners).tolist():
            number[k, layer] = len(number) + 1
            x, y = (1e3 * grid.nodes[k]).tolist()
            lines.append(f"{number[k, layer]}, {x:.10g}, {y:.10g}, {z:.10g}")
    lines.append("*ELEMENT, TYPE=C3D15, ELSET=PART")
    wedges = [(row, 2 * layer) for layer in range(LAYERS) for row in grid.triangles.tolist()]
    for count, (row, low) in enumerate(wedges, start=1):
        places = [(k, at) for part in (row[:3], row[3:]) for at in (low, low + 2) for k in part]
        places += [(k, low + 1) for k in row[:3]]
        words = [str(number[place]) for place in places]
        lines += [f"{count}, {', '.join(words[:10])},", ", ".join(words[10:])]
    law = one.part.law
    lines += ["*MATERIAL, NAME=M", "*ELASTIC", f"{1e-6 * law.youngs_modulus:.10g}, {law.poisson_ratio:.10g}"]
    lines += ["*SOLID SECTION, ELSET=PART, MATERIAL=M", "*NSET, NSET=MIDDLE"]
    lines += [f"{place}," for (_, layer), place in number.items() if layer == 0]
    moves = ["MIDDLE, 3, 3, 0"]
    prints: list[str] = []
    for group in meshed.problem.supports.groups:
        if group.free.shape[1]:
            raise ValueError(f"{group.name} moves freely")
        held, word = set(group.nodes.tolist()), f"G{len(prints)}"
        lines += [f"*NSET, NSET={word}", *(f"{place}," for (k, _), place in number.items() if k in held)]
        moves += [f"{word}, {k + 1}, {k + 1}, {1e3 * one.stops[-1] * group.driven[k]:.10g}" for k in (0, 1)]
        prints += [f"*NODE PRINT, NSET={word}, TOTALS=ONLY", "RF"]
    lines += ["** widths are 0.5 times those of the part", "*STEP, NLGEOM, INC=100", "*STATIC", FIRST]
    return "\n".join([*lines, "*BOUNDARY", *moves, *prints, "*END STEP", ""]).encode("ascii")


def in_three_dimensions(names: list[str]) -> None:
    """Print a line per part: in three dimensions, and in plane stress."""
    print("| part | width over thickness | ccx, 3D [N] | cfmkit, plane stress [N] | 3D over plane stress | ccx [s] |")
    print("|---|---|---|---|---|---|")
    for name, changes in ({one: SPECS.get(one, []) for one in names} or SPECS).items():
        spec = cfmkit.load(name, ["analysis.fidelity=solid", *changes])
        for one in family(spec.family).elastic.solids(spec):
            own = reaction(one, one.part.create_mesh())
            try:
                other, took = by_ccx(extruded(one))
            except (ValueError, subprocess.CalledProcessError) as error:
                print(f"| {Path(name).stem} {one.name} | {str(error)[:60]} | | | | |")
                continue
            wide = one.part.width / one.part.thinnest
            reported = f"{other:.4f} | {own:.4f} | {100 * (other / own - 1):+.1f} % | {took:.1f}"
            print(f"| {Path(name).stem} {one.name} | {wide:.3g} | {reported} |", flush=True)


def reaction(one: DrivenPart, meshed: Meshed) -> float:
    """Return the largest reaction of a part at the end of its travel by cfmkit [N]."""
    solved = meshed.follow_stops(np.linspace(0.0, one.stops[-1], len(one.stops)).tolist())
    supports, pose = solved.problem.supports, solved.course.poses[-1]
    forces = solved.problem.elements.forces(solved.evaluate_displacements(pose))
    return float(np.hypot(*supports.reactions(pose.unknowns, pose.travel, forces)[:, :2].T).max())


def main(names: list[str]) -> None:
    """Print a line per part."""
    if shutil.which("ccx") is None:
        sys.exit("ccx is not installed (Debian: calculix-ccx)")
    if "--3d" in names:
        in_three_dimensions([name for name in names if name != "--3d"])
        return
    print("| part | ccx [N] | cfmkit [N] | difference | ccx [s] |\n|---|---|---|---|---|")
    for name, changes in ({one: SPECS.get(one, []) for one in names} or SPECS).items():
        try:
            spec = cfmkit.load(name, ["analysis.fidelity=solid", *changes])
            files = cfmkit.export(spec, format="inp")
        except cfmkit.CfmError as error:
            print(f"| {Path(name).stem} | {str(error)[:80]} | | | |")
            continue
        meshed = {file: data for file, data in files.items() if not file.endswith("-as-beams.inp")}
        for (file, data), own in zip(meshed.items(), by_cfmkit(spec), strict=True):
            other, took = by_ccx(data)
            print(f"| {Path(name).stem} {file} | {other:.5f} | {own:.5f} | {own / other - 1:+.1e} | {took:.1f} |")


if __name__ == "__main__":
    main(sys.argv[1:])
