"""Each command that a warning prints is pasted and run: it is complete, and the warning is gone."""

import itertools
import json
import shlex
from pathlib import Path

import pytest

from cfmkit.cli.main import main

CONFIGS = Path(__file__).parents[2] / "configs"

STRUT = """\
cfmkit: 1
family: beam
name: strut
mechanism:
  material: {youngs_modulus: 2300 MPa}
  thickness: 1 mm
  width: 5 mm
  nodes:
    a: {at: [0 mm, 0 mm], support: clamped}
    b: {at: [50 mm, 0 mm], support: guided, direction: 0 deg}
  beams: {s: {start: a, end: b}}
  drive: {kind: displacement, node: b, direction: 180 deg}
analysis: {travel: 0.5 mm, points: 5}
"""
LEAF = """\
cfmkit: 1
family: beam
name: leaf
mechanism:
  material: {youngs_modulus: 200 GPa, density: 7800 kg/m^3}
  thickness: 0.1 mm
  width: 10 mm
  nodes:
    a: {at: [0 mm, 0 mm], support: clamped}
    b: {at: [20 mm, 0 mm]}
  beams: {s: {start: a, end: b}}
  drive: {kind: displacement, node: b, direction: 90 deg}
analysis: {travel: 5 mm, points: 21}
"""
LAN, STRIP = str(CONFIGS / "beam_lan2010.yaml"), str(CONFIGS / "slider_crank_strip.yaml")
VCFM, CAM = str(CONFIGS / "vcfm_ding2022.yaml"), str(CONFIGS / "cam.yaml")

WARNED = {
    "rigid": ("ends_early", "analyze", "strut.yaml"),
    "wide network": ("wide_beam", "analyze", "leaf.yaml", "--set", "analysis.points=11"),
    "wide network with frequencies": ("wide_beam", "analyze", "leaf.yaml", "--set", "analysis.modes=1"),
    "wide leaves": ("wide_beam", "analyze", VCFM, "--set", "mechanism.bistable.width=60 mm"),
    "wide leaves by an option": (
        "wide_beam",
        "analyze",
        VCFM,
        *("--set", "mechanism.bistable.width=60 mm", "--fidelity", "exact"),
    ),
    "wide strip": ("wide_beam", "analyze", STRIP, "--set", "mechanism.beam.width=60 mm"),
    "side force": ("side_force", "analyze", STRIP),
    "overstressed strip": ("overstressed", "analyze", STRIP, "--set", "mechanism.material.yield_strength=30 MPa"),
    "truss law": ("truss_law", "analyze", VCFM, "--set", "analysis.fidelity=truss"),
    "turning shuttle": ("asymmetric_buckling", "analyze", VCFM, "--set", "mechanism.bistable.guided=false"),
    "steep leaves": ("theory_range", "analyze", VCFM, "--set", "mechanism.bistable.angle=30 deg"),
    "not flat": ("not_flat", "analyze", VCFM, "--set", "analysis.window=[0.2 mm, 5 mm]"),
    "undercut": ("undercut", "design", CAM, "--set", "mechanism.roller_radius=20 mm"),
    "prestressed": ("closure_prestress", "analyze", LAN, "--set", "mechanism.closure=raw"),
}


FAST = ("rigid", "wide network", "wide network with frequencies", "truss law")
EVERY = [pytest.param(name, marks=[] if name in FAST else pytest.mark.slow) for name in WARNED]


def run(capsys, *words):
    """Return exit code, page and warnings of a command."""
    code = main([*words, "-o", "out", "--no-plots"])
    found = json.loads(Path("out/metrics.json").read_text(encoding="utf-8"))
    return code, capsys.readouterr().out, [item["name"] for item in found["warnings"]]


def commands_below(page, warning):
    """Return the commands that a page prints below a warning."""
    lines = page.splitlines()
    start = next(k for k, line in enumerate(lines) if line.startswith(f"warning  {warning}:"))
    rest = itertools.takewhile(lambda line: line.startswith(" "), lines[start + 1 :])
    return [line.strip() for line in rest if line.strip().startswith("cfmkit ")]


@pytest.mark.parametrize("name", EVERY)
def test_the_command_that_a_warning_prints_cures_it(name, tmp_path, monkeypatch, capsys):
    """That of `wide_beam` left out the fidelity that the run was given by an option, and was refused."""
    warning, *words = WARNED[name]
    monkeypatch.chdir(tmp_path)
    Path("strut.yaml").write_text(STRUT, encoding="utf-8")
    Path("leaf.yaml").write_text(LEAF, encoding="utf-8")
    _, page, before = run(capsys, *words)
    assert warning in before
    commands = commands_below(page, warning)
    assert commands
    for command in commands:
        code, _, after = run(capsys, *shlex.split(command)[1:])
        assert code in (0, 5, 6), command
        assert warning not in after, command
