"""Results of equilibria of the functional beside closed forms and statics."""

from __future__ import annotations

from typing import Any

import beam_networks
import numpy as np
import pytest
from functional_paths import beam_stress, functional_path

import cfmkit.elastica as el
from cfmkit.elastica.results.cross_stiffness import cross_stiffness, poles
from cfmkit.errors import InputError

LENGTH, MODULUS, WIDTH, THICKNESS = 0.1, 2e9, 1e-2, 1e-3
RIGIDITY = MODULUS * WIDTH * THICKNESS**3 / 12
STRIP = el.Section(MODULUS, WIDTH, THICKNESS)


def assert_near(found: Any, known: Any, tolerance: float = 1e-6) -> None:
    assert np.abs(found - known).max() <= tolerance * np.abs(known).max() + 1e-300


def test_sections_of_a_cantilever_are_those_of_statics() -> None:
    """A force across the tip: the moment is the force times the arm of the bent beam, whatever its shape."""
    net = el.Network({"a": el.Node(0, 0, el.CLAMPED_SUPPORT), "b": el.Node(LENGTH, 0)}, {"x": el.Beam("a", "b", STRIP)})
    force = 2 * RIGIDITY / LENGTH**2
    path = functional_path(net, el.Loading((el.PointLoad("b", fy=1.0),), np.array([force])), 12, 2)
    seen, line = path.sections("x"), path.shape("x", 0)
    assert seen.moment[0] == pytest.approx(force * (line[-1, 0] - line[:, 0]), abs=1e-9 * force * LENGTH)
    assert np.hypot(seen.normal, seen.shear) == pytest.approx(force, rel=1e-9)
    assert seen.bending_stress[0] == pytest.approx(6 * seen.moment[0] / (WIDTH * THICKNESS**2))
    assert seen.axial_stress[0] == pytest.approx(seen.normal[0] / (WIDTH * THICKNESS))
    stress, place = beam_stress(path, "x", axial=False)
    assert stress[0] == pytest.approx(abs(seen.bending_stress[0, 0]), rel=1e-9)
    assert place[0] == pytest.approx(0.0, abs=1e-9)
    assert path.places("x")[[0, -1]] == pytest.approx([0.0, 1.0])


def test_the_largest_stress_inside_a_beam_is_found_between_its_sampled_places() -> None:
    """An arch that is pressed, pinned at both ends: most bent inside, wherever it is cut."""
    nodes = {"a": el.Node(0, 0, el.CLAMPED_SUPPORT), "b": el.Node(LENGTH, 0.2 * LENGTH, el.slider_support(0.0))}
    found = []
    for pieces in (1, 3):
        beam = el.Beam("a", "b", STRIP, el.Polynomial((0.0, 1.0, -0.7)), start_joint="pin", end_joint="pin")
        path = functional_path(
            el.Network(nodes, {"x": beam}), el.Displacement("b", np.pi, np.array([0.1 * LENGTH])), 16, pieces
        )
        found.append((*beam_stress(path, "x")[:, 0], path.sections("x")))
    (value, place, seen), (again, same, _) = found
    assert again == pytest.approx(value, rel=1e-8)
    assert same == pytest.approx(place, abs=1e-6)
    assert value > seen.stress().max() * (1 + 1e-6)
    assert 0.05 < place < 0.95


def test_the_effort_of_a_moment_drive_is_the_rotation() -> None:
    net = el.Network({"a": el.Node(0, 0, el.CLAMPED_SUPPORT), "b": el.Node(LENGTH, 0)}, {"x": el.Beam("a", "b", STRIP)})
    moment = 2.0 * RIGIDITY / LENGTH
    path = functional_path(net, el.Loading((el.PointLoad("b", moment=1.0),), np.array([moment])), 12)
    assert path.effort[0] == pytest.approx(2.0, rel=1e-10)
    assert path.energy[0] == pytest.approx(0.5 * moment * 2.0, rel=1e-10)
    turned = functional_path(net, el.Rotation("b", np.array([2.0])), 12)
    assert turned.effort[0] == pytest.approx(moment, rel=1e-10)


def test_the_stiffness_across_a_guided_leaf_is_that_without_its_guide() -> None:
    """A straight leaf moved along its width: the tip gives way along its length by stretch and by bending alone."""
    nodes = {
        "a": el.Node(0, 0, el.CLAMPED_SUPPORT),
        "b": el.Node(LENGTH, 0, el.slider_support(np.pi / 2, rotates=False)),
    }
    path = functional_path(
        el.Network(nodes, {"x": el.Beam("a", "b", STRIP)}), el.Displacement("b", np.pi / 2, np.array([1e-7])), 10
    )
    stretch = MODULUS * WIDTH * THICKNESS / LENGTH
    assert cross_stiffness(path, "b", np.pi / 2)[0] == pytest.approx(stretch, rel=1e-6)
    assert not poles(path, "b", np.pi / 2).any()


def test_a_node_that_a_link_moves_has_no_reaction() -> None:
    net = beam_networks.network(3)
    path = functional_path(net, beam_networks.drives(net, 3)[3], 8)
    with pytest.raises(InputError, match="moved by a link"):
        path.reaction("bb")


def test_displacement_of_a_line_load_counts_from_the_place_before_constant_line_loads() -> None:
    """Of a bar under w along itself u = w (L s - s^2/2)/EA, its integral w L^3/3EA."""
    section = el.Section(2e6, 8e-3, 1e-3)
    nodes = {"a": el.Node(0, 0, el.CLAMPED_SUPPORT), "b": el.Node(0.1, 0)}
    net = el.Network(nodes, {"ab": el.Beam("a", "b", section)}, loads=(el.LineLoad("ab", 3.0),))
    path = el.trace(net, el.Loading((el.LineLoad("ab", 2.0),), np.array([1.0, 2.0])))
    assert path.effort == pytest.approx(2.0 * (3.0 + 2.0 * path.drive) * 0.1**3 / (3 * 2e6 * 8e-6), rel=1e-9)
