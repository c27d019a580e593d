"""Leaves and spring as drawn, as planar solids: what beams give where parts are slender, and what they leave out."""

from __future__ import annotations

import numpy as np
import pytest

import cfmkit
from cfmkit import api
from cfmkit.families import family
from cfmkit.families.vcfm.outline import sharp_corners
from cfmkit.families.vcfm.part import solved_leaf, solved_spring
from cfmkit.results import Status
from cfmkit.solid import SolidProblem

QUICK = ("analysis.solid.poses=15", "analysis.solid.error=0.1", "analysis.points=121", "analysis.fidelity=solid")


def spec(name, *changes):
    return cfmkit.load(f"configs/vcfm_{name}.yaml", list(changes))


@pytest.fixture(scope="module")
def straight():
    """Four paths on three meshes: two seconds, the least in which a mechanism can be had; and the same as beams."""
    return {
        "solid": api.analyze(spec("straight", *QUICK, "analysis.preloads=[0 mm, 0.5 mm]")),
        "exact": api.analyze(spec("straight", "analysis.fidelity=exact", "analysis.points=121")),
    }


def test_slender_leaves_are_as_stiff_as_beams_and_buckle_where_they_do(straight):
    solid, exact = (straight[name].values for name in ("solid", "exact"))
    assert straight["solid"].status is Status.COMPLETE
    assert solid["first_stiffness"].value == pytest.approx(exact["first_stiffness"].value, rel=0.01)
    assert solid["linear_start"].value == pytest.approx(exact["linear_start"].value, rel=0.02)
    assert solid["linear_end"].value == pytest.approx(exact["linear_end"].value, rel=0.02)


def test_fillets_make_leaves_and_spring_a_few_percent_stiffer(straight):
    for name in ("negative_stiffness", "positive_stiffness"):
        solid, exact = (straight[model].values[name].value for model in ("solid", "exact"))
        assert 1.01 < solid / exact < 1.06


def test_a_preload_moves_the_spring_only(straight):
    nominal, pressed = straight["solid"].curves
    sampler = straight["solid"].state.sampler
    at = np.linspace(0.5e-3, 4e-3, 7)
    more = sampler.spring(at + 0.5e-3)[0] - sampler.spring(at)[0]
    forces = [np.interp(at, one.motion, one.effort) for one in (nominal, pressed)]
    assert forces[1] - forces[0] == pytest.approx(more, rel=1e-3)


def test_each_fillet_of_leaf_and_spring_has_a_row_with_its_place_and_the_preload_of_its_largest_stress(straight):
    result = straight["solid"]
    table = result.tables["fillets"]()
    places = table["place"]
    assert sorted(places) == ["leaf at shuttle"] * 2 + ["leaf at wall"] * 2 + ["spring at block"] * 4
    of = {piece: table["max_stress"][[one.startswith(piece) for one in places]] for piece in ("leaf", "spring")}
    assert 1e6 * of["spring"].max() == pytest.approx(result.values["spring_stress_max"].value, rel=1e-9)
    assert 1e6 * of["leaf"].max() <= result.values["bistable_stress_max"].value
    # the spring is bent most at the larger preload, at the end of the window; the leaves do not feel the preload
    assert table["preload"].tolist() == [0.5 if one.startswith("spring") else 0.0 for one in places]
    ends = table["displacement"][[one.startswith("spring") for one in places]]
    assert ends == pytest.approx(1e3 * result.state.window[1][0])
    assert "fillets" not in straight["exact"].tables


def test_fillets_of_leaves_and_spring_raise_the_stress_of_the_exact_model_as_those_of_clamped_strips_do(straight):
    """Fillets of half the thickness: 1.2 to 1.3 in bending by the charts of shoulders, 1.3 to 1.6 in tension."""
    result = straight["solid"]
    table = result.tables["fillets"]()
    factor = table["stress_concentration"]
    assert ((factor > 0.9) & (factor < 1.6)).all()
    assert result.values["stress_concentration_max"].value == factor.max()
    worst = int(table["nominal_stress"].argmax())
    assert table["place"][worst] == "spring at block"
    pressed = 1e-3 * (table["displacement"] + table["preload"])[worst]
    at_its_end = straight["exact"].state.sampler.spring(np.array([pressed]))[1][0]
    assert 0.8 * at_its_end < 1e6 * table["nominal_stress"][worst] < at_its_end  # more than the radius from there
    assert straight["exact"].values["stress_concentration_max"].value is None


def test_the_curve_is_stable_and_its_stress_map_is_drawn(straight):
    assert straight["solid"].curve.stable.all()
    figure = api.figures(straight["solid"])["stress_map"]()
    assert len(figure.axes) == 3


def test_a_column_says_which_points_of_the_curve_are_poses_of_both_parts(straight):
    """The rest, where both begin, and the end, where both end; with a preload the spring's last pose is another."""
    nominal, pressed = straight["solid"].curves
    solved = nominal.extra["solved"].values
    poses = straight["solid"].state.sampler.pushed.solved.course.travel
    assert solved[0] == "yes"
    assert set(solved) == {"yes", "between"}
    for travel in nominal.motion[solved == "yes"]:
        assert np.abs(poses - travel).min() < 1e-9 * poses.max()
    assert pressed.extra["solved"].values[-1] == "yes"
    assert "solved" not in straight["exact"].curve.extra


@pytest.mark.parametrize("positive", ["diamond", "folded", "straight", "u-shape"])
@pytest.mark.parametrize("leaf", ["v-beam", "cosine", "hybrid"])
def test_what_is_solved_is_a_part_of_what_is_drawn(leaf, positive):
    """Its fillets and edges are those of the drawing: every arc of it stands in the drawing, moved up or down."""
    made = spec(
        "ding2022", f"mechanism.bistable.structure={leaf}", f"mechanism.positive.structure={positive}",
        "mechanism.bistable.flexure_length=5 mm", "mechanism.positive.radius=4 mm",
    )  # fmt: skip
    arcs = [edge for contour in api.drawing(made).contours for edge in contour.edges if hasattr(edge, "radius")]
    places = np.array([edge.center[0] for edge in arcs])
    for piece in (solved_leaf(made), solved_spring(made)):
        own = [edge for edge in piece.contour.edges if hasattr(edge, "radius")]
        assert len(own) >= 2
        for edge in own:
            assert np.abs(places - edge.center[0]).min() < 1e-9


def test_sharp_corners_are_told_and_a_mesh_that_is_too_large_for_the_machine_is_one_line(monkeypatch):
    found = api.analyze(spec("straight", *QUICK, "mechanism.part.fillet=0 mm", "analysis.travel=0.3 mm"))
    assert "sharp_corners" in [warning.name for warning in found.warnings]
    monkeypatch.setattr("cfmkit.solid.mesh.MOST_NODES", 100)
    found = api.analyze(spec("straight", *QUICK))
    assert found.status is Status.NO_EQUILIBRIUM
    assert found.message.startswith("the part cannot be meshed: the mesh would have more than 100 nodes")


def test_corners_that_no_fillet_fits_are_told_where_the_stress_is_read():
    assert sharp_corners(spec("straight", "mechanism.part.fillet=1 mm")) == ()
    notes = sharp_corners(spec("straight", "mechanism.part.fillet=3 mm"))
    assert notes[0].startswith("no fillet of 3 mm fits the inside corner at (28, ")
    assert len(notes) == 6


def test_leaves_with_fillets_of_ten_micrometres_are_meshed():
    """A seam along the face of the shuttle had a point on the edge itself, and the part was refused."""
    leaf = family("vcfm").elastic.solids(spec("ding2022", "analysis.fidelity=solid", "mechanism.part.fillet=0.01 mm"))[
        0
    ]
    grid = leaf.part.create_mesh().refine()[0].problem.elements.mesh
    assert grid.area == pytest.approx(sum(ring.area for ring in leaf.part.rings), rel=1e-9)


def test_ends_of_windows_are_poses_of_leaf_and_spring():
    made = spec("ding2022", "analysis.fidelity=solid", "analysis.window=[1.3 mm, 4.3 mm]", "analysis.preloads=[0.5 mm]")
    leaf, spring = family("vcfm").elastic.solids(made)
    for place in (1.3e-3, 4.3e-3):
        assert np.abs(np.array(leaf.stops) - place).min() < 1e-12
        assert np.abs(np.array(spring.stops) - 0.5 * (0.5e-3 + place)).min() < 1e-12


def test_a_leaf_whose_solver_stops_at_once_has_no_curve(monkeypatch):
    solve = SolidProblem.solve
    monkeypatch.setattr(
        SolidProblem, "solve", lambda self, start, travel, *_: None if travel else solve(self, start, travel)
    )
    found = api.analyze(spec("straight", *QUICK))
    assert found.status is Status.NO_EQUILIBRIUM
    assert not found.curves
    assert found.message.startswith("no curve: ")


def test_fillets_that_make_cuts_cross_are_refused_before_a_mesh_is_made():
    """At once: with radii of 200 mm the rigid walls alone had a hundred thousand nodes."""
    result = api.analyze(spec("ding2022", "analysis.fidelity=solid", "mechanism.part.fillet=200 mm"))
    assert result.status is Status.NO_EQUILIBRIUM
    assert "cross or touch at" in result.message


@pytest.mark.slow
def test_a_corner_that_the_mesh_rounds_is_the_end_of_the_linear_range():
    """The buckled path of a leaf on a mesh joins the straight one over a 500th of the travel: it was not seen."""
    solid, exact = (api.analyze(spec("ding2022", f"analysis.fidelity={model}")).values for model in ("solid", "exact"))
    assert solid["linear_end"].value == pytest.approx(exact["linear_end"].value, rel=0.02)
    assert solid["negative_stiffness"].value == pytest.approx(exact["negative_stiffness"].value, rel=0.03)
