"""Printed parts: layers, strands, and what the drawing says of how to lay them."""

import pytest

import cfmkit
from cfmkit.cli import run_command
from cfmkit.stock.material_and_part_spec import MaterialSpec
from cfmkit.stock.processes import LAYER_STRENGTHS, strands

STRIP = """
cfmkit: 1
family: slider-crank
name: printed-strip
mechanism:
  crank_length: 54 mm
  stretched_position: 100 mm
  offset: 60 mm
  unloaded_angle: 0.542 rad
  material: {name: pla, layers: along}
  beam: {width: 8 mm, thickness: 0.96 mm}
  part: {stock: metric, process: fdm}
design:
  force: 1 N
  travel: [1 mm, 34 mm]
  beam: {shape: uniform, goal: ripple, width: [4 mm, 60 mm], thickness: [0.4 mm, 2 mm]}
analysis:
  drive: force
  travel: [0 mm, 34 mm]
  window: [1 mm, 34 mm]
  points: 121
requirements:
  - {metric: half_band, max: 3 %, over: [1 mm, 34 mm]}
"""


def test_strength_and_modulus_are_those_of_the_direction():
    flat, standing = (MaterialSpec(name="pla", layers=way) for way in ("along", "across"))
    assert (flat.yield_strength, flat.modulus) == (45e6, 3.0e9)
    assert (standing.yield_strength, standing.modulus) == (12e6, 1.6e9)
    assert MaterialSpec(name="petg", layers="across").modulus == MaterialSpec(name="petg").modulus


def test_a_stated_strength_counts_more_than_that_of_the_direction():
    assert MaterialSpec(name="pla", layers="across", yield_strength="20 MPa").yield_strength == 20e6
    assert MaterialSpec(name="abs", layers="across", yield_strength="20 MPa").yield_strength == 20e6


@pytest.mark.parametrize("stated", ["{name: steel-304, layers: across}", "{youngs_modulus: 2 GPa, layers: along}"])
def test_layers_of_a_material_without_strengths_of_layers_are_refused_in_one_line(stated, tmp_path, capsys):
    file = tmp_path / "strip.yaml"
    file.write_text(STRIP.replace("{name: pla, layers: along}", stated))
    assert run_command(["analyze", str(file), "--no-plots", "-o", str(tmp_path / "out")]) == 3
    shown = capsys.readouterr()
    assert "no strength along and across the layers is known of" in shown.out + shown.err


def test_each_strength_has_a_source_and_is_lower_between_the_layers():
    for one in LAYER_STRENGTHS.values():
        assert one.across < one.along
        assert one.source


@pytest.mark.parametrize(
    ("millimetres", "near"), [(0.8, (2,)), (0.805, (2,)), (0.96, (2, 3)), (1.1, (3, 2)), (0.2, (1,))]
)
def test_whole_strands_next_to_a_thickness(millimetres, near):
    assert strands(1e-3 * millimetres, 0.4e-3) == near


def test_a_design_takes_a_strip_of_whole_strands_and_says_what_that_does_to_the_force():
    given = cfmkit.loads(STRIP)
    found = cfmkit.design(given)
    notes = dict(found.notes)
    assert found.spec.mechanism.beam.thickness == pytest.approx(0.4e-3, abs=1e-12)
    assert notes["strands"].startswith("whole strands taken: ")
    assert "mean force" in notes["strands"]
    assert found.spec.mechanism.safety_factor == given.mechanism.safety_factor
    assert found.spec.design == given.design
    mean = cfmkit.evaluate(cfmkit.analyze(found.spec), ["force_mean"])["force_mean"].value
    assert mean == pytest.approx(1.0, rel=0.03)


def test_a_design_without_whole_strands_says_so_and_is_left():
    given = cfmkit.loads(STRIP.replace("[4 mm, 60 mm]", "[4 mm, 12 mm]"))
    found = cfmkit.design(given)
    assert dict(found.notes)["strands"].startswith("left as they are")
    assert found.spec.mechanism.beam.thickness == pytest.approx(0.622e-3, abs=2e-6)
