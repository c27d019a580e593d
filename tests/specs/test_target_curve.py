"""A curve instead of a constant force: what a file may say, what metrics make of it, and cams that follow it."""

from __future__ import annotations

import numpy as np
import pytest
from cam_support import design_exactly

import cfmkit
from cfmkit.cli import run_command
from cfmkit.errors import SpecError
from cfmkit.metrics import check, evaluate
from cfmkit.specs.target_curve import Target

CAM = """
cfmkit: 1
family: cam
mechanism:
  brace_length: 200 mm
  rest_half_width: 68 mm
  roller_radius: {roller}
  springs: {{stiffness: 0.69 N/mm, count: 2}}
  rolling_friction: {friction}
  profile: {{force_constant: 9 mm}}
  {mechanism}
design:
  target: {target}
  stroke: 120 mm
  {design}
{more}
"""

RISING = "{points: [[0 mm, 10 N], [120 mm, 40 N]]}"
FROM_ZERO = "{points: [[0 mm, 0 N], [40 mm, 10 N], [120 mm, 40 N]]}"
STEP_DOWN = "{points: [[0 mm, 40 N], [40 mm, 40 N], [60 mm, 20 N], [120 mm, 20 N]]}"
STEP_UP = "{points: [[0 mm, 20 N], [50 mm, 20 N], [60 mm, 40 N], [120 mm, 40 N]]}"
FALLING = "{stiffness: -0.2 N/mm, start: 50 N}"
MASSES = "masses: {slider: 0.3 kg, brace: 0.2 kg, roller: 0.1 kg}"


def cam(target, roller="2 mm", friction=0, mechanism="", design="", more=""):
    """Return a cam that is to follow a curve."""
    return cfmkit.loads(
        CAM.format(target=target, roller=roller, friction=friction, mechanism=mechanism, design=design, more=more)
    )


def designed(*args, **kwargs):
    """Return the designed cam's specification, before its digits are those of the process."""
    return design_exactly(cam(*args, **kwargs))


@pytest.mark.parametrize(
    ("said", "reported"),
    [
        ("{}", "give one of 'points', 'file' and 'stiffness'"),
        ("{points: [[0 mm, 1 N], [0 mm, 2 N]]}", "points must increase"),
        ("{points: [[5 mm, 1 N], [2 mm, 2 N]]}", "2 mm comes after 5 mm"),
        ("{points: [[0 deg, 1 N], [5 deg, 2 N]]}", "these are mixed"),
        ("{points: [[0 mm, 1 N], [5 mm, 2 N*mm]]}", "these are mixed"),
        ("{points: [[0 mm, 1 N]]}", "at least 2"),
        ("{points: [[0 mm, 1 kg], [1 mm, 2 N]]}", "is a mass"),
        ("{points: [[0 mm, 1], [1 mm, 2 N]]}", "has no unit"),
        ("{points: [[0 mm, 1 N], [1 mm, 2 N]], start: 1 N}", "'start' belongs to 'stiffness'"),
        ("{stiffness: 1 N/mm, start: 1 N*mm}", "must both be"),
        ("{points: [[0 deg, 1 N*mm], [9 deg, 2 N*mm]]}", "curve of torque"),
        ("{points: [[0 mm, 1 N], [1 mm, 2 N]], interpolation: cubic}", "is not one of smooth, linear"),
        ("{file: there-is-none.csv}", "there is no file"),
    ],
)
def test_what_is_no_curve_is_refused_in_a_line(said, reported):
    with pytest.raises(SpecError) as caught:
        cam(said)
    assert reported in str(caught.value)
    assert "target" in str(caught.value)


@pytest.mark.parametrize(
    ("text", "reported"),
    [
        ("displacement [mm],force [N]\n0,1\n5,x\n", "curve.txt:3: "),
        ("displacement [mm],force [N]\n0,1\n5\n", "no force"),
        ("displacement,force\n0,1\n", "needs columns"),
        ("displacement [mm],force [N]\n0,1\n", "2 to 10000 points"),
        ("displacement [mm],force [N]\n3,1\n0,2\n", "0 mm comes after 3 mm"),
        ("", "needs columns"),
        ('displacement [mm],force [N]\n0,1\n"' + "1" * 200_000 + '",1\n', "curve.txt:3: field larger than"),
    ],
    ids=["word", "gap", "no units", "one point", "backwards", "empty", "endless cell"],
)
def test_a_file_that_is_no_curve_is_refused_with_its_line(tmp_path, text, reported):
    (tmp_path / "curve.txt").write_text(text)
    spec = tmp_path / "cam.yaml"
    spec.write_text(CAM.format(target="{file: curve.txt}", roller="2 mm", friction=0, mechanism="", design="", more=""))
    with pytest.raises(SpecError) as caught:
        cfmkit.load(spec)
    assert reported in str(caught.value)


def test_a_file_says_the_same_as_its_points_and_the_design_no_longer_needs_it(tmp_path):
    (tmp_path / "curve.csv.txt").write_text("\ufeffangle [deg],force [N],displacement [mm]\n7,10,0\n\n9,40,120\n")
    spec = tmp_path / "cam.yaml"
    spec.write_text(
        CAM.format(target="{file: curve.csv.txt}", roller="2 mm", friction=0, mechanism="", design="", more="")
    )
    written = design_exactly(cfmkit.load(spec))
    assert written.design.target.file is None
    assert written == cfmkit.loads(cfmkit.dumps(written))
    assert cfmkit.analyze(written).curve.effort == pytest.approx(cfmkit.analyze(designed(RISING)).curve.effort)


@pytest.mark.parametrize("target", [RISING, FROM_ZERO, STEP_DOWN, STEP_UP, FALLING])
def test_a_cam_follows_its_curve_to_1e_9(target):
    spec = designed(target)
    result = cfmkit.analyze(spec)
    wanted = spec.target_curve.evaluate(result.curve.motion)
    assert np.abs(result.curve.effort - wanted).max() < 1e-9 * wanted.max()
    found = evaluate(result)
    assert found["deviation_from_curve"].value < 1e-9
    assert found["rms_to_curve"].value < 1e-9 * wanted.max()
    assert found["usable_stroke"].value == pytest.approx(0.120)
    assert found["deviation_from_target"].value is None


def test_work_on_the_slider_is_the_energy_of_the_springs():
    assembly = cfmkit.analyze(designed(STEP_UP)).state.assembly
    law, stiffness = assembly.profile.path.law, assembly.loads.stiffness
    x = np.linspace(law.rest_half_width, assembly.profile.end, 7)
    stored = 0.5 * stiffness * (2.0 * (x - law.rest_half_width)) ** 2
    wanted = Target(points=(("0 mm", "20 N"), ("50 mm", "20 N"), ("60 mm", "40 N"), ("120 mm", "40 N"))).curve()
    assert wanted.function.integral(assembly.profile.path.travel(x)) == pytest.approx(stored, rel=1e-10, abs=1e-15)


def test_a_level_curve_is_the_cam_of_a_constant_force():
    level = cfmkit.analyze(designed("{points: [[0 mm, 50 N], [120 mm, 50 N]]}", design="friction: 0.002"))
    text = CAM.replace("target: {target}", "force: 50 N").format(
        roller="2 mm", friction=0, mechanism="", design="friction: 0.002", more=""
    )
    constant = cfmkit.analyze(design_exactly(cfmkit.loads(text)))
    for column in ("roller_x", "roller_y"):
        assert level.curve.extra[column].values == pytest.approx(constant.curve.extra[column].values, rel=1e-9)


@pytest.mark.parametrize("target", [RISING, STEP_DOWN])
def test_a_profile_cut_for_friction_is_exact_on_the_way_up(target):
    result = cfmkit.analyze(designed(target, friction=0.002, design="friction: 0.002"))
    up = result.curve.select_branch("load")
    wanted = result.spec.target_curve.evaluate(up.motion)
    assert np.abs(up.effort / wanted - 1.0)[2:].max() < 1e-9


@pytest.mark.parametrize("target", ["{points: [[0 mm, 60 N], [120 mm, 20 N]]}", "{stiffness: 0.2 N/mm, start: 30 N}"])
def test_a_profile_carries_weights_beside_its_curve(target):
    result = cfmkit.analyze(designed(target, mechanism=MASSES, design="gravity: true"))
    wanted = result.spec.target_curve.evaluate(result.curve.motion)
    assert np.abs(result.curve.effort - wanted)[2:-2].max() < 1e-9 * wanted.max()


@pytest.mark.parametrize(
    ("target", "more", "reported"),
    [
        ("{points: [[0 mm, 20 N], [120 mm, -5 N]]}", {}, "-5 N at 120 mm"),
        ("{points: [[0 mm, -1 N], [120 mm, 5 N]]}", {}, "-1 N at 0 mm"),
        ("{stiffness: -0.2 N/mm}", {}, "-24 N at 120 mm"),
        ("{points: [[0 mm, 0 N], [60 mm, 0 N], [120 mm, 5 N]]}", {}, "above 0"),
        ("{points: [[0 mm, 20 N], [80 mm, 20 N]]}", {}, "goes from 0 mm to 80 mm"),
        ("{points: [[10 mm, 20 N], [120 mm, 20 N]]}", {}, "begin at 0 mm"),
        (
            "{points: [[0 mm, 40 N], [40 mm, 40 N], [41 mm, 5 N], [120 mm, 5 N]]}",
            {"roller": "6 mm"},
            "a smaller roller",
        ),
        ("{points: [[0 mm, 100 N], [120 mm, 900 N]]}", {}, "the stroke ends at"),
        (FROM_ZERO, {"mechanism": "", "design": "friction: 0.002"}, "friction"),
        ("{points: [[0 mm, 60 N], [120 mm, 1 N]]}", {"mechanism": MASSES, "design": "gravity: true"}, "weight"),
    ],
)
def test_what_no_cam_gives_has_a_reason_and_no_design(target, more, reported):
    found = cfmkit.design(cam(target, **more))
    assert found.spec is None
    assert found.status.key == "infeasible"
    assert reported in found.message


def test_springs_that_are_tight_at_a_start_without_force_have_no_path():
    text = CAM.replace("count: 2", "count: 2, preload: 5 mm")
    spec = cfmkit.loads(text.format(target=FROM_ZERO, roller="2 mm", friction=0, mechanism="", design="", more=""))
    assert "would begin vertical" in cfmkit.design(spec).message


def test_undercut_of_a_curve_has_the_same_cure_as_that_of_a_constant_force():
    assert "undercut" in {one.name for one in cfmkit.analyze(designed(RISING, roller="10 mm")).warnings}
    cured = cfmkit.analyze(designed(RISING, roller="10 mm", design="avoid_undercut: true"))
    assert cured.warnings == ()
    assert evaluate(cured)["deviation_from_curve"].value < 1e-9


def test_metrics_of_an_analysis_compare_with_its_own_curve_and_requirements_count():
    more = "analysis: {target: {stiffness: 0.25 N/mm, start: 10.4 N}}\n" + (
        "requirements: [{metric: deviation_from_curve, max: 0.9 %}, {metric: rms_to_curve, max: 0.5 N}]"
    )
    result = cfmkit.analyze(designed(RISING, more=more))
    assert evaluate(result)["deviation_from_curve"].value == pytest.approx(0.4 / 40.4, rel=1e-9)
    assert evaluate(result)["rms_to_curve"].value == pytest.approx(0.4, rel=1e-9)
    assert [one.ok for one in check(result.spec.requirements, result)] == [False, True]


def test_page_and_notebook_lead_with_the_deviation_from_a_curve_and_from_none_where_there_is_none(tmp_path, capsys):
    file = tmp_path / "rising.yaml"
    file.write_text(cfmkit.dumps(designed(RISING, friction=0.002)), encoding="utf-8")
    for name, there in ((str(file), True), ("configs/cam.yaml", False)):
        assert run_command(["analyze", name, "--no-plots", "-o", str(tmp_path / "out")]) == 0
        assert ("deviation from curve" in capsys.readouterr().out) == there
        assert ("deviation from curve" in cfmkit.analyze(name)._repr_html_()) == there


def test_a_window_that_the_curve_does_not_cover_has_no_deviation():
    result = cfmkit.analyze(cam(RISING).replace({"analysis.target": {"points": ((0.0, 1.0), (0.01, 2.0))}}))
    found = evaluate(result)["deviation_from_curve"]
    assert found.value is None
    assert "covers only 0 ... 10 mm" in found.reason


def test_without_a_curve_there_are_no_metrics_of_one_and_a_requirement_says_why():
    spec = cfmkit.load("configs/cam.yaml")
    result = cfmkit.analyze(spec)
    assert "deviation_from_curve" not in evaluate(result)
    assert "no target curve" in evaluate(result, ["deviation_from_curve"])["deviation_from_curve"].reason


def test_a_cut_curve_is_its_own_target_where_no_other_is_named():
    spec = designed(RISING).replace({"design": None})
    result = cfmkit.analyze(spec.replace({"mechanism.springs.stiffness": 2 * spec.mechanism.springs.stiffness}))
    assert evaluate(result)["deviation_from_curve"].value < 1e-9
    assert result.curve.effort[240] == pytest.approx(50.0)


SPRINGS = """
cfmkit: 1
family: slider-crank
mechanism:
  crank_length: 54 mm
  stretched_position: 100 mm
  offset: 60 mm
  unloaded_angle: 0.542 rad
  springs: {{pivot: 35 N*mm/rad, crank_pin: 30 N*mm/rad, slider_pin: 49 N*mm/rad}}
design: {{{design}}}
analysis: {{drive: {drive}, travel: [0 mm, 32 mm]}}
"""


def test_springs_follow_a_rising_force_better_than_they_hold_a_constant_one():
    design = "target: {points: [[0 mm, 0.9 N], [30 mm, 1.5 N]]}, travel: [5 mm, 30 mm]"
    found = cfmkit.design(cfmkit.loads(SPRINGS.format(design=design, drive="force")))
    result = cfmkit.analyze(found.spec)
    said = evaluate(result)["deviation_from_curve"].value
    inside = (result.curve.motion >= 0.005) & (result.curve.motion <= 0.030)
    wanted = 0.9 + 20.0 * result.curve.motion[inside]
    assert said == pytest.approx(np.abs(result.curve.effort[inside] - wanted).max() / 1.5, rel=0.02)
    assert said < 1e-5
    assert found.spec == cfmkit.loads(cfmkit.dumps(found.spec))


def test_a_torque_follows_a_line_over_the_angle():
    base = cfmkit.load("configs/slider_crank_li2019_widest.yaml")
    target = {"points": (("-5 deg", "1.5 N*mm"), ("14 deg", "3 N*mm"))}
    found = cfmkit.design(base.replace({"design": {"target": target, "angle": ("0 deg", "10 deg")}}))
    result = cfmkit.analyze(found.spec)
    assert result.curve.kind == "torque"
    inside = (result.curve.motion >= 0.0) & (result.curve.motion <= np.radians(10))
    wanted = 1.5e-3 + 1.5e-3 / np.radians(19) * (result.curve.motion[inside] - np.radians(-5))
    off = np.abs(result.curve.effort[inside] - wanted).max() / wanted.max()
    said = evaluate(result)["deviation_from_curve"].value
    assert said == pytest.approx(off, rel=0.02)
    for path in ("pivot", "crank_pin", "slider_pin", "slider"):  # no rate beside those of the design comes nearer
        rate = found.spec.get_value(f"mechanism.springs.{path}")
        for factor in (0.97, 1.03):
            other = cfmkit.analyze(found.spec.replace({f"mechanism.springs.{path}": rate * factor + 1e-9}))
            assert evaluate(other)["deviation_from_curve"].value > said * (1 - 1e-6)


@pytest.mark.parametrize(
    ("design", "drive", "reported"),
    [
        ("target: {points: [[0 mm, 1 N], [9 mm, 2 N]]}", "force", "needs its window: give 'travel'"),
        ("target: {points: [[0 mm, 1 N], [9 mm, 2 N]]}, travel: [5 mm, 30 mm]", "force", "beyond the points"),
        ("target: {points: [[0 mm, 1 N], [9 mm, 2 N]]}, travel: [5 mm, 8 mm], force: 1 N", "force", "give either"),
        ("target: {points: [[0 mm, 0 N], [9 mm, 0 N]]}, travel: [5 mm, 8 mm]", "force", "zero all over"),
        ("target: {points: [[0 mm, 1 N], [9 mm, 2 N]]}, travel: [5 mm, 8 mm]", "torque", "curve of force"),
    ],
)
def test_springs_refuse_what_is_no_curve_of_theirs(design, drive, reported):
    with pytest.raises(SpecError) as caught:
        cfmkit.loads(SPRINGS.format(design=design, drive=drive))
    assert reported in str(caught.value)


def test_a_v_beam_falls_in_a_line():
    found = cfmkit.design(cfmkit.load("configs/vcfm_falling.yaml"))
    result = cfmkit.analyze(found.spec)
    wanted = 13.4 - 800.0 * result.curve.motion
    inside = (result.curve.motion >= 1.3e-3) & (result.curve.motion <= 4.3e-3)
    assert np.abs(result.curve.effort - wanted)[inside].max() / 13.4 < 0.01
    assert evaluate(result)["deviation_from_curve"].value < 0.01
    assert "not_flat" not in {one.name for one in result.warnings}


@pytest.mark.parametrize(
    ("change", "reported"),
    [
        ({"design.target": {"stiffness": "-5 N/mm", "start": "13.4 N"}}, "must be above 0"),
        ({"design.target": {"points": (("0 mm", "13 N"), ("3 mm", "11 N"))}}, "give it points there"),
    ],
)
def test_a_v_beam_that_cannot_follow_says_why(change, reported):
    found = cfmkit.design(cfmkit.load("configs/vcfm_falling.yaml").replace(change))
    assert found.spec is None
    assert reported in found.message


@pytest.mark.parametrize(
    ("change", "reported"),
    [
        ({"design.optimise.objective": "range"}, "objective: ripple"),
        ({"design.target.points": (("0 mm", "1 N"), ("9 mm", "2 N"))}, "beyond the points"),
        ({"design.target.points": (("0 mm", "1 N"), ("20 mm", "-2 N"))}, "must stay above 5%"),
        ({"design.optimise.force.target": "3 N"}, "remove 'optimise.force'"),
    ],
)
def test_a_network_refuses_a_curve_that_its_search_cannot_compare_with(change, reported):
    spec = cfmkit.load("configs/beam_design_lan.yaml")
    with pytest.raises(SpecError) as caught:
        spec.replace(
            {
                "design.target": {"points": (("6.8 mm", "1 N"), ("13.6 mm", "2 N"))},
                "design.optimise.objective": "ripple",
            }
            | change
        )
    assert reported in str(caught.value)


STRIP = """
cfmkit: 1
family: slider-crank
mechanism:
  crank_length: 54 mm
  stretched_position: 100 mm
  offset: 60 mm
  unloaded_angle: 0.542 rad
  material: {youngs_modulus: 1800 MPa, poisson_ratio: 0.35, yield_strength: 42.5 MPa}
  beam: {width: 5.138 mm, thickness: [1 mm, 1 mm, 1 mm, 1 mm, 1 mm, 1 mm, 1 mm]}
design:
  target: {points: [[0 mm, 1 N], [20 mm, 1.4 N]]}
  travel: [3 mm, 20 mm]
  beam: {goal: ripple, nodes: 7, thickness: [0.5 mm, 2 mm], width: 5.138 mm}
analysis: {drive: force, travel: [0 mm, 20 mm]}
"""


@pytest.mark.slow
def test_a_strip_comes_nearer_to_its_curve_than_one_of_one_thickness():
    spec = cfmkit.loads(STRIP)
    found = cfmkit.design(spec)
    near, far = (cfmkit.analyze(one) for one in (found.spec, spec))
    window = found.spec.analysis.window
    said = evaluate(near)["deviation_from_curve"].value
    assert said < 0.05
    assert (
        said < 0.5 * evaluate(cfmkit.analyze(spec.replace({"analysis.window": window})))["deviation_from_curve"].value
    )
    assert far.status.key == "complete"


def test_a_strip_with_a_curve_has_no_longest_stroke():
    found = cfmkit.design(
        cfmkit.loads(
            STRIP.replace("goal: ripple", "goal: stroke").replace(
                "travel: [3 mm, 20 mm]\n  beam", "travel: [3 mm, 20 mm]\n  tolerance: 1 %\n  beam"
            )
        )
    )
    assert found.spec is None
