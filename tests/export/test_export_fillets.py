"""Inside corners of exact contours are rounded by the cutter; where no arc fits they stay, and are told."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

import cfmkit
from cfmkit import api
from cfmkit.errors import SpecError
from cfmkit.export.arc_outlines import outlines
from cfmkit.export.contours import Arc, Contour, Drawing, Line, Smooth, polygon
from cfmkit.export.fillets import round_inside_corners

ELL = [(0, 0), (0.04, 0), (0.04, 0.01), (0.01, 0.01), (0.01, 0.03), (0, 0.03)]


def area(contour):
    (found,) = outlines(Drawing("part", (replace(contour, hole=False),)))
    return abs(found.chain.area)


@pytest.mark.parametrize("turned", [1, -1])
def test_only_the_inside_corner_is_rounded_whichever_way_the_contour_runs(turned):
    contour, sharp = round_inside_corners(polygon(ELL[::turned], "cut"), 0.002)
    assert sharp == ()
    assert [edge.radius for edge in contour.edges if isinstance(edge, Arc)] == [0.002]
    assert area(contour) == pytest.approx(area(polygon(ELL, "cut")) + (1 - np.pi / 4) * 0.002**2, rel=1e-9)


def test_arcs_may_use_up_the_lines_beside_them():
    """In a slot as wide as two radii two arcs leave nothing of its ends."""
    slot = polygon([(0, 0), (0.01, 0), (0.01, 0.002), (0, 0.002)], "cut", hole=True)
    contour, sharp = round_inside_corners(slot, 0.001)
    assert sharp == ()
    assert [type(edge) for edge in contour.edges] == [Arc, Line, Arc, Arc, Line, Arc]
    assert area(contour) == pytest.approx(0.01 * 0.002 - (4 - np.pi) * 1e-6, rel=1e-9)


def test_a_step_as_high_as_the_fillet_is_rounded():
    """Its inside corner takes the whole step; the outside corner at the other end is none for a cutter."""
    steps = [(0, 0), (0.03, 0), (0.03, 0.01), (0.02, 0.01), (0.02, 0.011), (0.01, 0.011), (0.01, 0.02), (0, 0.02)]
    contour, sharp = round_inside_corners(polygon(steps, "cut"), 0.001)
    assert sharp == ()
    assert sum(isinstance(edge, Arc) for edge in contour.edges) == 2


def test_all_corners_of_a_square_hole_are_inside_corners():
    hole = polygon([(0, 0), (0.01, 0), (0.01, 0.01), (0, 0.01)], "cut", hole=True)
    contour, _ = round_inside_corners(hole, 0.001)
    assert sum(isinstance(edge, Arc) for edge in contour.edges) == 4
    assert area(contour) == pytest.approx(1e-4 - (4 - np.pi) * 1e-6, rel=1e-9)


def test_a_fillet_between_a_line_and_a_smooth_edge_is_tangent_to_both():
    """A circle of 30 mm stands on a line: the arc touches both where two circles and a line touch."""
    radius, fillet = 0.03, 0.002
    turn = np.linspace(-0.5 * np.pi + 0.6, 0.5 * np.pi, 400)  # from the floor up to the top
    floor = float(radius * np.sin(turn[0]))
    points = radius * np.column_stack([np.cos(turn), np.sin(turn)])
    smooth = Smooth(points[::-1], np.column_stack([np.sin(turn), -np.cos(turn)])[::-1])
    low, far = (float(points[0, 0]), floor), (0.05, floor)
    corners = [far, (0.05, floor - 0.01), (0.0, floor - 0.01), (0.0, radius)]
    lines = [Line(low, far), *(Line(a, b) for a, b in pairwise(corners))]
    contour, sharp = round_inside_corners(Contour((smooth, *lines), "cut", closed=True), fillet)
    (arc,) = (edge for edge in contour.edges if isinstance(edge, Arc))
    assert sharp == ()
    assert arc.center[1] == pytest.approx(floor + fillet, abs=1e-9)
    assert np.hypot(*arc.center) == pytest.approx(radius + fillet, abs=1e-9)  # not on chords of 0.2 mm
    assert len(outlines(Drawing("part", (contour,)))) == 1  # edges meet, nothing crosses


def test_curved_leaves_with_fillets_are_drawn_within_a_small_tolerance():
    """Where a fillet ended on a chord there was a corner of 0.66 um beside it, and 0.5 um were refused."""
    drawing = api.drawing(cfmkit.load("configs/vcfm_cosine.yaml"))
    assert any(isinstance(edge, Smooth) for contour in drawing.contours for edge in contour.edges)
    assert outlines(drawing, 5e-8)


def test_a_corner_that_no_fillet_fits_stays_and_its_place_is_told():
    contour, sharp = round_inside_corners(polygon(ELL, "cut"), 0.025)
    assert contour.edges == polygon(ELL, "cut").edges
    assert sharp == (0.01 + 0.01j,)
    spec = cfmkit.load("configs/vcfm_hybrid.yaml", ["mechanism.part.fillet=3 mm"])
    notes = [note for note in api.drawing(spec).notes if "fillet" in note]
    assert notes[0].startswith("no fillet of 3 mm fits the inside corner at (")


def test_a_sheet_names_the_widths_that_are_not_its_thickness():
    reported = r"the sheet is 6 mm, but 'mechanism\.positive\.width' is 10 mm: make them equal"
    with pytest.raises(SpecError, match=reported):
        cfmkit.load("configs/vcfm_ding2022.yaml", ["mechanism.part.sheet=6 mm"])
    cfmkit.load("configs/beam_lan2010.yaml", ["mechanism.part.sheet=10 mm"])


def test_holes_of_the_fixing_pattern_are_cut_and_must_lie_in_the_part():
    hole = "mechanism.part.holes=[{at: [-10 mm, -6 mm], diameter: 3 mm}]"
    plain, drilled = (api.drawing(cfmkit.load("configs/slider_crank_strip.yaml", one)) for one in ([], [hole]))
    assert len(drilled.contours) == len(plain.contours) + 1
    outside = cfmkit.load(
        "configs/slider_crank_strip.yaml", ["mechanism.part.holes=[{at: [0 mm, 90 mm], diameter: 3 mm}]"]
    )
    with pytest.raises(cfmkit.errors.GeometryError, match=r"is a hole at .*, outside every cut contour"):
        cfmkit.export(outside)


@pytest.mark.parametrize("name", ["beam_lan2010", "vcfm_ding2022", "slider_crank_strip"])
@pytest.mark.parametrize(
    ("given", "radius"),
    [
        (["process=laser"], 0.1e-3),
        (["process=mill"], 1e-3),
        (["process={least_radius: 0.3 mm}"], 0.3e-3),
        (["process={name: laser, least_radius: 0.3 mm}"], 0.3e-3),
        (["process={position: 0.1 mm}"], None),
        (["process=laser", "fillet=0 mm"], 0.0),
        (["sheet=null"], None),
    ],
)
def test_inside_corners_have_the_smallest_radius_of_the_process_unless_it_is_given(name, given, radius):
    spec = cfmkit.load(f"configs/{name}.yaml", ["mechanism.part={}", *(f"mechanism.part.{one}" for one in given)])
    usual = 0.5 * spec.mechanism.thinnest
    assert spec.mechanism.fillet == pytest.approx(usual if radius is None else radius)


def test_a_fillet_follows_the_process_that_is_set_later():
    spec = cfmkit.load("configs/vcfm_ding2022.yaml", ["mechanism.part={process: laser}"])
    milled = spec.replace({"mechanism.part.process": "mill"})
    radii = {
        edge.radius for contour in api.drawing(milled).contours for edge in contour.edges if hasattr(edge, "radius")
    }
    assert max(radii) == pytest.approx(1e-3)
    assert min(radii) == pytest.approx(1e-3)
