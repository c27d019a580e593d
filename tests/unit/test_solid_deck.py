"""Decks of a finite-element solver: read back they are the mesh; CalculiX, where installed, finds the same force."""

from __future__ import annotations

import re
import shutil
import subprocess

import numpy as np
import pytest

import cfmkit
from cfmkit.errors import UsageError
from cfmkit.families.vcfm.outline import solved_leaf, solved_spring
from cfmkit.families.vcfm.solid import part_of

QUICK = ("analysis.solid.mesh=1 mm", "analysis.solid.poses=8", "analysis.travel=0.8 mm", "analysis.fidelity=solid")


def blocks(data):
    """Return the keyword lines of a deck, each with the lines below it."""
    found = []
    for line in data.decode("ascii").splitlines():
        if line.startswith("**"):
            continue
        if line.startswith("*"):
            found.append((line, []))
        else:
            found[-1][1].append(line)
    return found


def numbers(lines):
    return [[float(word) for word in line.split(",") if word.strip()] for line in lines]


@pytest.fixture(scope="module")
def made():
    spec = cfmkit.load("configs/vcfm_ding2022.yaml", [*QUICK, "analysis.preloads=[0 mm]"])
    return spec, cfmkit.export(spec, format="inp")


def test_a_deck_read_back_is_the_mesh_that_is_solved(made):
    spec, files = made
    assert sorted(files) == ["vcfm-leaf.inp", "vcfm-spring.inp"]
    problem = part_of(spec, solved_leaf(spec)).meshed(1e-3).problem
    read = blocks(files["vcfm-leaf.inp"])
    nodes = np.array(numbers(next(lines for head, lines in read if head.startswith("*NODE, NSET=ALL"))))
    rows = np.array(numbers(next(lines for head, lines in read if head.startswith("*ELEMENT")))).astype(int)
    place = {int(row[0]): row[1:3] for row in nodes}
    corners = np.array([[place[node] for node in row[1:]] for row in rows])
    grid = problem.elements.mesh
    assert corners == pytest.approx(1e3 * grid.nodes[grid.triangles], abs=1e-8)
    law = next(lines for head, lines in read if head.startswith("*ELASTIC"))
    assert numbers(law) == [[1477.0, 0.3]]


def test_its_supports_are_those_of_the_part(made):
    _, files = made
    read = dict(blocks(files["vcfm-leaf.inp"]))
    moved = {tuple(line.split(", ")[:2]): float(line.split(", ")[3]) for line in read["*BOUNDARY"]}
    assert moved == {("SHUTTLE-1", "1"): 0, ("SHUTTLE-1", "2"): -0.8, ("WALL-1-2", "1"): 0, ("WALL-1-2", "2"): 0}
    heads = [head for head, _ in blocks(files["vcfm-spring.inp"])]
    assert any(head.startswith("*RIGID BODY, NSET=WALL-1-2") for head in heads)  # the corner glides
    assert "*EQUATION" in heads


def test_the_width_is_so_small_that_elements_are_in_plane_stress(made):
    _, files = made
    for data, thin, width in ((files["vcfm-leaf.inp"], 1.0, 6.0), (files["vcfm-spring.inp"], 1.5, 10.0)):
        share = float(re.search(rb"widths are (\S+) times those of the part", data)[1])
        (section,) = (lines for head, lines in blocks(data) if head.startswith("*SOLID SECTION"))
        assert float(section[0]) == pytest.approx(share * width)
        assert float(section[0]) <= 0.1001 * thin


@pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX is not installed")
def test_calculix_finds_the_same_force(made, tmp_path):
    spec, files = made
    for name, piece, share_of_travel in (("leaf", solved_leaf(spec), 1.0), ("spring", solved_spring(spec), 0.5)):
        data = files[f"vcfm-{name}.inp"]
        (tmp_path / f"{name}.inp").write_bytes(data)
        subprocess.run(["ccx", "-i", name], cwd=tmp_path, check=True, capture_output=True, timeout=120)
        told = (tmp_path / f"{name}.dat").read_text()
        share = float(re.search(rb"widths are (\S+) times", data)[1])
        force = re.findall(r"for set SHUTTLE-1 and time  0.1000000E\+01\s+(\S+)\s+(\S+)\s+(\S+)", told)
        own = part_of(spec, piece).meshed(1e-3).followed([0.0, 0.4e-3 * share_of_travel, 0.8e-3 * share_of_travel])
        assert -float(force[0][1]) / share == pytest.approx(own.course.poses[-1].effort, rel=1e-3)


def test_what_has_no_elastic_part_has_no_deck():
    with pytest.raises(UsageError, match="--format inp: a cam mechanism has no elastic part to be solved"):
        cfmkit.export("configs/cam.yaml", format="inp")
