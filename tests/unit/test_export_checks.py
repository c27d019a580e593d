"""Outlines that cannot be cut are refused, with the place."""

import itertools

import numpy as np
import pytest

import cfmkit
from cfmkit.errors import GeometryError, InputError
from cfmkit.export.arc_outlines import outlines
from cfmkit.export.contours import Arc, Contour, Drawing, Line, Smooth, circle, polygon

SQUARE = polygon([(0, 0), (0.1, 0), (0.1, 0.1), (0, 0.1)], "cut")


def drawn(*contours):
    return outlines(Drawing("part", contours))


def test_edges_that_do_not_meet_are_refused_with_both_places():
    contour = Contour((Line((0, 0), (0.1, 0)), Line((0.1, 2e-9), (0, 0.1))), "cut")
    with pytest.raises(GeometryError, match=r"edge 2 begins at \(100, 2e-06\) mm, but edge 1 ends at \(100, 0\) mm"):
        drawn(contour)


def test_rounding_between_edges_is_no_gap():
    assert len(drawn(Contour((Line((0, 0), (0.1, 0)), Line((0.1, 5e-10), (0, 0.1))), "cut"))) == 1


def test_a_closed_contour_that_does_not_close_is_refused():
    with pytest.raises(GeometryError, match=r"not closed: it begins at \(0, 0\) mm and ends at \(100, 100\) mm"):
        drawn(Contour((Line((0, 0), (0.1, 0)), Line((0.1, 0), (0.1, 0.1))), "cut", closed=True))


def test_a_contour_that_crosses_itself_is_refused_with_the_place():
    with pytest.raises(GeometryError, match=r"contour 1 on layer 'cut' crosses or touches itself at \(50, 50\) mm"):
        drawn(polygon([(0, 0), (0.1, 0.1), (0.1, 0), (0, 0.1)], "cut"))


def test_an_arc_that_reaches_over_a_line_is_a_crossing():
    bump = Arc((0.05, 0.0), 0.02, np.pi, 0.0)
    edges = (Line((0, 0), (0.03, 0)), bump, Line((0.07, 0), (0.1, 0)), Line((0.1, 0), (0.1, 0.015)))
    low, high = (
        Contour(
            (*edges[:3], Line((0.1, 0), (0.1, top)), Line((0.1, top), (0, top)), Line((0, top), (0, 0))), "cut", True
        )
        for top in (0.0199, 0.0201)
    )
    assert len(drawn(high)) == 1
    with pytest.raises(GeometryError, match="crosses or touches itself"):
        drawn(low)


def test_an_open_cut_that_crosses_itself_is_refused_but_a_path_may():
    points = [(0, 0), (0.1, 0.1), (0.1, 0), (0, 0.1)]
    lines = tuple(Line(a, b) for a, b in itertools.pairwise(points))
    assert len(drawn(Contour(lines, "path"))) == 1
    with pytest.raises(GeometryError, match=r"at \(50, 50\) mm"):
        drawn(Contour(lines, "cut"))


def test_a_hole_through_the_edge_is_refused():
    with pytest.raises(GeometryError, match=r"contour 1 on layer 'cut' and contour 2 .* cross or touch at \(\d+"):
        drawn(SQUARE, circle((0.1, 0.05), 0.01, "cut", hole=True))


def test_a_hole_beside_the_part_is_refused():
    with pytest.raises(GeometryError, match="outside every cut contour"):
        drawn(SQUARE, circle((0.2, 0.05), 0.01, "cut", hole=True))


def test_a_hole_in_a_hole_is_refused():
    holes = (circle((0.05, 0.05), radius, "cut", hole=True) for radius in (0.01, 0.02))
    with pytest.raises(GeometryError, match=r"the holes contour 2 .* and contour 3 .* touch or overlap, at \("):
        drawn(SQUARE, *holes)


def test_two_parts_on_one_sheet_are_fine():
    other = polygon([(0.2, 0), (0.3, 0), (0.3, 0.1)], "cut")
    assert len(drawn(SQUARE, other, circle((0.05, 0.05), 0.01, "cut", hole=True))) == 3


def test_points_too_coarse_for_the_tolerance_are_refused_with_contour_and_place():
    a = np.linspace(0, np.pi, 12)
    edge = Smooth(np.column_stack([0.1 * np.cos(a), 0.02 * np.sin(a)]), tangents(-0.1 * np.sin(a), 0.02 * np.cos(a)))
    with pytest.raises(
        GeometryError,
        match=r"contour 2 on layer 'path', edge 1, near \(-?\d+.*\) mm: .*too far apart.*tolerance 0.005 mm",
    ):
        drawn(SQUARE, Contour((edge,), "path"))


def tangents(x, y):
    return np.column_stack([x, y]) / np.hypot(x, y)[:, None]


def test_a_line_without_length_is_left_out():
    contour = Contour((Line((0, 0), (0.1, 0)), Line((0.1, 0), (0.1, 0)), Line((0.1, 0), (0, 0.1))), "cut")
    assert len(drawn(contour)[0].chain.bulges) == 2


@pytest.mark.parametrize(
    "edge", [Arc((0, 0), -1.0, 0, 1), Arc((0, 0), 1.0, 2.0, 2.0), Arc((0, 0), 1.0, 0, 7), Arc((0, 0), 0.0, 0, 1)]
)
def test_arcs_that_are_none_are_refused(edge):
    with pytest.raises(GeometryError, match="an arc needs a radius above zero"):
        drawn(Contour((edge,), "path"))


def test_points_that_are_not_finite_are_refused():
    with pytest.raises(GeometryError, match="not finite"):
        drawn(Contour((Line((0, 0), (np.inf, 0)),), "path"))


@pytest.mark.parametrize("contours", [(), (Contour((), "cut"),), (Contour((Line((1, 1), (1, 1)),), "cut"),)])
def test_a_drawing_of_nothing_is_refused(contours):
    with pytest.raises(GeometryError, match="has no"):
        drawn(*contours)


def test_the_refusal_counts_as_invalid_input():
    assert issubclass(GeometryError, InputError)


# ---- the values themselves


@pytest.mark.parametrize(
    "edge",
    [
        Line((1.0, 2.0), (3.0, 5.0)),
        Arc((1.0, 2.0), 3.0, 0.5, 2.5),
        Smooth(np.array([[0.0, 1.0], [2.0, 3.0]]), np.array([[0.6, 0.8], [0.6, 0.8]])),
    ],
)
def test_edges_reverse_and_mirror_their_ends(edge):
    start, end = edge.ends
    assert edge.reverse().ends == (end, start)
    assert edge.mirror().ends == pytest.approx((-start.conjugate(), -end.conjugate()))


def test_a_mirrored_arc_turns_the_other_way():
    arc = Arc((1.0, 2.0), 3.0, 0.5, 2.5).mirror()
    assert arc.end - arc.start == pytest.approx(-2.0)
    assert arc.center == (-1.0, 2.0)


def test_the_extents_of_a_contour_hold_its_arcs():
    assert circle((1.0, 2.0), 0.5, "cut").extents == (0.5, 1.5, 1.5, 2.5)
    assert SQUARE.extents == (0, 0, 0.1, 0.1)


def test_a_link_of_half_a_nanometre_has_an_eye_that_is_a_circle():
    """It was refused: circles were flattened within 200 nm, and two points are no ring."""
    spec = cfmkit.load("configs/slider_crank_li2019.yaml", ["mechanism.coupler_length=5e-7 mm"])
    assert cfmkit.export(spec)["slider-crank.dxf"].count(b"CIRCLE")
