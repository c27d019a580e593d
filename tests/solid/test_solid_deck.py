"""Decks of a finite-element solver: read back they are the mesh; CalculiX, where installed, finds the same force."""

from __future__ import annotations

import re
import shutil
import subprocess

import numpy as np
import pytest

import cfmkit
from cfmkit.elastica import Control, Displacement, trace
from cfmkit.errors import UsageError
from cfmkit.families import family

QUICK = ("analysis.solid.error=0.1", "analysis.solid.poses=8", "analysis.travel=0.8 mm", "analysis.fidelity=solid")


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
    assert sorted(files) == [
        "vcfm-leaf-as-beams.inp",
        "vcfm-leaf.inp",
        "vcfm-spring-as-beams.inp",
        "vcfm-spring.inp",
    ]
    leaf, _ = family("vcfm").elastic.solids(spec)
    problem = leaf.part.create_mesh().refine()[0].problem
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
    solids = family("vcfm").elastic.solids(spec)
    for name, solid, share_of_travel in zip(("leaf", "spring"), solids, (1.0, 0.5), strict=True):
        data = files[f"vcfm-{name}.inp"]
        (tmp_path / f"{name}.inp").write_bytes(data)
        subprocess.run(["ccx", "-i", name], cwd=tmp_path, check=True, capture_output=True, timeout=120)
        reported = (tmp_path / f"{name}.dat").read_text()
        share = float(re.search(rb"widths are (\S+) times", data)[1])
        force = re.findall(r"for set SHUTTLE-1 and time  0.1000000E\+01\s+(\S+)\s+(\S+)\s+(\S+)", reported)
        own = solid.part.create_mesh(1e-3).follow_stops([0.0, 0.4e-3 * share_of_travel, 0.8e-3 * share_of_travel])
        assert -float(force[0][1]) / share == pytest.approx(own.course.poses[-1].effort, rel=1e-3)


# --- the same parts as beams ---------------------------------------------------------------------------------------


def force_at_the_end(folder, data):
    """Return the reaction of the node DRIVE at the end of a deck that CalculiX has run [N]."""
    (folder / "beams.inp").write_bytes(data)
    subprocess.run(["ccx", "-i", "beams"], cwd=folder, check=True, capture_output=True, timeout=120)
    reported = (folder / "beams.dat").read_text()
    return float(re.findall(r"forces.*?set DRIVE and time  0.1000000E\+01\s+\d+\s+(\S+)", reported, re.S)[-1])


def test_a_deck_of_beams_read_back_is_the_network(made):
    spec, files = made
    read = blocks(files["vcfm-leaf-as-beams.inp"])
    about = spec.mechanism.bistable
    reach, rise = 1e3 * about.length * np.array([np.cos(about.angle), np.sin(about.angle)])
    nodes = {
        int(row[0]): np.array(row[1:]) for head, lines in read if head == "*NODE, NSET=ALL" for row in numbers(lines)
    }
    rows = [row for head, lines in read if head.startswith("*ELEMENT, TYPE=B32") for row in numbers(lines)]
    ends = {tuple(nodes[int(row[k])]) for row in rows for k in (1, 3)}
    assert (0.0, 0.0, 0.0) in ends
    assert any(end == pytest.approx((reach, rise, 0.0)) for end in ends)
    along = np.array([[nodes[int(row[k])] for k in (1, 2, 3)] for row in rows])
    assert np.hypot(*(along[:, 2] - along[:, 0]).T[:2]).sum() == pytest.approx(1e3 * about.length)
    assert along[:, 1] == pytest.approx(0.5 * (along[:, 0] + along[:, 2]))
    (section,) = (numbers(lines) for head, lines in read if head.startswith("*BEAM SECTION"))
    assert section == [[1e3 * about.width, 1e3 * about.thickness], [0, 0, 1]]
    assert [numbers(lines) for head, lines in read if head == "*ELASTIC"] == [[[1477.0, 0.0]]]
    moved = next(lines for head, lines in read if head == "*BOUNDARY")
    assert [line for line in moved if line.endswith("0.8")]


def test_links_of_a_deck_of_beams_are_stiff_and_every_set_that_is_used_is_there():
    spec = cfmkit.load("configs/slider_crank_lumped.yaml", ["analysis.travel=[0 mm, 2 mm]"])
    (deck,) = (data for name, data in cfmkit.export(spec, format="inp").items() if name.endswith("as-beams.inp"))
    read = blocks(deck)
    links = [numbers(lines)[0] for head, lines in read if head == "*ELEMENT, TYPE=B32, ELSET=LINKS"]
    assert len(links) == 2
    made = {word for head, _ in read for word in re.findall(r"(?:^\*ELEMENT.*ELSET|^\*NODE.*NSET)=([\w-]+)", head)}
    used = {
        word for head, _ in read for word in re.findall(r"(?:SECTION, ELSET|PRINT, NSET|SPRING, ELSET)=([\w-]+)", head)
    }
    assert used <= made
    heads = ("*NODE", "*NODE, NSET=ALL", "*NODE, NSET=DRIVE")
    nodes = {int(row[0]) for head, lines in read if head in heads for row in numbers(lines)}
    known = {int(word) for row in links for word in row[1:]}
    assert known <= nodes


TURNED = """
cfmkit: 1
family: beam
name: turned
mechanism:
  material: {youngs_modulus: 2 GPa, poisson_ratio: 0.35}
  thickness: 1 mm
  width: 5 mm
  nodes: {root: {at: [0 mm, 0 mm], support: clamped}, tip: {at: [30 mm, 4 mm], support: pinned}}
  beams: {leaf: {start: root, end: tip, shape: {kind: arc, sweep: 40 deg}}}
  drive: {kind: rotation, node: tip}
  part: {fillet: 0.5 mm}
analysis: {travel: 25 deg, points: 11, fidelity: reissner}
"""


def test_a_pinned_node_that_is_turned_is_led_by_a_lever_around_a_circle(tmp_path):
    path = tmp_path / "turned.yaml"
    path.write_text(TURNED, encoding="utf-8")
    data = cfmkit.export(path, format="inp")["beams-as-beams.inp"]
    text = data.decode()
    arm = float(re.search(r"torque is (\S+) mm", text)[1])
    found = [re.search(rf"NAME=ARC-{axis}\n((?:[^*].*\n)+)", text)[1].split("\n")[:-1] for axis in (1, 2)]
    ways = [np.array([line.split(",") for line in lines], float) for lines in found]
    shares = ways[0][:, 0]
    end = arm * np.exp(1j * shares * np.radians(25.0)) - arm
    assert ways[0][:, 1] == pytest.approx(end.real, abs=1e-8)
    assert ways[1][:, 1] == pytest.approx(end.imag, abs=1e-8)


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX is not installed")
def test_calculix_finds_the_torque_of_the_beams(tmp_path):
    path = tmp_path / "turned.yaml"
    path.write_text(TURNED, encoding="utf-8")
    data = cfmkit.export(path, format="inp")["beams-as-beams.inp"]
    force_at_the_end(tmp_path, data)
    reported = (tmp_path / "beams.dat").read_text()
    x, y = re.findall(r"forces.*?set DRIVE and time  0.1000000E\+01\s+\d+\s+(\S+)\s+(\S+)", reported, re.S)[-1]
    arm, angle = 1e-3 * float(re.search(rb"torque is (\S+) mm", data)[1]), np.radians(25.0)
    torque = arm * (float(y) * np.cos(angle) - float(x) * np.sin(angle))
    assert torque == pytest.approx(cfmkit.analyze(path).curve.effort[-1], rel=0.01)


def test_parts_that_are_turned_while_free_to_move_have_no_deck_of_beams(tmp_path):
    path = tmp_path / "turned.yaml"
    path.write_text(
        """
cfmkit: 1
family: beam
name: turned
mechanism:
  material: {youngs_modulus: 2 GPa, poisson_ratio: 0.35}
  thickness: 1 mm
  width: 5 mm
  nodes: {root: {at: [0 mm, 0 mm], support: clamped}, tip: {at: [30 mm, 0 mm]}}
  beams: {leaf: {start: root, end: tip}}
  drive: {kind: rotation, node: tip}
  part: {fillet: 0.5 mm}
analysis: {travel: 10 deg, points: 11, fidelity: solid, solid: {poses: 5, error: 0.1}}
""",
        encoding="utf-8",
    )
    assert sorted(cfmkit.export(path, format="inp")) == ["beams.inp"]


@pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX is not installed")
def test_calculix_finds_the_force_of_the_beams(made, tmp_path):
    """Its beams become bricks with rigid ends: within 1 % of the engine's stretching and shearing beams."""
    spec, files = made
    for name, network in zip(("leaf", "spring"), family(spec.family).elastic.beams(spec), strict=True):
        end = float(network.drive.points[-1])
        drive = Displacement(network.drive.node, network.drive.direction, np.linspace(0.0, end, 9)[1:])
        own = float(trace(network.network, drive, Control(branch="primary")).effort[-1])
        assert force_at_the_end(tmp_path, files[f"vcfm-{name}-as-beams.inp"]) == pytest.approx(own, rel=0.01)


def test_what_has_no_elastic_part_has_no_deck():
    with pytest.raises(UsageError, match="--format inp: a cam mechanism has no elastic part to be solved"):
        cfmkit.export("configs/cam.yaml", format="inp")


# --- supports that turn --------------------------------------------------------------------------------------------

FREE = """
cfmkit: 1
family: beam
name: strip
mechanism:
  material: {{youngs_modulus: 2.4 GPa, poisson_ratio: 0.35, law: {law}}}
  thickness: 2 mm
  width: 6 mm
  nodes:
    root: {{at: [0 mm, 0 mm], support: clamped}}
    tip: {{at: [24 mm, 0 mm]}}
  beams: {{beam: {{start: root, end: tip}}}}
  drive: {drive}
analysis:
  travel: {travel}
  fidelity: solid
  solid: {{poses: 5, error: 0.1}}
"""
PUSHED = {"drive": "{kind: displacement, node: tip, direction: -60 deg}", "travel": "5 mm"}
TWISTED = {"drive": "{kind: rotation, node: tip}", "travel": "-30 deg"}


def deck_of(tmp_path, law="st-venant-kirchhoff", **given):
    path = tmp_path / "strip.yaml"
    path.write_text(FREE.format(law=law, **given))
    spec = cfmkit.load(str(path))
    return spec, cfmkit.export(spec, format="inp")["beams.inp"]


def run_by_ccx(tmp_path, data):
    (tmp_path / "part.inp").write_bytes(data)
    subprocess.run(["ccx", "-i", "part"], cwd=tmp_path, check=True, capture_output=True, timeout=120)
    return (tmp_path / "part.dat").read_text(), float(re.search(rb"widths are (\S+) times", data)[1])


def test_an_end_that_turns_freely_is_joined_to_the_node_that_is_driven_by_stiff_triangles(tmp_path):
    _, data = deck_of(tmp_path, **PUSHED)
    read = blocks(data)
    assert not any("RIGID BODY" in head for head, _ in read)
    rows = [row for head, lines in read if head in ("*NODE", "*NODE, NSET=ALL") for row in numbers(lines)]
    places = {int(row[0]): np.array(row[1:3]) for row in rows}
    (hub,) = (np.array(numbers(lines), int) for head, lines in read if head.startswith("*ELEMENT, TYPE=CPS3"))
    a, b, c = (np.array([places[node] for node in hub[:, k]]) for k in (1, 2, 3))
    assert ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0] > 0).all()
    (center,) = (node for node in set(hub[:, 1:].ravel().tolist()) if np.hypot(*(places[node] - [24, 0])) < 1e-5)
    (guide,) = (lines for head, lines in read if head == "*EQUATION")
    carrier = int(numbers(guide)[1][6])
    assert {int(word) for word in numbers(guide)[1][0:6:3]} == {center}
    moved = next(lines for head, lines in read if head == "*BOUNDARY")
    assert abs(float(next(line for line in moved if line.startswith(f"{carrier}, 1")).split(",")[3])) == 5.0
    modulus = [numbers(lines)[0][0] for head, lines in read if head == "*ELASTIC"]
    assert modulus[1] == 1e3 * modulus[0]


def test_a_neo_hookean_part_has_that_law_in_its_deck(tmp_path):
    _, data = deck_of(tmp_path, law="neo-hookean", **PUSHED)
    (law,) = (numbers(lines)[0] for head, lines in blocks(data) if head == "*HYPERELASTIC, NEO HOOKE")
    shear, bulk = 2400 / 2.7, 2400 / (3 * 0.3)
    assert law == pytest.approx([0.5 * shear, 2 / bulk])


@pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX is not installed")
@pytest.mark.parametrize("law", ["st-venant-kirchhoff", pytest.param("neo-hookean", marks=pytest.mark.slow)])
def test_calculix_runs_the_deck_of_a_strip_whose_driven_end_is_free(tmp_path, law):
    spec, data = deck_of(tmp_path, law=law, **PUSHED)
    reported, share = run_by_ccx(tmp_path, data)
    x, y = map(float, re.findall(r"for set ROOT-1 and time  0.1000000E\+01\s+(\S+)\s+(\S+)", reported)[0])
    (one,) = family("beam").elastic.solids(spec)
    pose = one.part.create_mesh().refine()[0].follow_stops([0.0, 2.5e-3, 5e-3]).course.poses[-1]
    assert -(0.5 * x - np.sqrt(0.75) * y) / share == pytest.approx(pose.effort, rel=1e-3)


@pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX is not installed")
def test_calculix_finds_the_torque_on_an_end_that_is_turned_and_moves_freely(tmp_path):
    spec, data = deck_of(tmp_path, **TWISTED)
    reported, share = run_by_ccx(tmp_path, data)
    x, y, angle = map(float, re.search(r"\(x, y\) = \((\S+), (\S+)\) mm turned by (\S+) rad", data.decode()).groups())
    fx, fy = map(float, re.findall(r"-ARM and time  0.1000000E\+01\s+\d+\s+(\S+)\s+(\S+)", reported)[0])
    c, s = np.cos(angle), np.sin(angle)
    (one,) = family("beam").elastic.solids(spec)
    pose = one.part.create_mesh().refine()[0].follow_stops(np.linspace(0.0, one.stops[-1], 3).tolist()).course.poses[-1]
    torque = (x * c - y * s) * fy - (x * s + y * c) * fx
    assert 1e-3 * torque / share == pytest.approx(pose.effort, rel=1e-3)
