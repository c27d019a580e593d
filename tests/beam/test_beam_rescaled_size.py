"""Networks of beams rescaled: to a force, a stress, a size; and what another size scales besides the part."""

from __future__ import annotations

import numpy as np
import pytest
from beam_support import MM, at, cantilever, config, solved, value, warned

import cfmkit
from cfmkit import Run
from cfmkit.families import family
from cfmkit.results import Status


def test_the_preload_of_another_size_is_scaled_and_the_surface_stays():
    """Before, the preload was still 1.76 mm: more than the travel of a part of a fifth of the size."""
    flat = 'analysis.surface.profile={kind: formula, height: "0.1*x", length: 1 mm}'
    spec = config("beam_end_effector", "design.rescale.size=2 mm", flat, "analysis.points=23")
    made = cfmkit.design(spec).spec
    assert made.analysis.surface.preload == pytest.approx(0.352 * MM)
    assert made.analysis.surface.profile == spec.analysis.surface.profile
    result = cfmkit.analyze(made)
    assert result.status is Status.COMPLETE
    assert value(result, "tip_force_min") > 0


def test_what_a_specification_leaves_out_is_left_out_in_one_of_another_size():
    made = cfmkit.design(config("beam_lan2010", "design.rescale.size=64 mm")).spec
    assert not {"surface", "solid"} & made.analysis.model_fields_set


def test_thinner_beams_for_the_same_force_reach_further_at_the_same_stress():
    """Section 2.3: the travel goes to where the stress reaches the allowable one, c follows."""
    section = ("design.rescale.thickness=0.85 mm", "design.rescale.width=16.28 mm")
    design = cfmkit.design(config("beam_lan2010", *section, "design.rescale.to_allowable_stress=true"))
    assert design.spec.analysis.travel == pytest.approx(16.82 * MM, abs=1e-9)
    result = cfmkit.analyze(design.spec)
    assert value(result, "safety_factor") == pytest.approx(1, abs=1e-4)
    assert value(result, "safety_factor") >= 1


def test_the_force_wanted_is_reached_with_stretching_too_and_the_error_of_equation_6_is_told():
    changes = ("mechanism.axial=true", "design.rescale.force=12 N", "design.rescale.free=thickness")
    design = family("beam").design.make(config("beam_lan2010", *changes), Run())  # before its digits are rounded
    assert value(cfmkit.analyze(design.spec), "nominal_force") == pytest.approx(12, rel=1e-8)
    assert "off by" in warned(design)["rescale_approximate"]


def test_equation_6_is_not_blamed_for_a_width_and_is_for_a_size():
    """The share of stretching goes with (thickness / size)^2: twice the size has a quarter of it."""
    axial = ("mechanism.axial=true", "design.rescale.force=12 N")
    assert not {item.name for item in cfmkit.design(config("beam_lan2010", *axial)).warnings} & {"rescale_approximate"}
    stiff = value(solved("beam_lan2010"), "nominal_force")
    soft = value(solved("beam_lan2010", "mechanism.axial=true"), "nominal_force")
    error = 100 * (1 + (soft / stiff - 1) / 4) / (soft / stiff) - 100
    for change in ("design.rescale.force=12 N", "design.rescale.free=width"):
        design = cfmkit.design(config("beam_lan2010", "mechanism.axial=true", change, "design.rescale.size=64 mm"))
        reported = warned(design)["rescale_approximate"]
        assert float(reported.split("off by ")[1].split(" %")[0]) == pytest.approx(error, rel=0.1)
        assert reported.endswith("; corrected") == ("force" in change)


def test_a_size_scales_every_length_in_the_plane():
    spec = config("beam_lan2010", "design.rescale.size=64 mm")
    scaled = cfmkit.design(spec).spec
    for node in spec.mechanism.nodes:
        np.testing.assert_allclose(scaled.mechanism.nodes[node].at, 2 * np.array(spec.mechanism.nodes[node].at))
    assert scaled.mechanism.beams["b1"].shape.length == pytest.approx(2 * spec.mechanism.beams["b1"].shape.length)
    assert scaled.mechanism.thickness == spec.mechanism.thickness
    assert scaled.requirements[0].over == pytest.approx((14 * MM, 27.2 * MM))
    big, small = cfmkit.analyze(scaled), solved("beam_lan2010")
    np.testing.assert_allclose(4 * at(big, 2 * small.curve.motion), small.curve.force, rtol=1e-6, atol=1e-6)


RESCALE = "design: {{rescale: {}}}\nanalysis:"


TWO = ("end: tip}", "end: mid}\n    other: {start: mid, end: tip, thickness: 2 mm, width: 200 mm}")


MID = ("tip: {at: [400 mm, 0 mm]}", "tip: {at: [400 mm, 0 mm]}\n    mid: {at: [200 mm, 0 mm]}")


@pytest.mark.parametrize(
    ("wanted", "thick", "wide"),
    [
        ("{thickness: 2 mm}", (1.0, 2.0), (100.0, 200.0)),
        ("{thickness: 4 mm, width: 100 mm}", (2.0, 4.0), (50.0, 100.0)),
    ],
)
def test_the_largest_thickness_and_width_of_all_beams_are_those_asked_for(wanted, thick, wide):
    changes = (TWO, MID, ("analysis:", RESCALE.format(wanted)))
    about = cfmkit.design(cantilever(*changes)).spec.mechanism
    assert (about.thickness, about.beams["other"].thickness) == pytest.approx([one * MM for one in thick])
    assert (about.width, about.beams["other"].width) == pytest.approx([one * MM for one in wide])


def test_equation_6_compares_the_moduli_of_the_beams():
    own = ("end: tip}", "end: tip, material: {youngs_modulus: 1 GPa}}")
    changes = (own, ("points: 21", "points: 21\n  fidelity: extensible"))
    design = cfmkit.design(cantilever(*changes, ("analysis:", RESCALE.format("{material: {youngs_modulus: 3 GPa}}"))))
    assert design.message == "rescaled: E 1000 MPa -> 3000 MPa"
    assert "rescale_approximate" not in warned(design)


def test_pads_frame_and_holes_keep_their_places_in_a_part_of_another_size():
    """The hole is that of a screw, whatever the size."""
    part = "part: {fillet: 0 mm, pad: [12 mm, 10 mm], holes: [{at: [-6 mm, 0 mm], diameter: 4 mm}], "
    frame = "frame: {ground: 5 mm, clearance: 3 mm, inside: [[-20 mm, -150 mm], [450 mm, 50 mm]]}}"
    large = ("analysis:", RESCALE.format("{size: 800 mm, thickness: 2 mm}"))
    spec = cantilever(("width: 100 mm", f"width: 100 mm\n  {part}{frame}"), large)
    made = cfmkit.design(spec).spec
    drawn = [cfmkit.drawing(part) for part in (spec, made)]
    small, big = (np.array([one.extents for one in part.contours if one.layer == "cut"]) for part in drawn)
    screw = np.array([4, 4, -4, -4]) * 0.5 * MM
    assert len(small) == 3
    np.testing.assert_allclose(big[:2], 2 * small[:2], atol=1e-5)
    np.testing.assert_allclose(big[2], 2 * small[2] + screw, atol=1e-5)
    assert made.mechanism.part.holes[0].at == pytest.approx((-12 * MM, 0.0))
    assert made.mechanism.part.holes[0].diameter == 4 * MM
    assert made.mechanism.part.fillet == 0
    assert warned(drawn[1]).keys() <= warned(drawn[0]).keys()


TO_STRESS = ("analysis:", "design: {rescale: {to_allowable_stress: true}}\nanalysis:")


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ([("travel: 100 mm", "travel: 10 mm")], "one, 50 MPa, within a travel of 145.5 mm: state a longer"),
        ([("travel: 100 mm", "travel: 700 mm\n  fidelity: extensible"), ("50 MPa", "90 GPa"),
          ("thickness: 1 mm", "thickness: 20 mm")], "within a travel of 1094 mm, and a longer one would tear beams"),
        ([("50 MPa", "90 GPa")], "before the path ends: the beams are taut at 400 mm"),
    ],
)  # fmt: skip
def test_a_stress_that_is_not_reached_gives_no_travel(changes, words):
    """It gave the last travel that was looked at, 14.6 times the one of the specification."""
    design = cfmkit.design(cantilever(TO_STRESS, *changes))
    assert design.status is Status.INFEASIBLE
    assert design.spec is None
    assert words in design.message


def test_a_stress_may_be_reached_on_a_travel_longer_than_the_one_given_whatever_its_window():
    window = ("travel: 100 mm", "travel: 40 mm\n  window: [5 mm, 500 mm]")
    design = cfmkit.design(cantilever(TO_STRESS, window, ("50 MPa", "5 MPa")))
    end = design.spec.analysis.travel
    assert 145 * MM < end < 200 * MM
    assert value(cfmkit.analyze(design.spec), "safety_factor") == pytest.approx(1, abs=1e-3)
    assert design.spec.analysis.window[1] == end


def test_a_design_without_a_task_says_what_to_add():
    design = cfmkit.design(config("beam_lan2010"))
    assert design.status is Status.INVALID
    assert "rescale" in design.message


def test_a_network_without_any_equilibrium_cannot_be_rescaled():
    design = cfmkit.design(config("beam_rescaled", "mechanism.nodes.n4.at=[12.44 mm, 2.4e10 mm]"))
    assert design.status in (Status.NO_EQUILIBRIUM, Status.INFEASIBLE)
    assert design.spec is None
