"""With a kerf, every cut runs half of it beside the part, in the waste; the part's own drawing stays as it is."""

import io
import itertools
import re

import numpy as np
import pytest
import shapely
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from cfmkit.errors import GeometryError
from cfmkit.export import files
from cfmkit.export.arc_outlines import ArcChain, outlines
from cfmkit.export.contours import Arc, Contour, Drawing, Line, Smooth, circle, polygon
from cfmkit.export.kerf import parallel, with_kerf

HALF = 1e-4


def wave(n=900):
    """A smooth edge with both signs of curvature, from (0, 30) to (-100, 30) mm."""
    x = np.linspace(0, -0.1, n)
    y = 0.03 + 0.004 * np.sin(2 * np.pi * x / 0.05)
    slope = 0.004 * 2 * np.pi / 0.05 * np.cos(2 * np.pi * x / 0.05)
    return Smooth(np.column_stack([x, y]), -np.column_stack([np.ones(n), slope]) / np.hypot(1, slope)[:, None])


def part():
    """A comb: wave on top, an inside corner and a small fillet below, a round and a square hole."""
    below = [(-0.1, 0.03), (-0.1, 0.0), (-0.06, 0.0), (-0.06, 0.01), (-0.0402, 0.01)]
    lines = tuple(Line(a, b) for a, b in itertools.pairwise(below))
    fillet = Arc((-0.0402, 0.0098), 0.0002, np.pi / 2, 0.0)
    rest = (Line((-0.04, 0.0098), (-0.04, 0.0)), Line((-0.04, 0.0), (0.0, 0.0)), Line((0.0, 0.0), (0.0, 0.03)))
    return Drawing(
        "comb",
        (
            Contour((wave(), *lines, fillet, *rest), "cut", closed=True),
            circle((-0.02, 0.015), 0.004, "cut", hole=True),
            polygon([(-0.08, 0.012), (-0.07, 0.012), (-0.07, 0.02), (-0.08, 0.02)], "cut", hole=True),
            Contour((Line((-0.1, 0.05), (0.0, 0.05)),), "path"),
        ),
    )


def ring(outline, sagitta=2e-8):
    points = outline.chain.flatten(sagitta)
    return shapely.LinearRing(np.column_stack([points.real, points.imag]))


def gaps(track, source):
    """Distances of many points of one ring from another."""
    steps = np.linspace(0, track.length, 1500)
    return shapely.distance(shapely.line_interpolate_point(track, steps), source)


@pytest.fixture(scope="module")
def pair():
    plain = outlines(part())
    return plain, with_kerf(plain, 2 * HALF)


@pytest.mark.parametrize("index", [0, 1, 2])
def test_the_cut_runs_half_a_kerf_beside_the_part_everywhere(pair, index):
    distance = gaps(ring(pair[1][index]), ring(pair[0][index]))
    assert np.abs(distance - HALF).max() < 5e-8


def test_outer_contours_grow_and_holes_shrink(pair):
    plain, moved = pair
    sizes = [abs(b.chain.area) / abs(a.chain.area) for a, b in zip(plain[:3], moved[:3], strict=True)]
    assert sizes[0] > 1.001
    assert sizes[1] == pytest.approx((0.0039 / 0.004) ** 2)
    assert sizes[2] == pytest.approx(0.0098 * 0.0078 / (0.01 * 0.008))


def test_arcs_stay_arcs(pair):
    plain, moved = pair
    assert len(moved[0].chain.bulges) <= len(plain[0].chain.bulges) + 6
    assert np.count_nonzero(moved[0].chain.bulges) > 40


def test_what_is_not_cut_stays_where_it_is(pair):
    assert pair[1][3] == pair[0][3]


def test_the_sense_in_which_a_contour_is_drawn_does_not_matter():
    def backwards(contour):
        return Contour(tuple(e.reverse() for e in contour.edges[::-1]), contour.layer, contour.closed, contour.hole)

    turned = Drawing("comb", tuple(backwards(contour) for contour in part().contours))
    areas = [
        [abs(outline.chain.area) for outline in with_kerf(outlines(one), 2 * HALF)[:3]] for one in (part(), turned)
    ]
    np.testing.assert_allclose(areas[0], areas[1], rtol=1e-9)


def test_the_kerf_file_is_a_second_one_and_its_holes_are_circles():
    import ezdxf

    plain, both = files(part()), files(part(), kerf=2 * HALF)
    assert {name: both[name] for name in plain} == plain
    assert set(both) - set(plain) == {"comb-kerf.dxf"}
    document = ezdxf.read(io.StringIO(both["comb-kerf.dxf"].decode()))
    (hole,) = document.query("CIRCLE")
    assert hole.dxf.radius == pytest.approx(3.9)
    outer = next(e for e in document.query("LWPOLYLINE") if e.dxf.layer == "cut")
    assert outer.closed


def test_a_fillet_sharper_than_half_the_kerf_becomes_a_corner():
    moved = with_kerf(outlines(part()), 6e-4)  # the fillet of 0.2 mm is an inside one for the waste
    assert np.abs(gaps(ring(moved[0]), ring(outlines(part())[0])) - 3e-4).max() < 5e-8


def test_a_notch_whose_end_the_cut_cannot_reach_is_followed_as_far_as_it_goes():
    edges = [(0, 0), (0.1, 0), (0.1, 0.05), (0.06, 0.05), (0.05, 0.02), (0.04, 0.05), (0, 0.05)]
    plain = outlines(Drawing("notch", (polygon(edges, "cut"),)))
    moved = with_kerf(plain, 0.004)
    assert np.abs(gaps(ring(moved[0]), ring(plain[0])) - 0.002).max() < 5e-8
    assert len(moved[0].chain.bulges) == 13  # seven sides and a round at each of the six outside corners


def serrated(pitch=1e-4, teeth=40):
    """A plate whose top is a saw of teeth finer than the kerf: its parallel is made of arcs about the tips only."""
    top = [((teeth - n) * pitch / 2 + 0.01, 0.02 + pitch / 2 * (n % 2)) for n in range(teeth + 1)]
    return polygon([(0, 0), (0.03, 0), (0.03, 0.02), *top, (0, 0.02)], "cut")


def test_along_teeth_finer_than_the_kerf_the_cut_runs_about_their_tips():
    plain = outlines(Drawing("saw", (serrated(),)))
    (moved,) = with_kerf(plain, 4e-4)
    assert np.abs(gaps(ring(moved), ring(plain[0])) - 2e-4).max() < 5e-8
    assert np.isclose(1 / moved.chain.curvatures[moved.chain.bulges > 0], 2e-4).sum() >= 20


def test_where_arcs_do_not_do_the_cut_is_a_polyline_within_four_micrometres():
    pocket = [(0.0104, 0.02), (0.0102, 0.019), (0.01035, 0.0185), (0.00965, 0.0185), (0.0098, 0.019), (0.0096, 0.02)]
    plain = outlines(Drawing("pocket", (polygon([(0, 0), (0.03, 0), (0.03, 0.02), *pocket, (0, 0.02)], "cut"),)))
    (moved,) = with_kerf(plain, 8e-4)
    assert not moved.chain.bulges.any()
    assert np.abs(gaps(ring(moved), ring(plain[0])) - 4e-4).max() < 4e-6


# ---- refusals


SQUARE = polygon([(0, 0), (0.1, 0), (0.1, 0.1), (0, 0.1)], "cut")
NEAR = polygon([(0.1001, 0), (0.2, 0), (0.2, 0.1), (0.1001, 0.1)], "cut")
BONE = [(0.01, 0.01), (0.03, 0.01), (0.03, 0.0199), (0.05, 0.0199), (0.05, 0.01), (0.07, 0.01)]
BONE += [(0.07, 0.03), (0.05, 0.03), (0.05, 0.0201), (0.03, 0.0201), (0.03, 0.03), (0.01, 0.03)]
SLOT = [(0, 0), (0.1, 0), (0.1, 0.1), (0.0501, 0.1), (0.0501, 0.08), (0.06, 0.08), (0.06, 0.04)]
SLOT += [(0.04, 0.04), (0.04, 0.08), (0.0499, 0.08), (0.0499, 0.1), (0, 0.1)]
REFUSED = {
    "a hole that would vanish": (
        (SQUARE, circle((0.05, 0.05), 1e-4, "cut", hole=True)), 2e-4,
        "contour 2 on layer 'cut', a hole at (50.1, 50) mm, vanishes with a kerf of 0.2 mm",
    ),
    "a hole that would fall in two": (
        (SQUARE, polygon(BONE, "cut", hole=True)), 3e-4, "hole falls into pieces where it is narrower than the kerf",
    ),
    "a slot that the kerf would close": ((polygon(SLOT, "cut"),), 4e-4, "narrower than the kerf of 0.4 mm"),
    "parts closer than the kerf": (
        (SQUARE, NEAR), 2e-4, "with a kerf of 0.2 mm, contour 1 on layer 'cut' and contour 2 on layer 'cut' cross",
    ),
    **{f"{kerf}": ((SQUARE,), kerf, "the kerf must be a length above zero") for kerf in (0.0, -1e-4, np.nan, np.inf)},
}  # fmt: skip


@pytest.mark.parametrize(("contours", "kerf", "reported"), REFUSED.values(), ids=REFUSED)
def test_what_a_kerf_cannot_cut_is_refused(contours, kerf, reported):
    with pytest.raises(GeometryError, match=re.escape(reported)):
        with_kerf(outlines(Drawing("part", contours)), kerf)


# ---- the parallel chain itself


@settings(deadline=None, max_examples=40)
@given(
    st.lists(st.floats(0.6, 1.4), min_size=5, max_size=9),
    st.lists(st.floats(-0.25, 0.25), min_size=9, max_size=9),
    st.floats(-0.05, 0.05).filter(lambda d: abs(d) > 1e-3),
)
def test_a_parallel_chain_keeps_its_distance(radii, bulges, distance):
    corners = np.array(radii) * np.exp(2j * np.pi * np.arange(len(radii)) / len(radii))
    chain = ArcChain(np.append(corners, corners[0]), np.array(bulges[: len(radii)]))
    points = chain.flatten(5e-7)
    area = shapely.Polygon(np.column_stack([points.real, points.imag]))
    moved = parallel(chain, distance)
    assume(area.is_valid)
    assume(moved is not None)  # the chain has room for the tool
    track = moved.flatten(5e-7)
    apart = shapely.distance(shapely.points(track.real, track.imag), area.exterior)
    assert np.abs(apart - abs(distance)).max() < 2e-6
    assert (moved.area > chain.area) == (distance > 0)
