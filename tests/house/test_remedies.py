"""Each command that a warning prints is pasted and run: it is complete, and the warning is gone."""

import ast
import itertools
import json
import re
import shlex
from collections import Counter
from functools import cache
from pathlib import Path

import pytest
from beam_support import TOGGLE
from sources import PACKAGE, nodes
from vee_leaf import VEE

from cfmkit.cli import run_command

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
  drive: {kind: displacement, node: b, direction: 0 deg}
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
BOW = """\
cfmkit: 1
family: beam
name: bow
mechanism:
  material: {youngs_modulus: 2 GPa}
  thickness: 1 mm
  width: 10 mm
  nodes:
    a: {at: [0 mm, 0 mm], support: clamped}
    b: {at: [30 mm, 0 mm], support: guided, direction: 0 deg}
  beams: {bow: {start: a, end: b, shape: {kind: arc, sweep: 60 deg}}}
  drive: {kind: displacement, node: b, direction: 0 deg}
analysis: {travel: 3 mm, points: 21, fidelity: inextensible}
"""
RESCALED = TOGGLE + "design: {rescale: {width: 12 mm}}\nanalysis: {travel: 8.5 mm, points: 21}\n"
COARSE = ("--set", "analysis.solid.error=0.1")
SOLID = ("--set", "analysis.fidelity=solid", *COARSE)
SPECS = {
    "strut.yaml": STRUT,
    "leaf.yaml": LEAF,
    "bow.yaml": BOW,
    "rescaled.yaml": RESCALED,
    "vee.yaml": VEE.replace("0.05 mm", "1e-6 mm"),
    "effector.yaml": re.sub(
        "profile: {.*}",
        "profile: {kind: file, file: heights.csv}",
        (CONFIGS / "beam_end_effector.yaml").read_text(encoding="utf-8"),
    ),
    "heights.csv": "x [mm],y [mm]\n" + "".join(f"{x},0\n" for x in (0, 1, 2, 3, 4, 8, 9, 10, 11, 12)),
}

CAM, MOVING = str(CONFIGS / "cam.yaml"), str(CONFIGS / "cam_dynamics.yaml")
CRANK, SPRUNG = str(CONFIGS / "slider_crank_bilancia2019.yaml"), str(CONFIGS / "slider_crank_bought.yaml")
LAN, STRIP = str(CONFIGS / "beam_lan2010.yaml"), str(CONFIGS / "slider_crank_strip.yaml")
VCFM, HELICAL = str(CONFIGS / "vcfm_ding2022.yaml"), str(CONFIGS / "vcfm_bought_springs.yaml")


def changed(*changes: str) -> tuple[str, ...]:
    """Return changes of a specification as options."""
    return tuple(word for change in changes for word in ("--set", change))


WARNED = {
    "rigid": ("beam", "ends_early", "analyze", "strut.yaml"),
    "taut": ("beam", "ends_early", "analyze", "bow.yaml"),
    "wide network": ("beam", "wide_beam", "analyze", "leaf.yaml", *changed("analysis.points=11")),
    "wide network with frequencies": ("beam", "wide_beam", "analyze", "leaf.yaml", *changed("analysis.modes=1")),
    "prestressed": ("beam", "closure_prestress", "analyze", LAN, *changed("mechanism.closure=raw")),
    "sharp network": ("beam", "sharp_corners", "analyze", "vee.yaml", *changed("analysis.travel=1 mm"), *COARSE),
    "overstressed rescaled": ("beam", "rescale_stress", "design", "rescaled.yaml"),
    "hole in a surface": ("beam", "surface_hole", "analyze", "effector.yaml"),
    "objective of the paper": (
        *("beam", "objective_ill_posed", "design", str(CONFIGS / "beam_design_lan.yaml")),
        *("--fidelity", "inextensible"),
        *changed("design.optimise.objective=paper", "design.optimise.compare=[8.8 mm, 4 mm]"),
        *changed("design.optimise.starts=2", "design.optimise.widened=1", "design.optimise.orders=[1]"),
    ),
    "wide leaves": ("vcfm", "wide_beam", "analyze", VCFM, *changed("mechanism.bistable.width=60 mm")),
    "wide leaves by an option": (
        *("vcfm", "wide_beam", "analyze", VCFM, *changed("mechanism.bistable.width=60 mm")),
        *("--fidelity", "exact"),
    ),
    "truss law": ("vcfm", "truss_law", "analyze", VCFM, *changed("analysis.fidelity=truss")),
    "turning shuttle": ("vcfm", "asymmetric_buckling", "analyze", VCFM, *changed("mechanism.bistable.guided=false")),
    "hybrid leaves": (
        *("vcfm", "theory_range", "analyze", VCFM),
        *changed("mechanism.bistable.structure=hybrid", "mechanism.bistable.flexure_length=5 mm"),
        *changed("mechanism.bistable.thickness=0.8 mm", "analysis.points=61", "analysis.fidelity=analytic"),
    ),
    "thick leaves": ("vcfm", "theory_range", "analyze", VCFM, *changed("mechanism.bistable.thickness=4 mm")),
    "steep leaves": ("vcfm", "theory_range", "analyze", VCFM, *changed("mechanism.bistable.angle=30 deg")),
    "far travel": ("vcfm", "theory_range", "analyze", VCFM, *changed("analysis.travel=7.2 mm")),
    "steep spring": ("vcfm", "theory_range", "analyze", VCFM, *changed("mechanism.positive.angle=20 deg")),
    "not flat": ("vcfm", "not_flat", "analyze", VCFM, *changed("analysis.window=[0.2 mm, 5 mm]")),
    "closed spring": ("vcfm", "spring_closed", "analyze", VCFM, *changed("mechanism.frame.corner=1 mm")),
    "closed turns": ("vcfm", "spring_closed", "analyze", HELICAL, *changed("mechanism.springs.free_length=14 mm")),
    "snapping leaves": (
        *("vcfm", "unstable_branch", "analyze", VCFM),
        *changed("analysis.fidelity=exact", "analysis.branch=primary", "analysis.travel=4 mm"),
    ),
    "slender springs": (
        *("vcfm", "spring_buckles", "analyze", HELICAL),
        *changed("mechanism.springs.seats=pivoted-pivoted", "mechanism.springs.free_length=40 mm"),
    ),
    "sharp leaves": ("vcfm", "sharp_corners", "analyze", VCFM, *changed("mechanism.part.fillet=0 mm"), *SOLID),
    "wide strip": ("slider-crank", "wide_beam", "analyze", STRIP, *changed("mechanism.beam.width=60 mm")),
    "side force": ("slider-crank", "side_force", "analyze", STRIP),
    "overstressed strip": (
        *("slider-crank", "overstressed", "analyze", STRIP, *changed("mechanism.material.yield_strength=30 MPa")),
    ),
    "sharp strip": ("slider-crank", "sharp_corners", "analyze", STRIP, *changed("mechanism.part.fillet=0 mm"), *SOLID),
    "either side": (
        *("slider-crank", "two_positions", "analyze", CRANK),
        *changed("mechanism.unloaded_angle=null", "mechanism.unloaded_offset=0"),
    ),
    "slender spring at the slider": (
        *("slider-crank", "spring_buckles", "analyze", CRANK),
        *changed(
            "mechanism.springs={bought: [{at: slider, name: pushed, loaded: compression, free_length: 80 mm, "
            "wound: {wire: 0.5 mm, coil: 6 mm, turns: 30}}]}",
            "requirements=[]",
            "design=null",
        ),
    ),
    "crank that turns back": (
        *("slider-crank", "infeasible_targets", "design", CRANK),
        *changed("mechanism.unloaded_angle=40 deg", "design.spacing=crank", "design.travel=[100 mm, 160 mm]"),
    ),
    "undercut": ("cam", "undercut", "design", CAM, *changed("mechanism.roller_radius=20 mm")),
    "narrow contact": (
        *("cam", "overstressed", "analyze", CAM),
        *changed("mechanism.contact={width: 0.01 mm, material: {name: pom}}"),
    ),
    "rolling in nine coordinates": (
        *("cam", "friction_left_out", "analyze", MOVING),
        *changed("analysis.dynamics.method=multibody", "mechanism.rolling_friction=0.002"),
    ),
    "leaning in nine coordinates": (
        *("cam", "friction_left_out", "analyze", MOVING),
        *changed("analysis.dynamics.method=multibody", "mechanism.mounting={elevation: 0 deg}"),
    ),
    "corner in nine coordinates": (
        *("cam", "undercut", "analyze", MOVING),
        *changed("analysis.dynamics.method=multibody", "analysis.dynamics.slider_position=188.6 mm"),
    ),
    "roller that hangs": (
        *("cam", "lift_off", "analyze", CAM),
        *changed("mechanism.masses={slider: 0.068 kg, brace: 0.077 kg, roller: 3 kg}"),
        *changed("mechanism.mounting=horizontal"),
    ),
}
"""Family and name of a warning, or of the reason of a failure, and a run that has it."""


FAST = ("rigid", "taut", "wide network", "wide network with frequencies", "truss law")
EVERY = [pytest.param(name, marks=[] if name in FAST else pytest.mark.slow) for name in WARNED]

FAMILIES = PACKAGE / "families"


@cache
def findings_made() -> tuple[tuple[str, list[ast.expr], bool], ...]:
    """Return where the code of the families makes a finding: the family, name with what follows it, whether by a call.

    What is no call of `finding` is a tuple (name, message, commands) that is handed to one.
    """
    return tuple(
        (path.relative_to(FAMILIES).parts[0].replace("_", "-"), parts, is_call)
        for path in FAMILIES.rglob("*.py")
        for node in nodes(path)
        for is_call in [isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "finding"]
        for parts in [node.args if is_call else node.elts if isinstance(node, ast.Tuple) else []]
        if parts and isinstance(parts[0], ast.Constant)
    )


def remedies_of_rules():
    """Yield family and name of each rule in a table of findings whose sentence comes with commands."""
    for path in FAMILIES.rglob("findings.py"):
        functions = [node for node in nodes(path) if isinstance(node, ast.FunctionDef)]
        for rule in nodes(path):
            if not (isinstance(rule, ast.Call) and isinstance(rule.func, ast.Name) and rule.func.id == "FindingRule"):
                continue
            name, _, sentence, *_ = rule.args
            if isinstance(sentence, ast.Name) and isinstance(name, ast.Constant):
                before = [one for one in functions if one.name == sentence.id and one.lineno < rule.lineno]
                returned = (
                    [node.value for node in ast.walk(before[-1]) if isinstance(node, ast.Return)] if before else []
                )
                if any(isinstance(value, ast.Tuple) and len(value.elts) > 1 for value in returned):
                    yield path.relative_to(FAMILIES).parts[0].replace("_", "-"), name.value


def test_each_warning_with_a_command_is_among_the_cases():
    """So is each line of code that makes it: five kinds of `theory_range` are five cases."""
    made = Counter(
        (family, parts[0].value)
        for family, parts, is_call in findings_made()
        if len(parts) > 2 and (is_call or "cure" in ast.unparse(parts[2]))
    ) + Counter(remedies_of_rules())
    assert len(made) > 20
    tested = Counter((family, name) for family, name, *_ in WARNED.values())
    assert {key: count for key, count in made.items() if tested[key] < count} == {}


def test_a_warning_that_states_a_key_with_its_value_has_it_as_a_command():
    """``'analysis.dynamics.method: inverse'`` in a sentence is a remedy that somebody would have to write by hand."""
    setting = re.compile(r"'(?:mechanism|analysis|design)\.[\w.]+: |`cfmkit ")
    left = {
        parts[0].value
        for _, parts, is_call in findings_made()
        if is_call and len(parts) == 2 and setting.search(ast.unparse(parts[1]))
    }
    assert left == {"width_error"}  # two values of a key, without a remedy


def run(capsys, *words):
    """Return exit code, page and warnings of a command."""
    code = run_command([*words, "-v", "-o", "out", "--no-plots"])
    found = json.loads(Path("out/metrics.json").read_text(encoding="utf-8"))
    return code, capsys.readouterr().out, [item["name"] for item in found["warnings"]]


def commands_below(page, warning):
    """Return the commands that a page prints below a warning, or below the reason for which a run failed."""
    lines = page.splitlines()
    heads = (["warning", f"{warning}:"], ["failed"], ["partial"])
    start = next(k for head in heads for k, line in enumerate(lines) if line.split()[: len(head)] == head)
    rest = itertools.takewhile(lambda line: line.startswith(" "), lines[start + 1 :])
    said = [line.strip() for line in rest]
    remedies = [line.removeprefix("remedy").strip() for line in lines if line.startswith("remedy ")]
    return [line for line in said if line.startswith("cfmkit ")] or remedies


@pytest.mark.parametrize("name", EVERY)
def test_the_command_that_a_warning_prints_cures_it(name, tmp_path, monkeypatch, capsys):
    """That of `wide_beam` left out the fidelity that the run was given by an option, and was refused."""
    _, warning, *words = WARNED[name]
    monkeypatch.chdir(tmp_path)
    for file, text in SPECS.items():
        Path(file).write_text(text, encoding="utf-8")
    ended, page, before = run(capsys, *words)
    assert warning in before
    commands = commands_below(page, warning)
    assert commands
    for command in commands:
        code, _, after = run(capsys, *shlex.split(command)[1:])
        assert code in (0, 5, 6), command
        # where the run failed for it, the remedy is that it does not: the same name may warn of less
        assert warning not in after or ended == 4, command
