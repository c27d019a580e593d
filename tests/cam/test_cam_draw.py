"""Pictures of the cam: parts to scale where the mechanism has them, and everything readable."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.patches import Circle

import cfmkit
from cfmkit.families.cam.figures import draw_mechanism, figures, regions
from cfmkit.families.cam.part import scene, start_curve, surface, swallowtail

CONFIGS = Path(__file__).parents[2] / "configs"
CAM = CONFIGS / "cam.yaml"
PART = ["mechanism.profile.rest_half_width=68 mm", "mechanism.profile.roller_radius=16 mm"]
VARIANTS = {
    "published": [],
    "no undercut": ["mechanism.roller_radius=10 mm"],
    "gravity": ["analysis.gravity=true"],
    "friction": ["mechanism.rolling_friction=0.05"],
    "no friction": ["mechanism.rolling_friction=0"],
    "six springs": ["mechanism.springs.count=6"],
    "long springs": ["mechanism.rest_half_width=70 mm", *PART],
    "short springs": ["mechanism.rest_half_width=67.5 mm", *PART],
    "other roller": ["mechanism.roller_radius=17 mm", "mechanism.profile.offset=0.3 mm", *PART],
    "material missing": ["mechanism.profile.offset=-1 mm"],
    "ends early": ["analysis.travel=300 mm"],
    "flat": [
        "mechanism.profile.force_constant=60 mm",
        "mechanism.profile.stroke=20 mm",
        "analysis.window=[2 mm, 20 mm]",
    ],
    "brace too short": ["mechanism.brace_length=90 mm", "mechanism.profile.stroke=30 mm"],
    "from the slider": ["analysis.origin=slider"],
}


def solved(name):
    return cfmkit.analyze(cfmkit.load(CAM, VARIANTS[name]))


def small_and_large():
    """Yield the published design a hundred times smaller and larger, with forces to match."""
    for factor in (0.01, 100.0):
        spec = cfmkit.load(CAM)
        lengths = ("brace_length", "rest_half_width", "roller_radius", "profile.force_constant", "profile.stroke")
        changes = {f"mechanism.{name}": factor * spec.get_value(f"mechanism.{name}") for name in lengths}
        plate = {"top_margin": 0.01 * factor, "base_height": 0.04 * factor, "hole_diameter": 0.0066 * factor}
        changes |= {"mechanism.plate": plate, "requirements": (), "analysis.window": (0.002 * factor, 0.24 * factor)}
        changes |= {"mechanism.springs.stiffness": factor * spec.get_value("mechanism.springs.stiffness")}
        yield cfmkit.analyze(spec.replace(changes))


def drawn(result, index=0):
    """Return the axes of the mechanism at one point, and its named artists."""
    ax = draw_mechanism(result.state, index, Figure(figsize=(4, 6)).add_axes((0.15, 0.08, 0.8, 0.83)))
    named = {artist.get_gid(): artist for artist in ax.get_children() if artist.get_gid()}
    return ax, named


PLACES = [0, 1, 2, 5, 240, -1]


def exact_flank(solution):
    profile = solution.assembly.profile
    u = profile.start + (profile.end - profile.start) * np.linspace(0.0, 1.0, 4001) ** 2
    offset = solution.assembly.spec.mechanism.profile.offset - profile.roller_radius
    return np.column_stack(profile.offset_points(u, offset))


def test_with_material_missing_the_pictures_show_the_corner_and_the_plate_as_cut():
    """The flank is the line 17 mm from the path without what lies nearer to any of its points."""
    result = solved("material missing")
    solution, path = result.state, result.state.assembly.profile.path
    u = np.linspace(0.068, 0.08, 2001)
    line = np.column_stack(solution.assembly.profile.offset_points(u, -0.017))
    centers = np.column_stack([u, path.height(u)])
    nearest = np.array([np.hypot(*(centers - point).T).min() for point in line])
    first = line[np.argmax(nearest > 0.017 - 1e-9)]
    np.testing.assert_allclose(surface(solution)[0], first, atol=1e-5)
    np.testing.assert_allclose(surface(solution)[0], swallowtail(solution)[-1], atol=1e-12)
    plate = scene(solution).plate[0]
    assert np.hypot(*(plate - first).T).min() < 1e-5
    _, named = drawn(result)  # the roller stands on the corner
    center, touch = np.array(named["roller-right"].center) / 1e3, named["contact-right"].get_xydata()[0] / 1e3
    np.testing.assert_allclose(touch, first, atol=1e-5)
    assert np.hypot(*(touch - center)) == pytest.approx(0.016, abs=1e-9)


GEOMETRY = ["published", "no undercut", "long springs", "other roller", "brace too short"]


@pytest.mark.parametrize("name", GEOMETRY)
def test_rollers_touch_the_cam_at_the_contact_and_never_enter_it(name):
    result = solved(name)
    solution = result.state
    radius, offset = (result.spec.get_value(f"mechanism.{name}") for name in ("roller_radius", "profile.offset"))
    flank = exact_flank(solution)
    for index in PLACES:
        _, named = drawn(result, index)
        circle, touch = named["roller-right"], np.array(named["contact-right"].get_xydata()[0]) / 1e3
        center = np.array(circle.center) / 1e3
        assert circle.radius / 1e3 == pytest.approx(radius, rel=1e-12)
        assert np.hypot(*(touch - center)) == pytest.approx(radius, abs=1e-9)
        if solution.states.on_corner[index]:
            corner = np.array(solution.assembly.profile.corner.point)
            assert np.hypot(*(touch - corner)) == pytest.approx(offset, abs=1e-9)
        else:
            u = float(solution.states.parameter[index])
            on_flank = solution.assembly.profile.offset_points(u, offset - solution.assembly.profile.roller_radius)
            np.testing.assert_allclose(touch, on_flank, atol=1e-9)
        assert np.hypot(*(flank - center).T).min() > radius - 1e-9
        on_line = np.hypot(*(named["flank-right"].get_xydata() / 1e3 - center).T).min()
        assert on_line == pytest.approx(radius, abs=6e-5 + offset * solution.states.on_corner[index])


@pytest.mark.parametrize("name", ["published", "no undercut", "other roller"])
def test_the_name_of_the_roller_path_stands_beside_the_cam_not_on_it(name):
    figure = figures(solved(name))["mechanism"]()
    ax = figure.axes[-1]
    (text,) = [text for text in ax.texts if text.get_text().split() == ["roller", "path"]]
    (plate,) = [artist for artist in ax.get_children() if artist.get_gid() == "plate"]
    outline = plate.get_path().transformed(plate.get_transform())
    assert not outline.intersects_bbox(text.get_window_extent())


@pytest.mark.parametrize("name", GEOMETRY)
def test_braces_have_their_length_and_meet_in_the_slider_at_its_travel(name):
    result = solved(name)
    solution = result.state
    for index in PLACES:
        _, named = drawn(result, index)
        for side in ("left", "right"):
            (x0, y0), (x1, y1) = named[f"brace-{side}"].get_xydata()
            assert np.hypot(x1 - x0, y1 - y0) / 1e3 == pytest.approx(solution.assembly.track.brace_length, abs=1e-9)
            np.testing.assert_allclose((x1, y1), named[f"roller-{side}"].center, atol=1e-6)
            travel = y0 / 1e3 - solution.assembly.track.start
            assert (x0, travel) == (0.0, pytest.approx(float(solution.travel[index]), abs=1e-9))
        box = named["slider"].get_bbox()
        assert 0.5 * (box.x0 + box.x1) == pytest.approx(0.0, abs=1e-9)
        assert 0.5 * (box.y0 + box.y1) == pytest.approx(y0)


def test_the_left_half_mirrors_the_right():
    _, named = drawn(solved("published"), 100)
    for part in ("flank", "path", "brace"):
        left, right = (np.array(named[f"{part}-{side}"].get_xydata()) for side in ("left", "right"))
        np.testing.assert_array_equal(left * [-1.0, 1.0], right)
    assert named["roller-left"].center == (-named["roller-right"].center[0], named["roller-right"].center[1])


def test_the_spring_joins_the_rollers():
    _, named = drawn(solved("published"), 50)
    points = named["spring"].get_xydata()
    np.testing.assert_allclose([points[0], points[-1]], [named["roller-left"].center, named["roller-right"].center])
    assert len(points) > 20


@pytest.mark.parametrize("name", ["published", "flat"])
def test_one_millimetre_is_as_long_across_as_up(name):
    ax, _ = drawn(solved(name))
    ax.apply_aspect()
    (x0, y0), (x1, y1) = ax.transData.transform([(0.0, 0.0), (10.0, 10.0)])
    assert x1 - x0 == pytest.approx(y1 - y0, rel=1e-9)


@pytest.mark.parametrize("name", ["published", "no undercut", "flat"])
def test_everything_that_moves_stays_in_the_picture(name):
    result = solved(name)
    left, bottom, right, top = 1e3 * np.array(scene(result.state).box)
    for index in (0, -1):
        ax, named = drawn(result, index)
        assert (*ax.get_xlim(), *ax.get_ylim()) == pytest.approx((left, right, bottom, top))
        for artist in named.values():
            if isinstance(artist, Circle):
                (x, y), radius = artist.center, artist.radius
                assert left < x - radius < x + radius < right
                assert bottom < y - radius < y + radius < top


def test_the_plate_is_the_part_that_is_cut_with_its_holes():
    result = solved("published")
    _, named = drawn(result)
    path = named["plate"].get_path()
    outlines = path.to_polygons(closed_only=False)
    drawing = cfmkit.drawing(result.spec)
    assert len(outlines) == sum(contour.layer == "cut" for contour in drawing.contours)
    low, high = path.vertices.min(axis=0), path.vertices.max(axis=0)
    extents = np.array([contour.extents for contour in drawing.contours if contour.layer == "cut"]) * 1e3
    np.testing.assert_allclose(low, extents[:, :2].min(axis=0))
    np.testing.assert_allclose(high, extents[:, 2:].max(axis=0))
    areas = [float(x @ np.roll(y, -1) - np.roll(x, -1) @ y) for x, y in (np.transpose(item) for item in outlines)]
    assert [area > 0 for area in areas] == [True, False, False, False, False]


def test_there_is_a_picture_of_undercut_only_where_it_is():
    always = {"loop", "mechanism", "curvature", "contact", "springs", "assembly"}
    assert set(figures(solved("published"))) == always | {"undercut"}
    assert set(figures(solved("no undercut"))) == always


def test_a_cam_that_cannot_be_built_has_no_pictures():
    result = cfmkit.analyze(cfmkit.load(CAM, ["mechanism.brace_length=60 mm"]))
    assert not result.curves
    assert cfmkit.figures(result) == {}


def texts_of(figure):
    return [text.get_text() for ax in figure.axes for text in ax.texts]


def test_the_loop_shows_the_theoretical_force_and_the_corner():
    shown = texts_of(figures(solved("published"))["loop"]())
    assert {"4KA = 50 N", "on the corner: first 1.14 mm"} <= set(shown)
    assert "4KA + slider's weight = 51.4 N" in texts_of(figures(solved("gravity"))["loop"]())


def test_what_was_asked_for_and_not_reached_is_shaded():
    solution = solved("ends early").state
    (missing,) = (region for region in regions(solution) if region.text.startswith("the profile ends"))
    assert (missing.start, missing.stop) == (pytest.approx(0.24), pytest.approx(0.3))
    figure = figures(solved("ends early"))["loop"]()
    assert all(ax.get_xlim()[1] >= 300 for ax in figure.axes)


def test_regions_move_with_the_origin_of_the_displacement():
    solution = solved("from the slider").state
    (corner,) = regions(solution)
    assert corner.start == pytest.approx(0.18808508713)
    assert corner.stop - corner.start == pytest.approx(0.00113969652, rel=1e-6)


def test_curvature_starts_at_the_known_radius_and_undercut_ends_where_the_flank_begins():
    ax = figures(solved("published"))["curvature"]().axes[0]
    path = ax.lines[0].get_xydata()
    assert path[0] == pytest.approx([68.0, 10.32836569])
    (region,) = (patch for patch in ax.patches if patch.get_alpha() == 0.12)
    assert (region.get_x(), region.get_x() + region.get_width()) == (68.0, pytest.approx(72.54386863))
    assert {"roller 16 mm", "undercut: the first 1.14 mm of travel", "roller path", "cam"} <= set(texts_of(ax.figure))
    assert ax.get_yscale() == "log"


def test_the_spring_picture_carries_its_limit_and_its_force():
    figure = figures(solved("published"))["springs"]()
    ax, force = figure.axes
    longest = ax.lines[0].get_ydata()[-1]
    assert longest == pytest.approx(131.876, abs=1e-3)
    assert any(text.startswith("required ≤") for text in texts_of(figure))
    assert force.get_ylim()[1] == pytest.approx(1.38 * ax.get_ylim()[1])
    assert force.get_ylabel() == "force of the 2 springs [N]"


def test_the_force_at_the_start_rises_on_the_corner_to_its_known_peak():
    solution = solved("no friction").state
    curve = start_curve(solution, 3e-3, points=4001)
    theory = 4 * 1380 * solution.assembly.profile.path.law.force_constant
    top = int(np.argmax(curve.effort))
    assert curve.effort[0] == 0
    assert curve.effort[top] / theory == pytest.approx(1.063265, abs=1e-6)
    assert curve.motion[top] == pytest.approx(0.47770e-3, abs=1e-6)
    assert curve.effort[4000] / theory == pytest.approx(1.0)


def test_what_undercut_cuts_away_runs_from_the_shifted_start_over_the_cusp_to_the_corner():
    solution = solved("published").state
    tail = swallowtail(solution, 2001)
    np.testing.assert_allclose(tail[0], (0.06256, 0.01504681), atol=1e-7)
    np.testing.assert_allclose(tail[-1], (0.06190084727, 0.01479190103), atol=1e-9)
    np.testing.assert_allclose(surface(solution)[0], tail[-1], atol=1e-12)
    step = np.diff(tail, axis=0)
    turns = np.flatnonzero((step[1:] * step[:-1]).sum(axis=1) < 0)
    assert len(turns) == 1


def all_results():
    yield from ((path.stem, lambda path=path: designed(path)) for path in sorted(CONFIGS.glob("cam*.yaml")))
    yield from ((name, lambda name=name: solved(name)) for name in VARIANTS)
    yield from (("small and large", small_and_large),)


def designed(path):
    spec = cfmkit.load(path)
    return cfmkit.analyze(cfmkit.design(spec).spec if spec.design else spec)


@pytest.mark.parametrize(("name", "make"), [pytest.param(*item, id=item[0]) for item in all_results()])
def test_no_text_is_clipped_or_covers_another(name, make):
    made = make()
    for result in made if not hasattr(made, "curves") else [made]:
        for stem, draw in figures(result).items():
            figure = draw()
            figure.draw_without_rendering()
            assert_texts_are_legible(figure, f"{name} {stem}")


def assert_texts_are_legible(figure, place):
    texts = [*figure.texts, *(text for ax in figure.axes for text in texts_on(ax))]
    boxes = [(text.get_text(), text.get_window_extent()) for text in texts if text.get_visible() and text.get_text()]
    assert len(boxes) > 10
    paper = figure.bbox
    for text, box in boxes:
        assert paper.x0 <= box.x0 < box.x1 <= paper.x1, f"{place}: {text!r} sticks out to a side"
        assert paper.y0 <= box.y0 < box.y1 <= paper.y1, f"{place}: {text!r} sticks out above or below"
    for (text, box), (other, its) in itertools.combinations(boxes, 2):
        assert not box.padded(-1.0).overlaps(its), f"{place}: {text!r} covers {other!r}"


def texts_on(ax):
    yield from ax.texts
    yield ax.title
    for axis, coordinate, limits in ((ax.xaxis, 0, ax.get_xlim()), (ax.yaxis, 1, ax.get_ylim())):
        if axis.get_visible():
            yield from (axis.label, axis.offsetText)
            texts = axis.get_majorticklabels()
            yield from (text for text in texts if min(limits) <= text.get_position()[coordinate] <= max(limits))
