"""Columns pressed together far beyond their critical load, and loaded with just that and with more.

Reference
---------
S. P. Timoshenko, J. M. Gere, Theory of Elastic Stability, 2nd ed., 1961, sec. 2.7: with k the sine of half the angle at
the ends, P = (2 K(k)/pi)^2 P_cr and the ends approach by 2 (1 - E(k)/K(k)) L.
"""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from buckling_structures import column
from scipy.optimize import brentq
from scipy.special import ellipe, ellipk

import cfmkit.elastica as el

LENGTH = 0.1
APPROACH = np.linspace(0.02, 0.5, 13)


def elastica(approach: float) -> float:
    """Return the load of a pinned column over the critical one, for the approach of its ends over its length."""
    m = brentq(lambda m: 2 * (1 - ellipe(m) / ellipk(m)) - approach, 1e-9, 0.9)
    return float((2 * ellipk(m) / np.pi) ** 2)


def slender(slenderness: float, clamped: bool) -> tuple[el.Network, float]:
    """Return a column whose far end is guided along it, and its critical load [N]."""
    thickness = LENGTH * np.sqrt(12) / slenderness
    critical = (4 if clamped else 1) * np.pi**2 * 2e9 * 1e-2 * thickness**3 / 12 / LENGTH**2
    return column(el.Section(2e9, 1e-2, thickness), clamped), critical


@pytest.mark.parametrize("imperfection", [0.0, 1e-5 * LENGTH, 1e-3 * LENGTH])
@pytest.mark.parametrize("clamped", [False, True])
@pytest.mark.parametrize("slenderness", [100, 400])
def test_a_column_is_followed_far_beyond_its_critical_load(
    slenderness: float, clamped: bool, imperfection: float
) -> None:
    """The first requested point lies far behind the bifurcation: 20 to 300 times the critical approach."""
    network, critical = slender(slenderness, clamped)
    path = el.trace(network, el.Displacement("b", np.pi, APPROACH * LENGTH), el.Control(imperfection=imperfection))
    assert path.status is el.PathStatus.COMPLETE, path.message
    assert path.stable[path.at_requested].all()
    ratio = path.effort[path.at_requested] / critical
    expected = [elastica(one) for one in APPROACH]  # a clamped column is four quarters of which two are a pinned one
    shortening = 20.0 / slenderness**2 * (4 if clamped else 1)  # of the axis, which the elastica has not
    np.testing.assert_allclose(ratio, expected, rtol=shortening + 20 * imperfection / LENGTH)


ENDS = {
    "free": (el.CLAMPED_SUPPORT, el.FREE_SUPPORT, 0.25),
    "guided": (el.CLAMPED_SUPPORT, el.slider_support(0.0), 4.0),
    "pinned": (el.PINNED_SUPPORT, el.slider_support(0.0, True), 1.0),
}


def loaded(kind: str, cut: float | None) -> tuple[el.Network, float]:
    """Return a column that does not stretch, perhaps of two beams, and its critical load [N]."""
    first, last, factor = ENDS[kind]
    section = el.Section(2e9, 8e-3, 1e-3, axial=False)
    nodes = {"a": el.Node(0, 0, first), "b": el.Node(LENGTH, 0, last)}
    beams = {"x": el.Beam("a", "b", section)}
    if cut is not None:
        nodes["m"] = el.Node(cut * LENGTH, 0)
        beams = {"x": el.Beam("a", "m", section), "y": el.Beam("m", "b", section)}
    return el.Network(nodes, beams), factor * np.pi**2 * 2e9 * 8e-3 * 1e-9 / 12 / LENGTH**2


def approach_under(ratio: float) -> float:
    """Return the approach of the ends over the length, for a load over the critical one."""
    if ratio <= 1:
        return 0.0
    m = brentq(lambda m: 2 * ellipk(m) / np.pi - np.sqrt(ratio), 1e-12, 1 - 1e-12)
    return float(2 * (1 - ellipe(m) / ellipk(m)))


@pytest.mark.parametrize("tolerance", [1e-3, 1e-5, 1e-8])
@pytest.mark.parametrize("beside", [0.0, 1e-9, -1e-9, 1e-6, -1e-6, 1e-4])
@pytest.mark.parametrize("cut", [None, 0.5, 0.3])
@pytest.mark.parametrize("kind", ENDS)
def test_a_column_is_loaded_with_its_critical_load_and_more(
    kind: str, cut: float | None, beside: float, tolerance: float
) -> None:
    """A requested point lies at the bifurcation, or next to it; half a pinned column is a critical cantilever."""
    network, critical = loaded(kind, cut)
    ratios = np.array([0.5, 1.0 + beside, 1.2, 1.9])
    path = el.trace(network, el.Loading((el.PointLoad("b", fx=-critical),), ratios), el.Control(tolerance=tolerance))
    assert path.status is el.PathStatus.COMPLETE, path.message
    assert path.stable.all()
    assert path.requested[path.at_requested].tolist() == [0, 1, 2, 3]
    assert [(event.kind, event.before, event.after) for event in path.events] == [("bifurcation", 0, 1)]
    assert path.events[0].drive == pytest.approx(1.0, rel=max(tolerance, 1e-9))
    found = -path.motion("b")[path.at_requested, 0] / LENGTH
    np.testing.assert_allclose(found, [approach_under(one) for one in ratios], atol=10 * tolerance)


@pytest.mark.parametrize("seed", range(200))
def test_a_column_of_pieces_is_loaded_with_multiples_of_its_critical_load_at_random(seed: int) -> None:
    """One of the requested points lies at the bifurcation or near it; pieces may run either way."""
    rng = np.random.default_rng(seed)
    kind = str(rng.choice(list(ENDS)))
    cuts = np.sort(rng.choice([0.1, 0.25, 1 / 3, 0.4, 0.5, 2 / 3, 0.75], int(rng.integers(0, 3)), replace=False))
    whole, critical = loaded(kind, None)
    names = ["a", *(f"m{number}" for number in range(len(cuts))), "b"]
    nodes = dict(whole.nodes) | {name: el.Node(cut * LENGTH, 0) for name, cut in zip(names[1:-1], cuts, strict=True)}
    ways = [pair if rng.integers(2) else pair[::-1] for pair in itertools.pairwise(names)]
    section = whole.beams["x"].section
    network = el.Network(nodes, {f"{one}{other}": el.Beam(one, other, section) for one, other in ways})
    beside = 1.0 + rng.choice([0.0, 1e-9, -1e-9, 1e-6, -1e-6, 1e-4, 1e-3, 0.02])
    ratios = np.sort(np.append(rng.uniform(0.2, 2, int(rng.integers(1, 6))), beside))
    tolerance = 10 ** rng.uniform(-8, -3)
    path = el.trace(network, el.Loading((el.PointLoad("b", fx=-critical),), ratios), el.Control(tolerance=tolerance))
    assert path.status is el.PathStatus.COMPLETE, path.message
    assert path.stable.all()
    reported = [event.kind for event in path.events]
    assert reported == ["bifurcation"] or (not reported and ratios.max() <= 1 + 1e-5)
    found = -path.motion("b")[path.at_requested, 0] / LENGTH
    sure = np.abs(ratios - 1) > 1e-5
    expected = np.array([approach_under(one) for one in ratios])
    np.testing.assert_allclose(found[sure], expected[sure], atol=20 * tolerance)


@pytest.mark.parametrize("tolerance", [1e-3, 1e-5, 1e-8])
@pytest.mark.parametrize("slender", [3.0, 10.0, 30.0, 100.0, 300.0])
@pytest.mark.parametrize("axial", [False, True])
def test_a_cantilever_in_strong_tension_bends_in_a_boundary_layer(
    slender: float, tolerance: float, axial: bool
) -> None:
    """EI y'' + P (L - x) = T (y_end - y), clamped and small: y_end = P (L - tanh(kL) / k) / T, k^2 = T / EI."""
    young, width, thickness = 2e11, 8e-3, 1e-4
    rigidity = young * width * thickness**3 / 12
    tension = rigidity * (slender / LENGTH) ** 2
    nodes = {"a": el.Node(0, 0, el.CLAMPED_SUPPORT), "b": el.Node(LENGTH, 0)}
    beams = {"x": el.Beam("a", "b", el.Section(young, width, thickness, axial=axial))}
    pull = el.Network(nodes, beams, loads=(el.PointLoad("b", fx=tension),))
    aside = 1e-4 * tension
    path = el.trace(
        pull, el.Loading((el.PointLoad("b", fy=aside),), np.array([0.5, 1.0])), el.Control(tolerance=tolerance)
    )
    assert path.status is el.PathStatus.COMPLETE, path.message
    strain = tension / (young * width * thickness) if axial else 0.0
    expected = aside / tension * (LENGTH - LENGTH * np.tanh(slender) / slender)
    found = path.motion("b")[path.at_requested, 1]
    np.testing.assert_allclose(found, [0.5 * expected, expected], rtol=1e-6 + 2 * tolerance + 3 * strain)
