"""A stated imperfection takes a network past its bifurcations without a choice of branch, and is named."""

from __future__ import annotations

import numpy as np
import pytest
from buckling_structures import column, ding_leaf, press
from scipy.special import ellipe, ellipk

import cfmkit.elastica as el
from cfmkit.errors import InputError

TRAVEL = np.arange(1, 13) * 0.5e-3


def pressed(imperfection: float = 0.0, thickness: float = 1e-3) -> el.Path:
    return el.trace(ding_leaf(thickness), press("d", TRAVEL), el.Control(imperfection=imperfection))


def test_an_imperfect_v_beam_is_stable_without_bifurcations_and_says_so() -> None:
    path = pressed(1e-5)
    assert path.events == ()
    assert path.stable.all()
    assert set(path.branch) == {"imperfect"}
    assert path.imperfection == "1e-05 m of the buckling mode at 0.000920548"
    assert pressed().imperfection == ""


def test_smaller_imperfections_come_closer_to_the_stable_branch() -> None:
    """Away from the bifurcations the force changes in proportion."""
    exact = pressed()
    away = [1, 2, 3, 4, 5, 6, 7, 10, 11]  # not 4.5 and 5 mm, beside the second
    misses = []
    for size in (1e-5, 1e-6):
        path = pressed(size)
        misses.append(np.abs(path.effort[path.at_requested] - exact.effort[exact.at_requested])[away].max())
    assert misses[0] < 0.05 * exact.effort.max()
    assert misses[1] == pytest.approx(0.1 * misses[0], rel=0.3)


def test_the_sign_chooses_the_side_and_the_size_is_the_deviation_of_the_shape() -> None:
    straight, up, down = (pressed(size).fits["v"] for size in (0.0, 1e-5, -1e-5))
    s = np.linspace(0, 1, 2001)

    def deviation(fitted: object) -> np.ndarray:
        angle = fitted.angle(s, 0.5) - straight.angle(s, 0.5)  # type: ignore[attr-defined]
        steps = 0.5 * (angle[1:] + angle[:-1]) * np.diff(s) * straight.length
        return np.concatenate([[0.0], np.cumsum(steps)])

    np.testing.assert_allclose(deviation(up), -deviation(down), atol=1e-9)
    assert np.abs(deviation(up)).max() == pytest.approx(1e-5, rel=5e-5)


def test_a_path_without_bifurcation_gets_no_imperfection_and_says_so() -> None:
    path, plain = pressed(1e-5, thickness=1.4e-3), pressed(thickness=1.4e-3)
    assert path.imperfection == "none: the perfect path has no bifurcation"
    np.testing.assert_array_equal(path.at.z, plain.at.z)
    np.testing.assert_allclose(path.effort, plain.effort, rtol=1e-14)


def test_an_imperfection_must_be_finite() -> None:
    with pytest.raises(InputError, match="imperfection"):
        el.Control(imperfection=np.nan)


LENGTH = 0.1


def slender(slenderness: float, clamped: bool, cut: float | None = None, arm: float = 0.0) -> el.Network:
    """Return a straight column, perhaps of two beams, which may be held by rigid arms at the node between them."""
    section = el.Section(2e9, 10e-3, LENGTH * np.sqrt(12) / slenderness)
    whole = column(section, clamped)
    if cut is None:
        return whole
    halves = {
        "x": el.Beam("a", "m", section, end_offset=(0.0, -arm)),
        "y": el.Beam("m", "b", section, start_offset=(0.0, -arm)),
    }
    return el.Network({**whole.nodes, "m": el.Node(cut * LENGTH, arm)}, halves)


@pytest.mark.parametrize("arm", [0.0, 4e-3])
@pytest.mark.parametrize("share", [0.001, 0.3])
@pytest.mark.parametrize("clamped", [False, True])
@pytest.mark.parametrize("cut", [0.5, 0.37])
def test_a_column_of_two_beams_is_bent_as_one_beam_is(cut: float, clamped: bool, share: float, arm: float) -> None:
    """The node between them takes its part in the mode, and so do arms on it; to first order, of 0.03 rad here."""
    size = share * LENGTH * np.sqrt(12) / 100
    drive, control = (
        el.Displacement("b", np.pi, np.array([0.0065, 0.02, 0.1]) * LENGTH),
        el.Control(1e-5, imperfection=size),
    )
    whole, cut_up = (el.trace(net, drive, control) for net in (slender(100, clamped), slender(100, clamped, cut, arm)))
    assert cut_up.status is el.PathStatus.COMPLETE, cut_up.message
    assert cut_up.events == whole.events == ()
    assert not cut_up.unstable.any()
    expected = whole.effort[whole.at_requested]
    np.testing.assert_allclose(cut_up.effort[cut_up.at_requested], expected, rtol=3e-4)


@pytest.mark.parametrize("cut", [None, 0.37])
@pytest.mark.parametrize("clamped", [False, True])
@pytest.mark.parametrize("slenderness", [100, 700, 5000])
def test_a_bent_column_under_a_force_goes_where_a_displacement_meets_that_force(
    slenderness: float, clamped: bool, cut: float | None
) -> None:
    """Before, at and far behind the critical load; `shot` has the curve over the displacement."""
    net = slender(slenderness, clamped, cut)
    thickness = LENGTH * np.sqrt(12) / slenderness
    critical = (4 if clamped else 1) * np.pi**2 * 2e9 * 10e-3 * thickness**3 / 12 / LENGTH**2
    control = el.Control(1e-6, imperfection=0.05 * thickness)
    factors = np.array([0.5, 0.97, 1.0, 1.02, 1.3, 2.0])
    path = el.trace(net, el.Loading((el.PointLoad("b", fx=-critical),), factors), control)
    assert path.status is el.PathStatus.COMPLETE, path.message
    assert path.events == ()
    assert not path.unstable.any()
    went = -path.motion("b")[path.at_requested, 0]
    back = el.trace(net, el.Displacement("b", np.pi, went), control)
    assert back.events == ()
    np.testing.assert_allclose(back.effort[back.at_requested] / critical, factors, rtol=2e-5)


@pytest.mark.parametrize("clamped", [False, True])
def test_a_column_that_does_not_stretch_buckles_under_a_displacement_once_it_is_bent(clamped: bool) -> None:
    """The perfect one is rigid until its critical load. Bent by 1e-5 of its length it is nearly so: closed form."""
    net = column(el.Section(2e9, 10e-3, 1e-3, axial=False), clamped)
    modulus = np.sin(np.array([20.0, 50.0, 80.0]) * np.pi / 360) ** 2  # of the integrals, by the steepest slope
    shortened = 2 * (1 - ellipe(modulus) / ellipk(modulus)) * LENGTH
    perfect = el.trace(net, el.Displacement("b", np.pi, shortened))
    assert perfect.status is el.PathStatus.COMPLETE
    critical = (4 if clamped else 1) * np.pi**2 * 2e9 * 10e-3 * 1e-3**3 / 12 / LENGTH**2
    path = el.trace(net, el.Displacement("b", np.pi, shortened), el.Control(1e-7, imperfection=1e-5 * LENGTH))
    assert path.status is el.PathStatus.COMPLETE, path.message
    assert path.imperfection == f"1e-06 m of the buckling mode under {critical:.4g} N"
    assert path.stable.all()
    expected = critical * (2 * ellipk(modulus) / np.pi) ** 2
    np.testing.assert_allclose(path.effort[path.at_requested], expected, rtol=1e-4)


def test_a_beam_that_is_pulled_and_does_not_stretch_has_no_mode() -> None:
    """It is looked at under a pull up to 1e5 EI/L^2, and nothing buckles."""
    section = el.Section(2e9, 10e-3, 1e-3, axial=False)
    nodes = {
        "a": el.Node(0, 0, el.CLAMPED_SUPPORT),
        "b": el.Node(LENGTH, 0, el.slider_support(0.0)),
        "c": el.Node(LENGTH / 2, LENGTH / 2),
    }
    net = el.Network(nodes, {"x": el.Beam("a", "b", section), "y": el.Beam("a", "c", section)})
    path = el.trace(net, el.Displacement("b", 0.0, np.array([1e-3])), el.Control(imperfection=1e-5))
    assert path.status is el.PathStatus.NO_START
    assert path.imperfection == "none: the perfect path has no bifurcation"


@pytest.mark.parametrize("slenderness", [1000, 5000])
def test_a_long_first_step_leads_to_the_side_that_a_column_is_bent_to(slenderness: float) -> None:
    """One that jumps over the corner may come to lie on the mirror image, with the mean slope that is expected."""
    first = 26.6 * np.pi**2 / slenderness**2  # in critical shortenings
    drive = el.Displacement("b", np.pi, np.array([first, 0.1]) * LENGTH)
    bent = 0.0864 * LENGTH * np.sqrt(12) / slenderness
    path = el.trace(slender(slenderness, clamped=False), drive, el.Control(1e-4, imperfection=bent))
    assert path.status is el.PathStatus.COMPLETE
    assert np.sign(path.motion("a")[1:, 2]).tolist() == [np.sign(path.fits["x"].angle(0.0, 0.5))] * (len(path) - 1)


@pytest.mark.parametrize("direction", [0.0, 0.7, 2.1])
def test_a_strip_that_does_not_stretch_is_straight_up_to_its_critical_load(
    direction: float,
) -> None:
    """Its poses change by rounding only, which leads nowhere."""
    c, s = np.cos(direction), np.sin(direction)
    nodes = {
        "a": el.Node(0, 0, el.PINNED_SUPPORT),
        "b": el.Node(LENGTH * c, LENGTH * s, el.slider_support(direction, rotates=True)),
    }
    network = el.Network(nodes, {"x": el.Beam("a", "b", el.Section(2e9, 10e-3, 0.3e-3, axial=False))})
    critical = np.pi**2 * 2e9 * 10e-3 * 0.3e-3**3 / 12 / LENGTH**2
    load = el.PointLoad("b", fx=-critical * c, fy=-critical * s)
    path = el.trace(network, el.Loading((load,), np.array([0.3, 0.9, 1.2])), el.Control(1e-6, branch="primary"))
    assert path.status is el.PathStatus.COMPLETE, path.message
    assert [(event.kind, event.before, event.after) for event in path.events] == [("bifurcation", 0, 1)]
    assert path.events[0].drive == pytest.approx(1.0, rel=1e-6)
