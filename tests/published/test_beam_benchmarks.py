"""Classical problems of large deflection as specifications of the general mode; digits as their sources print them."""

from __future__ import annotations

import numpy as np
import pytest
from beam_support import MM, cantilever, config, solved, value

import cfmkit
from cfmkit.results import Status

LBF, INCH = 4.4482216152605, 0.0254
UNIT = 0.125
"""EI/L^2 of the cantilever [N]."""

# Mattiasson, Int. J. Numer. Meth. Engng 17 (1981) 145: PL2/EI, w/L, u/L, tip angle
MATTIASSON = [
    (0.2, 0.06636, 0.00265, 0.09964),
    (1.0, 0.30172, 0.05643, 0.46135),
    (2.0, 0.49346, 0.16064, 0.78175),
    (5.0, 0.71379, 0.38763, 1.21537),
    (10.0, 0.81061, 0.55500, 1.43029),
]


@pytest.mark.parametrize(("load", "down", "inward", "turn"), MATTIASSON)
def test_cantilever_of_mattiasson(load, down, inward, turn):
    result = cfmkit.analyze(config("beam_cantilever", f"analysis.force={load * UNIT!r} N", "analysis.points=5"))
    moved = result.state.path.motion("tip")[-1]
    assert value(result, "travel_end") / 0.4 == pytest.approx(down, abs=5.1e-6)
    assert -moved[0] / 0.4 == pytest.approx(inward, abs=5.1e-6)
    assert -moved[2] == pytest.approx(turn, abs=5.1e-6)


@pytest.mark.parametrize(("load", "down", "inward", "turn"), MATTIASSON[1:])
def test_parallel_guiding_beam_is_two_cantilevers_of_half_its_length(load, down, inward, turn):
    """Its middle is an inflection point: the digits are Mattiasson's."""
    spec = cantilever(
        ("tip: {at: [400 mm, 0 mm]}", "tip: {at: [400 mm, 0 mm], support: parallel}"),
        ("kind: displacement, node: tip, direction: -90 deg", "kind: force, node: tip, direction: -90 deg"),
        ("travel: 100 mm", f"force: {4 * load * UNIT} N"),
    )
    path = cfmkit.analyze(spec).state.path
    assert path.motion("tip")[-1] == pytest.approx((-0.4 * inward, -0.4 * down, 0), abs=0.4 * 5.1e-6)
    middle = int(np.abs(path.places("beam") - 0.5).argmin())
    assert -path.states("beam").turn[-1, middle] == pytest.approx(turn, abs=5.1e-6)


def test_lee_frame_snaps_at_its_published_load():
    """18.55 EI/L^2, Lee, Manuel, Rossow, J. Eng. Mech. 94 (1968) 521."""
    result = solved("beam_lee_frame")
    assert value(result, "limit_force") / 0.1 == pytest.approx(18.55, abs=0.02)
    reported = next(item.message for item in result.warnings if item.name == "limit_point")
    assert reported == "limit points at 1.856 N, -0.9421 N"
    assert not result.curve.stable.all()
    path = result.state.path
    assert [(event.before, event.after) for event in path.events] == [(0, 1), (1, 0)]
    assert np.diff(path.motion(result.spec.mechanism.drive.node)[:, 1]).max() > 0, "goes back between the limit points"


def test_lee_frame_by_its_load_alone_ends_at_the_limit_point():
    result = solved("beam_lee_frame", "analysis.through_folds=false")
    assert result.status is Status.PARTIAL
    assert "limit point" in result.message
    assert result.curve.effort[-1] < value(solved("beam_lee_frame"), "limit_force")


def test_williams_toggle_snaps_and_regains_at_the_published_loads():
    """34 and 31 lbf, Williams, Q. J. Mech. Appl. Math. 17 (1964) 451, read to 0.5."""
    result = solved("beam_williams_toggle")
    assert value(result, "peak_force") / LBF == pytest.approx(34, abs=0.5)
    assert value(result, "valley_force") / LBF == pytest.approx(31, abs=0.5)


def test_column_buckles_at_euler_s_load_and_the_stable_branch_is_followed():
    """Clamped-free: pi^2 EI / 4 L^2."""
    column = cantilever(
        ("kind: displacement, node: tip, direction: -90 deg", "kind: force, node: tip, direction: 180 deg"),
        ("travel: 100 mm", "force: 0.4 N"),
    )
    result = cfmkit.analyze(column)
    assert value(result, "bifurcation_force") == pytest.approx(np.pi**2 / 4 * UNIT, rel=1e-6)
    assert result.curve.stable.all()
    assert result.curve.motion[-1] > 10 * MM
    assert value(cfmkit.analyze(column.replace({"analysis.branch": "primary"})), "travel_end") == pytest.approx(0)


@pytest.mark.parametrize("angle", np.array([0.5, 1.0, 2.0]) * np.pi)
def test_cantilever_rolls_into_a_circle_under_a_moment(angle):
    """Its curvature M/EI is the same everywhere."""
    spec = cantilever(
        ("kind: displacement, node: tip, direction: -90 deg", "kind: moment, node: tip"),
        ("travel: 100 mm", f"moment: {angle * 0.02 / 0.4} N*m"),
    )
    result = cfmkit.analyze(spec)
    assert result.curve.kind == "torque"
    assert result.curve.angle[-1] == pytest.approx(angle, rel=1e-8)
    x, y, _ = result.state.path.motion("tip")[-1]
    assert (x + 0.4, y) == pytest.approx((0.4 * np.sin(angle) / angle, 0.4 * (1 - np.cos(angle)) / angle), abs=1e-8)


def test_tapered_cantilever_bends_as_its_integral_says():
    """Thickness linear from 2 to 1 mm: w = P int (L - s)^2 / EI ds."""
    s = np.linspace(0, 0.4, 200001)
    flexibility = np.trapezoid((0.4 - s) ** 2 / (2.4e9 * 0.1 * (2e-3 - 1e-3 * s / 0.4) ** 3 / 12), s)
    spec = cantilever(("thickness: 1 mm", "thickness: [[0, 2 mm], [1, 1 mm]]"))
    result = cfmkit.analyze(spec.replace({"analysis.travel": "0.01 mm"}))
    assert result.curve.force[-1] == pytest.approx(0.01 * MM / flexibility, rel=1e-6)
