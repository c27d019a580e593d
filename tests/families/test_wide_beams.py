"""What families say and do of beams that are too wide to curl: the finding `wide_beam`, the key `wide_beams`."""

from __future__ import annotations

import pytest
from beam_support import CONFIGS, cantilever

import cfmkit
from cfmkit.errors import SpecError
from cfmkit.families.findings import describe_wide_part

LAN, DING = CONFIGS / "beam_lan2010.yaml", CONFIGS / "vcfm_ding2022.yaml"
STRIP = CONFIGS / "slider_crank_strip.yaml"


def changed(path, *changes):
    return cfmkit.load(path, changes)


def reported(path, *changes):
    found = cfmkit.analyze(changed(path, *changes))
    return [one for one in found.warnings if one.name == "wide_beam"]


def test_lans_part_is_too_soft_by_what_its_energy_says_and_the_cure_counts_it():
    """In the energy of the curve 3.6 % at 2 mm, 5.0 at 10, 5.4 at 13.5; its slope gives 3.8, 6.0, 6.7 of the force."""
    short = ("analysis.travel=13.5 mm", "analysis.points=28")
    (one,) = reported(LAN, *short)
    assert "about 5.43 % more energy at 13.5 mm" in one.message
    assert one.cures == ("mechanism.wide_beams=true",)
    assert reported(LAN, *short, "mechanism.wide_beams=true") == []
    narrow, wide = (cfmkit.analyze(changed(LAN, *short, *more)).curve for more in ((), ("mechanism.wide_beams=true",)))
    assert wide.force[4] / narrow.force[4] - 1 == pytest.approx(0.0372, abs=2e-4)
    assert wide.force[20] / narrow.force[20] - 1 == pytest.approx(0.0602, abs=2e-4)


def test_narrow_beams_are_not_told_of():
    assert reported(LAN, "mechanism.width=1 mm", "analysis.points=11") == []
    assert reported(DING, "analysis.preloads=[0 mm]") == []


def test_wide_leaves_are_told_of_and_only_the_exact_model_counts_them():
    wide = "mechanism.bistable.width=20 mm"
    (one,) = reported(DING, wide, "analysis.preloads=[0 mm]")
    assert "4.74 % more energy in the leaves at 4.263 mm" in one.message
    assert "only 'analysis.fidelity: exact' accounts for it" in one.message
    with pytest.raises(SpecError, match=r"mechanism\.wide_beams: no closed form includes it"):
        changed(DING, wide, "mechanism.wide_beams=true")


def test_a_wide_strip_is_told_of():
    (one,) = reported(STRIP, "mechanism.beam.width=30 mm", "analysis.points=15", "design=null")
    assert "more energy at" in one.message


@pytest.mark.parametrize(
    ("mechanism", "beam", "words"),
    [
        ("2 mm", "width: 50 mm", "50 mm wide, 1 mm thick"),
        ("50 mm", "width: 2 mm", ""),
        ("50 mm", "material: {youngs_modulus: 2 GPa, poisson_ratio: 0}", "plane strain, 0 % more"),
    ],
)
def test_a_solid_of_beams_with_a_width_or_a_material_of_their_own_is_as_wide_as_it_is_meshed(mechanism, beam, words):
    short = ("[400 mm, 0 mm]", "[20 mm, 0 mm]"), ("travel: 100 mm", "travel: 0.5 mm\n  fidelity: solid")
    mesh = "points: 5\n  solid: {error: 0.1, poses: 3}"
    own = ("width: 100 mm", f"width: {mechanism}"), ("end: tip}", f"end: tip, {beam}}}")
    found = cfmkit.analyze(cantilever(*short, ("points: 21", mesh), *own))
    told = [one.message for one in found.warnings if one.name == "wide_beam"]
    assert len(told) == bool(words)
    assert words in "".join(told)


WIDE = "mechanism.wide_beams=true"


def test_a_strip_is_designed_as_wide_as_it_is_analysed():
    """The force of the written strip was 1.6 % too large, its stress 5 %: the design knew narrow strips only."""
    about = "design.force=20 N", "design.travel=[1 mm, 12 mm]", "analysis.points=7"
    beam = "design.beam={shape: uniform, goal: ripple, width: [5 mm, 60 mm], thickness: [0.5 mm, 4 mm]}"
    made = cfmkit.design(changed(STRIP, WIDE, beam, *about)).spec
    found = cfmkit.evaluate(cfmkit.analyze(made), ("force_max", "force_min", "stress_max"))
    assert 0.5 * (found["force_max"].value + found["force_min"].value) == pytest.approx(20.0, rel=1e-3)
    assert found["stress_max"].value == pytest.approx(42.5e6, rel=1e-3)


@pytest.mark.parametrize("value", ["3", "wide", "[true]", "null"])
@pytest.mark.parametrize("path", [LAN, DING, STRIP])
def test_anything_but_a_truth_value_is_refused(path, value):
    with pytest.raises(SpecError, match=r"mechanism\.wide_beams.* is not true or false"):
        changed(path, f"mechanism.wide_beams={value}")


def test_the_bracket_of_a_solid_says_that_wide_beams_counts_in_beam_models_only():
    assert "beam models only" in describe_wide_part(10e-3, 1e-3, 0.35, True)
    assert "beam models only" not in describe_wide_part(10e-3, 1e-3, 0.35, False)
    assert describe_wide_part(2e-3, 1e-3, 0.35, True) == ""


def test_natural_frequencies_do_not_know_wide_beams():
    with pytest.raises(SpecError, match="known of narrow beams only"):
        changed(LAN, "mechanism.wide_beams=true", "analysis.modes=2", "mechanism.material.density=1410 kg/m^3")


FLAT_ROOT = """
cfmkit: 1
family: beam
name: flat-root
mechanism:
  material: {youngs_modulus: 2 GPa, poisson_ratio: 0.35}
  wide_beams: true
  shear: true
  axial: true
  thickness: 1 mm
  width: 6 mm
  nodes:
    wall: {at: [0 mm, 0 mm], support: clamped}
    flat: {at: [1.8 mm, 0 mm]}
    tip: {at: [24 mm, 0 mm]}
  beams:
    root: {start: wall, end: flat, material: {youngs_modulus: 2.2792 GPa, poisson_ratio: 0}}
    strip: {start: flat, end: tip}
  drive: {kind: force, node: tip, direction: 90 deg}
analysis: {force: 3.47222 N, points: 11}
"""


@pytest.mark.parametrize(("force", "solid"), [(3.47222, 0.48396), (0.0347222, 0.0064828)])
def test_a_root_that_does_not_curl_has_the_deflection_of_a_solid_in_three_dimensions(tmp_path, force, solid):
    """0.3 widths of plane strain; 20-node bricks of `benchmarks/wide_strips_ccx.py`, b/t 6, four widths long."""
    path = tmp_path / "flat.yaml"
    path.write_text(FLAT_ROOT, encoding="utf-8")
    result = cfmkit.analyze(cfmkit.load(path).replace({"analysis.force": force}))
    assert result.curve.motion[-1] / 24e-3 == pytest.approx(solid, rel=0.01)


def test_wide_leaves_are_looked_at_under_every_preload():
    """A spring of 1.5 x 10 mm is bent little without a preload, and by 7.5 mm more with the largest."""
    spec = cfmkit.load("configs/vcfm_ding2022.yaml").replace({"analysis.fidelity": "exact"})
    named = {preload: {one.name for one in cfmkit.analyze(spec.replace({"analysis.preloads": preloads})).warnings}
             for preload, preloads in (("none", ["0 mm"]), ("all", ["0 mm", "7.5 mm"]))}  # fmt: skip
    assert "wide_beam" not in named["none"]
    assert "wide_beam" in named["all"]
