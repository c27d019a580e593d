"""What the difference of two meshes of a part says of the finer one's error: `python benchmarks/solid_mesh_error.py`.

Parts of all families are solved on the two meshes of every analysis, and on a third of `FINEST` times the finer one's
size, which stands for the truth. Errors over differences, part by part, give the factors of `cfmkit.solid.two_meshes`:
those below which 95 % of them are. ``--write`` puts the table into docs/solid.md. It takes a
quarter of an hour of processor time.
"""

from __future__ import annotations

import argparse
import dataclasses
import math
import re
from pathlib import Path

import numpy as np

import cfmkit
from cfmkit.families import family
from cfmkit.solid.meshed_part import COARSER
from cfmkit.solid.two_meshes import FORCE_LEAST, STRESS_LEAST

FINEST = 0.5
"""Side of the reference's elements, in those of the finer mesh: errors of second order or better are a quarter."""
POSES = 4
"""Of each part: they count alike, and the worst of them is taken."""
SHARE = 0.95
MARKS = "<!-- table of benchmarks/solid_mesh_error.py -->"

WIDE = ["mechanism.part.fillet=1 mm"]
PARTS = (
    ("vcfm_ding2022", []),
    ("vcfm_ding2022", WIDE),
    ("vcfm_ding2022", ["mechanism.part.fillet=0.2 mm"]),
    ("vcfm_cosine leaf", []),
    ("vcfm_hybrid leaf", []),
    ("vcfm_u_shape spring", []),
    ("vcfm_folded spring", []),
    ("vcfm_straight spring", []),
    ("vcfm_titanium", []),
    ("make_finger", []),
    ("slider_crank_strip", []),
    ("slider_crank_strip", WIDE),
    ("slider_crank_tapered", []),
    ("slider_crank_lumped", []),
    ("slider_crank_lumped", ["mechanism.part.fillet=0.2 mm"]),
    ("make_pom_strip", []),
    ("beam_lan2010", []),
    ("beam_lan2010", WIDE),
    ("beam_lan2010", ["mechanism.part.fillet=0.25 mm"]),
    ("beam_lan2010_thin", []),
    ("beam_lan2010_subcfm", []),
    ("beam_design_arch", []),
    ("beam_williams_toggle", []),
)
"""Specifications, where a word names one of their two parts that part alone, and changes; 28 parts that all differ."""


@dataclasses.dataclass(frozen=True)
class Row:
    """A part: what its two meshes differ by, and errors of the finer one; force and stress, in parts of the largest."""

    name: str
    differences: tuple[float, float]
    errors: tuple[float, float]


def rows(name: str, changes: list[str]) -> list[Row]:
    """Return what a specification's parts give."""
    config, _, only = name.partition(" ")
    keys = ["analysis.fidelity=solid", f"analysis.solid.poses={POSES}", *changes]
    spec = cfmkit.load(f"configs/{config}.yaml", keys)
    found = []
    for one in family(spec.family).driven_parts(spec):
        if only not in one.name:
            continue
        stops = one.stops
        meshes = [one.part.meshed(share * one.size).followed(stops) for share in (COARSER, 1.0, FINEST)]
        if min(len(solved.course.poses) for solved in meshes) < 3:
            continue
        reported = " ".join(change.partition("=")[2] for change in changes)
        label = " ".join(
            filter(None, (config, one.name.removeprefix("vcfm-") if "vcfm-" in one.name else "", reported))
        )
        coarse, fine, finest = meshes
        found.append(Row(label, fine.differences(coarse), finest.differences(fine)))
    return found


def ratios(row: Row) -> tuple[float, float]:
    """Return the errors in differences, which count as `FORCE_LEAST` and `STRESS_LEAST` at least."""
    force, stress = row.differences
    return row.errors[0] / max(force, FORCE_LEAST), row.errors[1] / max(stress, STRESS_LEAST)


def factor(found: list[Row], which: int) -> float:
    """Return the factor below which `SHARE` of errors over differences are, rounded upwards to a tenth.

    The reference has an error of its own, of second order in its size: ratios are larger by that.
    """
    shares = np.array([ratios(row)[which] for row in found]) / (1.0 - FINEST**2)
    return math.ceil(10 * float(np.quantile(shares, SHARE, method="inverted_cdf"))) / 10


def table(found: list[Row]) -> str:
    """Return all parts and the factors, as Markdown."""
    head = "| part | force: difference | error | ratio | stress: difference | error | ratio |\n" + "|---" * 7 + "|\n"
    lines = []
    for row in found:
        cells = []
        for difference, error, ratio in zip(row.differences, row.errors, ratios(row), strict=True):
            cells += [f"{difference:.1e}", f"{error:.1e}", f"{ratio:.2f}"]
        lines.append(f"| `{row.name}` | {' | '.join(cells)} |")
    force, stress = factor(found, 0), factor(found, 1)
    reported = (
        f"{len(found)} parts: 95 % of the ratios, times 4/3 for the reference's own error, are below {force} (force) "
        f"and {stress} (stress)."
    )
    return head + "\n".join(lines) + f"\n\n{reported}\n"


def main() -> None:
    """Print the table, and write it where that is wished."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--write", action="store_true", help="into docs/solid.md")
    parser.add_argument("--only", default="", help="specifications whose name has this in it")
    wanted = parser.parse_args()
    found: list[Row] = []
    for name, changes in PARTS:
        if wanted.only not in name:
            continue
        for row in rows(name, changes):
            print(row, flush=True)
            found.append(row)
    made = table(found)
    print(made)
    if wanted.write:
        page = Path("docs/solid.md")
        text = page.read_text(encoding="utf-8")
        mark = re.escape(MARKS)
        page.write_text(
            re.sub(f"{mark}.*?{mark}", lambda _: f"{MARKS}\n{made}{MARKS}", text, flags=re.S), encoding="utf-8"
        )


if __name__ == "__main__":
    main()
