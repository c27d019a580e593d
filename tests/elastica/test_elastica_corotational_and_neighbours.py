"""Corotational elements beside the engine, equilibria from neighbouring networks, the slope of the force."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from buckling_structures import ding_leaf, press
from corotational import recheck

import cfmkit.elastica as el
from cfmkit.elastica.results.equilibria_near_known_path import drive_slope, solve_near_known_path
from cfmkit.errors import InputError

DOWN = el.Displacement("d", -np.pi / 2, np.array([1e-3, 4e-3, 9e-3]))


def frame(thickness: float = 1.2e-3, bend: float = 0.7, springs: tuple[el.TorsionSpring, ...] = ()) -> el.Network:
    """Return curved and tapered beams with a linked node, a turned frame and an offset."""
    section = el.Section(2e9, 8e-3, el.Taper(np.array([0, 0.5, 1]), np.array([1e-3, thickness, 1.1e-3])), shear=True)
    nodes = {
        "a": el.Node(0, 0, el.CLAMPED_SUPPORT),
        "b": el.Node(0.05, 0.02),
        "bb": el.Node(0.055, 0.025),
        "c": el.Node(0.1, 0.0, el.CLAMPED_SUPPORT),
        "d": el.Node(0.06, 0.08, el.slider_support(np.pi / 2)),
    }
    beams = {
        "ab": el.Beam("a", "b", section, el.Polynomial((0.0, bend)), end_offset=(0.003, 0.001)),
        "bc": el.Beam("bb", "c", section),
        "bd": el.Beam("b", "d", section),
    }
    return el.Network(nodes, beams, links=(el.Link("b", "bb"),), springs=springs)


@pytest.fixture(scope="module")
def path() -> el.Path:
    return el.trace(frame(), DOWN, el.Control(tolerance=1e-9))


def test_elements_agree_with_the_engine(path: el.Path) -> None:
    found = recheck(path, elements=60)
    at = path.at_requested
    np.testing.assert_allclose(found.effort, path.effort[at], rtol=5e-6)
    np.testing.assert_allclose(found.stress, path.peak_stress().value[at], rtol=3e-4)
    assert found.stable.all()


@pytest.mark.parametrize("width", [8e-3, 30e-3])
def test_elements_agree_with_the_engine_on_curved_and_tapered_wide_strips(width: float) -> None:
    """The wide ones are 7 % stiffer; as narrow ones the elements would be that far off."""
    narrow = frame()
    beams = {
        name: replace(beam, section=replace(beam.section, width=width, wide=True))
        for name, beam in narrow.beams.items()
    }
    path = el.trace(replace(narrow, beams=beams), DOWN, el.Control(tolerance=1e-9))
    found, at = recheck(path, elements=60), path.at_requested
    np.testing.assert_allclose(found.effort, path.effort[at], rtol=1e-5)
    np.testing.assert_allclose(found.stress, path.peak_stress().value[at], rtol=5e-4)
    assert found.stable.all()


def test_the_error_of_the_elements_falls_until_only_the_theories_differ(path: el.Path) -> None:
    """The two theories measure shear and stretch in frames that differ by the shear angle: about 1e-6 here."""
    exact = path.effort[path.at_requested[-1]]
    coarse, middle, fine = (abs(recheck(path, path.at_requested[-1:], n).effort[0] / exact - 1) for n in (12, 24, 48))
    assert coarse / middle > 4
    assert middle / fine > 4
    assert fine < 5e-6


def test_elements_find_an_unstable_equilibrium_unstable() -> None:
    straight = el.Network(
        {"a": el.Node(0, 0, el.CLAMPED_SUPPORT), "d": el.Node(0.1, 0.0, el.slider_support(0.0))},
        {"x": el.Beam("a", "d", el.Section(2e9, 8e-3, el.Taper(np.array([0, 1.0]), np.array([1e-3, 1.05e-3]))))},
    )
    pressed = el.Displacement("d", np.pi, np.array([1e-6, 2e-3]))
    on, off = (el.trace(straight, pressed, el.Control(branch=branch)) for branch in ("primary", "stable"))  # type: ignore[arg-type]
    assert recheck(on).stable.tolist() == [True, False]
    assert recheck(off).stable.tolist() == [True, True]


def test_elements_refuse_what_they_do_not_have() -> None:
    with pytest.raises(InputError, match="beams, links and supports"):
        recheck(el.trace(frame(springs=(el.TorsionSpring(None, "b", 0.01),)), DOWN))


def test_neighbours_are_the_equilibria_of_the_other_network(path: el.Path) -> None:
    other = frame(1.35e-3, 0.72)
    again = el.trace(other, DOWN, el.Control(tolerance=1e-9))
    found = solve_near_known_path(path, other, DOWN)
    assert found.status is el.PathStatus.COMPLETE
    np.testing.assert_allclose(found.effort, again.effort[again.at_requested], rtol=1e-8)
    np.testing.assert_allclose(found.motion("bb"), again.motion("bb")[again.at_requested], atol=1e-9)
    np.testing.assert_allclose(found.peak_stress().value, again.peak_stress().value[again.at_requested], rtol=1e-7)


def test_a_neighbour_too_far_away_is_lost_and_not_made_up(path: el.Path) -> None:
    found = solve_near_known_path(path, frame(), el.Displacement("d", -np.pi / 2, np.array([1e-3, 4e-3, 70e-3])))
    assert found.status is el.PathStatus.LOST
    assert "0.07" in found.message
    assert len(found) == 2


def test_neighbours_must_be_of_one_kind(path: el.Path) -> None:
    with pytest.raises(InputError, match="same kind"):
        solve_near_known_path(path, frame(), el.Displacement("d", -np.pi / 2, np.array([1e-3])))


def test_slope_of_the_force_is_that_of_differences(path: el.Path) -> None:
    h = 1e-6
    sides = [
        el.trace(frame(), el.Displacement("d", -np.pi / 2, DOWN.points + step), el.Control(tolerance=1e-11))
        for step in (-h, h)
    ]
    low, high = (side.effort[side.at_requested] for side in sides)
    np.testing.assert_allclose(drive_slope(path), (high - low) / (2 * h), rtol=1e-5)


def test_a_perfect_v_beam_on_its_bifurcated_branch_agrees_with_corotational_elements() -> None:
    """Forces and stability there, and on the symmetric branch that is left."""
    network, drive = ding_leaf(), press("d", [0.5e-3, 2e-3, 3e-3, 4e-3, 6e-3])
    stable = el.trace(network, drive, el.Control(tolerance=1e-9))
    symmetric = el.trace(network, drive, el.Control(tolerance=1e-9, branch="primary"))
    found, other = recheck(stable, elements=60), recheck(symmetric, elements=60)
    force = stable.effort[stable.at_requested]
    np.testing.assert_allclose(found.effort, force, atol=3e-5 * np.abs(force).max())
    np.testing.assert_allclose(other.effort, symmetric.effort[symmetric.at_requested], atol=3e-5 * np.abs(force).max())
    assert found.stable.all()
    assert other.stable.tolist() == [True, False, False, False, True]
