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


CROSSED = [(0, 0), (0.1, 0.1), (0.1, 0), (0, 0.1)]
CROSSED_LINES = tuple(Line(a, b) for a, b in itertools.pairwise(CROSSED))


def hole(x, radius=0.01):
    return circle((x, 0.05), radius, "cut", hole=True)


REFUSED = {
    "edges that do not meet": (
        (Contour((Line((0, 0), (0.1, 0)), Line((0.1, 2e-9), (0, 0.1))), "cut"),),
        r"edge 2 begins at \(100, 2e-06\) mm, but edge 1 ends at \(100, 0\) mm",
    ),
    "a closed contour that does not close": (
        (Contour((Line((0, 0), (0.1, 0)), Line((0.1, 0), (0.1, 0.1))), "cut", closed=True),),
        r"not closed: it begins at \(0, 0\) mm and ends at \(100, 100\) mm",
    ),
    "a contour that crosses itself": (
        (polygon(CROSSED, "cut"),), r"contour 1 on layer 'cut' crosses or touches itself at \(50, 50\) mm",
    ),
    "an open cut that crosses itself": ((Contour(CROSSED_LINES, "cut"),), r"at \(50, 50\) mm"),
    "a hole through the edge": (
        (SQUARE, hole(0.1)), r"contour 1 on layer 'cut' and contour 2 .* cross or touch at \(\d+",
    ),
    "a hole beside the part": ((SQUARE, hole(0.2)), "outside every cut contour"),
    "a hole in a hole": (
        (SQUARE, hole(0.05), hole(0.05, 0.02)), r"the holes contour 2 .* and contour 3 .* touch or overlap, at \(",
    ),
    "points that are not finite": ((Contour((Line((0, 0), (np.inf, 0)),), "path"),), "not finite"),
    **{
        f"an arc that is none, {number}": ((Contour((edge,), "path"),), "an arc needs a radius above zero")
        for number, edge in enumerate((Arc((0, 0), -1.0, 0, 1), Arc((0, 0), 1.0, 2.0, 2.0), Arc((0, 0), 1.0, 0, 7),
                                       Arc((0, 0), 0.0, 0, 1)))
    },
    **{
        f"nothing, {number}": (contours, "has no")
        for number, contours in enumerate(((), (Contour((), "cut"),), (Contour((Line((1, 1), (1, 1)),), "cut"),)))
    },
}  # fmt: skip


@pytest.mark.parametrize(("contours", "reported"), REFUSED.values(), ids=REFUSED)
def test_what_cannot_be_cut_is_refused_as_invalid_input_with_the_place(contours, reported):
    assert issubclass(GeometryError, InputError)
    with pytest.raises(GeometryError, match=reported):
        drawn(*contours)


def test_what_can_be_cut_is_not_refused():
    """Rounding between edges, a path that crosses itself, two parts on one sheet."""
    assert len(drawn(Contour((Line((0, 0), (0.1, 0)), Line((0.1, 5e-10), (0, 0.1))), "cut"))) == 1
    assert len(drawn(Contour(CROSSED_LINES, "path"))) == 1
    assert len(drawn(SQUARE, polygon([(0.2, 0), (0.3, 0), (0.3, 0.1)], "cut"), hole(0.05))) == 3


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
