"""Yields on the page and in the exit code of a design."""

from __future__ import annotations

import pytest

import cfmkit
from cfmkit import Run
from cfmkit.errors import SpecError
from cfmkit.runs.run import run_analysis, run_design

TOLERANCES = {"mechanism.springs.stiffness": {"normal": "1.2 %"}, "mechanism.rolling_friction": {"normal": "10 %"}}


def cam(**keys):
    spec = cfmkit.load("configs/cam.yaml")
    spec = spec.replace({f"design.{key}": value for key, value in ({"tolerances": TOLERANCES} | keys).items()})
    return spec


def with_yield(spec, least):
    return spec.replace({"requirements": (*spec.requirements, {"metric": "yield", "min": least})})


def test_the_yield_is_that_of_the_tolerance_study_of_the_design():
    found = run_design(cam(samples=120), Run(3))
    design = found.design.spec
    study = cfmkit.sensitivity(design, method="tolerance", parameters=TOLERANCES, samples=120, seed=3)
    assert 0.05 < found.metrics["yield"].value < 0.95
    assert found.metrics["yield"].value == study.summary["yield"]["value"]
    assert found.supplement.data["yield"]["clopper_pearson"] == study.summary["yield"]["clopper_pearson"]


def test_a_requirement_on_the_yield_decides_the_exit_code_and_keeps_its_place():
    missed = run_design(with_yield(cam(samples=60), "99 %"), Run())
    assert [one.metric for one in missed.requirements][-1] == "yield"
    assert int(missed.exit_code) == 5
    assert int(run_design(with_yield(cam(samples=60), "5 %"), Run()).exit_code) == 0


def test_an_analysis_does_not_judge_a_yield():
    spec = with_yield(cam(), "99 %")
    found = run_analysis(spec, Run())
    assert len(found.requirements) == len(spec.requirements) - 1
    assert int(found.exit_code) == 0


TAPERED = """
cfmkit: 1
family: beam
name: tapered
mechanism:
  material: {youngs_modulus: 2 GPa, poisson_ratio: 0.35, yield_strength: 90 MPa}
  thickness: [[0, 1 mm], [1, 0.6 mm]]
  width: 6 mm
  nodes: {root: {at: [0 mm, 0 mm], support: clamped}, tip: {at: [40 mm, 0 mm], support: guided, direction: 180 deg}}
  beams: {arch: {start: root, end: tip, shape: {kind: polynomial, coefficients: [0.5 rad, -1 rad]}}}
  drive: {kind: displacement, node: tip, direction: 180 deg}
analysis: {travel: 3 mm, points: 11}
design: {rescale: {force: 2 N}, process: wire-edm}
requirements: [{metric: force_max, max: 3 N}]
"""


def test_a_yield_of_a_part_that_errs_nowhere_is_refused_and_never_met():
    """Nothing is assumed of tapered beams between held nodes: a requirement on their yield was left out, exit 0."""
    spec = cfmkit.loads(TAPERED)
    asked = {"requirements": (*spec.requirements, {"metric": "yield", "min": "95 %"})}
    for changes, path in ((asked, "requirements.1.metric"), ({"design.yield": "95 %"}, "design.yield")):
        with pytest.raises(SpecError) as error:
            cfmkit.loads(cfmkit.dumps(spec.replace(changes)))
        assert [(one.path, "err by its process" in one.message) for one in error.value.problems] == [(path, True)]
    found = run_design(spec.replace({**asked, "design.yield": "95 %"}), Run())
    assert [(one.metric, one.ok, one.value) for one in found.requirements][1] == ("yield", False, None)
    assert "err by its process" in found.requirements[1].sentence
    assert int(found.exit_code) == 5
    assert "err by its process" in dict(found.design.notes)["margins"]


def test_a_cam_whose_parts_end_in_its_window_gets_no_number_one_with_shares_does_and_a_design_with_tolerances_no_line():
    cam = cfmkit.load("configs/cam.yaml")
    stated = ({"metric": "deviation_from_target", "max": "3 %", "over": ("5 mm", "240 mm")},)
    made = dict(run_design(cam.replace({"requirements": stated}), Run()).supplement.lines)["yield"]
    assert made.startswith("not estimated (laser, assumed tolerances): ")
    made = dict(run_design(cam, Run()).supplement.lines)["yield"]
    assert made.startswith("23 % (laser, assumed tolerances)")
    assert "rates of springs within 5 %" in made
    toleranced = cam.replace({"design.tolerances": {"mechanism.springs.stiffness": {"normal": "1 %"}}})
    found = run_design(toleranced.replace({"design.samples": 20}), Run())
    (made,) = (text for name, text in found.supplement.lines if name == "yield")
    assert "of 20 parts drawn from design.tolerances are good" in made  # the one that was drawn, no estimate
