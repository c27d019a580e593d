"""Solids by cfmkit and by CalculiX, on the same meshes: `python benchmarks/solid_ccx.py [SPEC ...]`.

Needs ``ccx`` (Debian: calculix-ccx). Every deck of `cfmkit export --format inp` is run to its end; its largest reaction
is set beside the force that cfmkit finds for the same part, mesh and travel. CalculiX stays on the form that Newton's
method leads to, cfmkit on the stable branch: compare parts before they buckle.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

import cfmkit
from cfmkit.families import family

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
        told = (Path(folder) / "part.dat").read_text()
    ends = re.findall(r"for set \S+ and time  0.1000000E\+01\s+(\S+)\s+(\S+)\s+\S+", told)
    return max(np.hypot(float(x), float(y)) for x, y in ends) / share, took


def by_cfmkit(spec: cfmkit.Spec) -> list[float]:
    """Return the same of every part of a specification, in the order of its decks."""
    found = []
    for one in family(spec.family).driven_parts(spec):
        solved = one.part.meshed(one.size).followed(np.linspace(0.0, one.stops[-1], len(one.stops)).tolist())
        supports, pose = solved.problem.supports, solved.course.poses[-1]
        forces = solved.problem.elements.forces(solved.moved(pose))
        found.append(float(np.hypot(*supports.reactions(pose.unknowns, pose.travel, forces)[:, :2].T).max()))
    return found


def main(names: list[str]) -> None:
    """Print a line per part."""
    if shutil.which("ccx") is None:
        sys.exit("ccx is not installed (Debian: calculix-ccx)")
    print("| part | ccx [N] | cfmkit [N] | difference | ccx [s] |\n|---|---|---|---|---|")
    for name, changes in ({one: [] for one in names} or SPECS).items():
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
