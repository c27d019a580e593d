"""Derivatives where the thickness has stations and the arc length changes along the parameter of the shape."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import cfmkit.elastica as el
from cfmkit.elastica.model.beam_fits import BeamFits
from cfmkit.elastica.model.shapes import Bent
from cfmkit.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Callable

FINE = el.Control(tolerance=1e-11)
DOWN = el.Displacement("d", -np.pi / 2, np.array([3e-3]))
STATIONS = np.array([0, 0.3, 0.3, 0.75, 1])
THICKNESS = {
    "constant": 1e-3,
    "steps": el.Taper(STATIONS, np.array([1.2, 1.1, 0.8, 0.9, 1.0]) * 1e-3),
    "kink": el.Taper(np.array([0, 0.3, 1]), np.array([1.2, 0.8, 1.1]) * 1e-3),
}
BENDING = (0.05, 0.2, -0.1)


def corner(r: Any) -> el.Polyline:
    return el.Polyline(np.array([[0, 0], [0.03, 0], [0.1, 0]]) + np.array([[0, 0], [0.001, 0.01], [0, 0]]) * r)


def curve(r: Any) -> el.Spline:
    points = np.array([[0, 0], [0.03, 0], [0.07, 0], [0.1, 0]])
    return el.Spline(points + np.array([[0, 0], [0.002, 0.01], [0, 0], [0, 0]]) * r)


SHAPES: dict[str, Callable[[Any], Any]] = {
    "polynomial": lambda r: el.Polynomial((0.0, 0.8 * r, 0.3)),
    "cosine arch": lambda r: el.CosineArch(0.01 * r),
    "half arch": lambda r: el.CosineArch(0.01 * r, 0.5),
    "spline": curve,
    "short spline": lambda r: el.Spline(
        np.array([[0, 0], [0.03, 0], [0.1, 0]]) + np.array([[0, 0], [0, 0.01], [0, 0]]) * r
    ),
    "polyline": corner,
    "bent arch": lambda r: Bent(el.CosineArch(0.01 * r), BENDING),
    "bent spline": lambda r: Bent(curve(r), BENDING),
    "bent polyline": lambda r: Bent(corner(r), BENDING),
}


def one_beam(shape: Callable[[Any], Any], thickness: Any, closure: Any = "rotscale") -> Callable[[Any], el.Network]:
    """A beam by factors: on the size of its shape, the place of its end, its thickness, its first station."""

    def build(x: Any) -> el.Network:
        given = thickness
        if isinstance(given, el.Taper):
            stations = given.stations * np.where(given.stations == given.stations[1], x[3], 1)
            given = el.Taper(stations, given.values * x[2])
        else:
            given = given * x[2]
        nodes = {"a": el.Node(0, 0, el.CLAMPED_SUPPORT), "d": el.Node(0.1 * x[1], 0.02, el.slider_support(np.pi / 2))}
        return el.Network(
            nodes, {"ad": el.Beam("a", "d", el.Section(2e9, 8e-3, given, shear=True), shape(x[0]), closure)}
        )

    return build


def difference(output: Callable[[Any], Any], x: Any, which: int, step: float = 1e-3) -> Any:
    """Return a central difference of fourth order."""
    a, b, c, d = (output(x + k * step * np.eye(len(x))[which]) for k in (-2, -1, 1, 2))
    return (a - 8 * b + 8 * c - d) / (12 * step)


@pytest.mark.parametrize("shape", SHAPES)
def test_derivatives_of_a_stepped_beam_are_those_of_differences(shape: str) -> None:
    build, x = one_beam(SHAPES[shape], THICKNESS["steps"]), np.ones(4)
    found = el.gradient(el.trace(build(x), DOWN, FINE), build, x)
    asked = {
        "effort": (found.effort[0], lambda p: p.effort[-1]),
        "energy": (found.energy[0], lambda p: p.energy[-1]),
        "shape": (found.shape("ad")[0], lambda p: p.shape("ad", -1)),
        "moment": (found.sections("ad").moment[0], lambda p: p.sections("ad").moment[-1]),
        "stress": (found.sections("ad").bending_stress[0], lambda p: p.sections("ad").bending_stress[-1]),
        "extremes": (found.stress_extremes("ad")[0], lambda p: p.stress_extremes("ad").value[-1]),
    }

    def outputs(values: Any) -> Any:
        path = el.trace(build(values), DOWN, FINE)
        return np.concatenate([np.ravel(output(path)) for _, output in asked.values()])

    sizes = np.cumsum([slopes[..., 0].size for slopes, _ in asked.values()])
    for which in (0, 1, 3):
        wanted = np.split(difference(outputs, x, which), sizes[:-1])
        for (name, (slopes, _)), want in zip(asked.items(), wanted, strict=True):
            off = np.abs(slopes[..., which].ravel() - want).max()
            limit = 1e-5 if name == "extremes" else 1e-6  # their places are found on grids
            assert off <= limit * np.abs(want).max(), (name, which, off, np.abs(want).max())


def corner_of_the_polyline() -> float:
    return float(corner(1.0).course(1.0).breaks[1])


def test_a_corner_that_moves_past_a_step_is_refused_and_one_that_stays_with_it_is_not() -> None:
    def built(way: Any) -> tuple[Callable[[Any], el.Network], Any]:
        def shape(r: Any) -> el.Polyline:
            return el.Polyline(np.array([[0, 0], [0.05, 0.01], [0.1, 0]]) + np.array([[0, 0], way, [0, 0]]) * (r - 1))

        build = one_beam(shape, el.Taper(np.array([0, 0.5, 0.5, 1]), np.array([1, 1, 0.8, 0.8]) * 1e-3))
        return lambda x: build([x[0], 1.0, 1.0, 1.0]), np.ones(1)

    build, x = built([0.01, 0.0])
    with pytest.raises(InputError, match="past each other"):
        el.gradient(el.trace(build(x), DOWN), build, x)
    build, x = built([0.0, 0.01])
    found = el.gradient(el.trace(build(x), DOWN, FINE), build, x).effort[0, 0]
    want = difference(lambda values: el.trace(build(values), DOWN, FINE).effort[-1], x, 0)
    assert found == pytest.approx(want, rel=1e-6)


def test_a_step_of_the_thickness_is_moved_as_a_whole() -> None:
    def build(x: Any) -> el.Network:
        steps = el.Taper(np.array([0, 0.5, x[0], 1]), np.array([1, 1, 0.8, 0.8]) * 1e-3)
        return one_beam(corner, steps)(np.ones(4))

    x = np.array([0.5])
    with pytest.raises(InputError, match="must move alike"):
        el.gradient(el.trace(build(x), DOWN), build, x)


def knot_of_the_curve() -> float:
    """The fraction of the arc length at the first inner knot of a spline."""
    fitted = BeamFits(one_beam(curve, 1e-3)(np.ones(4)))["ad"]
    return float(fitted.arc(fitted.course.breaks[1]))


@pytest.mark.parametrize(
    ("shape", "station", "after"),
    [(curve, knot_of_the_curve, 0.8), (curve, knot_of_the_curve, 1.2), (corner, corner_of_the_polyline, 1.2)],
)
def test_a_station_may_lie_where_smooth_pieces_of_the_shape_meet(shape: Any, station: Any, after: float) -> None:
    """A step of the thickness at a knot of a spline, or its kink at either: each moves as it does alone."""
    u = station()
    build = one_beam(shape, el.Taper(np.array([0, u, u, 1]), np.array([1.0, 1.2, after, 1.0]) * 1e-3))
    x = np.ones(4)
    found = el.gradient(el.trace(build(x), DOWN, FINE), build, x).effort[0]
    for which in range(3):
        want = difference(lambda values: el.trace(build(values), DOWN, FINE).effort[-1], x, which)
        assert found[which] == pytest.approx(want, rel=1e-6)
