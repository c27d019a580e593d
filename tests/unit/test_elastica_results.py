"""Results of equilibria of the functional beside those of the shooting engine, and of closed forms."""

from __future__ import annotations

from typing import Any

import beam_networks
import numpy as np
import pytest
from functional_paths import functional_path

from cfmkit.elastica import (
    CLAMPED,
    Beam,
    Control,
    Displacement,
    Loading,
    Network,
    Node,
    PointLoad,
    Polynomial,
    Rotation,
    Section,
    guided,
    trace,
)
from cfmkit.elastica.outcome import between_points as today
from cfmkit.elastica.outcome import crosswise_stiffness
from cfmkit.elastica.results.between_points import between_loads, between_points
from cfmkit.elastica.results.cross_stiffness import cross_stiffness, poles
from cfmkit.errors import InputError

LENGTH, MODULUS, WIDTH, THICKNESS = 0.1, 2e9, 1e-2, 1e-3
RIGIDITY = MODULUS * WIDTH * THICKNESS**3 / 12
STRIP = Section(MODULUS, WIDTH, THICKNESS)


def assert_near(found: Any, known: Any, tolerance: float = 1e-6) -> None:
    assert np.abs(found - known).max() <= tolerance * np.abs(known).max() + 1e-300


@pytest.mark.parametrize(("seed", "number"), [(3, 0), (8, 0), (3, 1), (4, 2), (4, 3), (3, 3)])
def test_all_results_are_those_of_the_shooting_engine(seed: int, number: int) -> None:
    """Networks with every feature, each kind of drive."""
    net = beam_networks.network(seed)
    drive = beam_networks.drives(net, seed)[number]
    path, old = functional_path(net, drive), trace(net, drive, Control(tolerance=1e-10))
    keep = old.at_requested
    assert_near(path.drive, old.drive[keep], 1e-12)
    assert_near(path.effort, old.effort[keep])
    assert_near(path.energy, old.energy[keep])
    for nodes, output in ((list(net.nodes), "motion"), (list(old.layout.masters), "reaction")):
        found = np.array([getattr(path, output)(name) for name in nodes])
        assert_near(found, np.array([getattr(old, output)(name)[keep] for name in nodes]))
    for beam in net.beams:
        for end in (0, 1):
            assert_near(path.end_force(beam, end), old.end_force(beam, end)[keep])
            assert_near(path.shape(beam, 1)[-end], old.shape(beam, int(keep[1]))[-end], 1e-9)
            assert_near(path.line_motion(beam)[:, -end], old.line_motion(beam)[keep][:, -end], 1e-5)
        for axial in (True, False):
            assert_near(path.beam_stress(beam, axial)[0], old.beam_stress(beam, axial)[0][keep])
            found, known = path.stress_extremes(beam, axial), old.stress_extremes(beam, axial)
            assert_near(found.value, known.value[keep])
    peak, known = path.peak_stress(), old.peak_stress()
    assert_near(peak.value, known.value[keep])
    if number == 0:
        stiffness = cross_stiffness(path, "d", drive.direction)
        assert_near(stiffness, crosswise_stiffness.cross_stiffness(old, "d", drive.direction, keep))


def test_sections_of_a_cantilever_are_those_of_statics() -> None:
    """A force across the tip: the moment is the force times the arm of the bent beam, whatever its shape."""
    net = Network({"a": Node(0, 0, CLAMPED), "b": Node(LENGTH, 0)}, {"x": Beam("a", "b", STRIP)})
    force = 2 * RIGIDITY / LENGTH**2
    path = functional_path(net, Loading((PointLoad("b", fy=1.0),), np.array([force])), 12, 2)
    seen, line = path.sections("x"), path.shape("x", 0)
    assert seen.moment[0] == pytest.approx(force * (line[-1, 0] - line[:, 0]), abs=1e-9 * force * LENGTH)
    assert np.hypot(seen.normal, seen.shear) == pytest.approx(force, rel=1e-9)
    assert seen.bending_stress[0] == pytest.approx(6 * seen.moment[0] / (WIDTH * THICKNESS**2))
    assert seen.axial_stress[0] == pytest.approx(seen.normal[0] / (WIDTH * THICKNESS))
    stress, place = path.beam_stress("x", axial=False)
    assert stress[0] == pytest.approx(abs(seen.bending_stress[0, 0]), rel=1e-9)
    assert place[0] == pytest.approx(0.0, abs=1e-9)
    assert path.places("x")[[0, -1]] == pytest.approx([0.0, 1.0])


def test_the_largest_stress_inside_a_beam_is_found_between_its_sampled_places() -> None:
    """An arch that is pressed, pinned at both ends: most bent inside, wherever it is cut."""
    nodes = {"a": Node(0, 0, CLAMPED), "b": Node(LENGTH, 0.2 * LENGTH, guided(0.0))}
    found = []
    for pieces in (1, 3):
        beam = Beam("a", "b", STRIP, Polynomial((0.0, 1.0, -0.7)), start_joint="pin", end_joint="pin")
        path = functional_path(
            Network(nodes, {"x": beam}), Displacement("b", np.pi, np.array([0.1 * LENGTH])), 16, pieces
        )
        found.append((path.beam_stress("x")[0][0], path.beam_stress("x")[1][0], path.sections("x")))
    (value, place, seen), (again, same, _) = found
    assert again == pytest.approx(value, rel=1e-8)
    assert same == pytest.approx(place, abs=1e-6)
    assert value > seen.stress().max() * (1 + 1e-6)
    assert 0.05 < place < 0.95


def test_the_effort_of_a_moment_drive_is_the_rotation() -> None:
    net = Network({"a": Node(0, 0, CLAMPED), "b": Node(LENGTH, 0)}, {"x": Beam("a", "b", STRIP)})
    moment = 2.0 * RIGIDITY / LENGTH
    path = functional_path(net, Loading((PointLoad("b", moment=1.0),), np.array([moment])), 12)
    assert path.effort[0] == pytest.approx(2.0, rel=1e-10)
    assert path.energy[0] == pytest.approx(0.5 * moment * 2.0, rel=1e-10)
    turned = functional_path(net, Rotation("b", np.array([2.0])), 12)
    assert turned.effort[0] == pytest.approx(moment, rel=1e-10)


def test_the_stiffness_across_a_guided_leaf_is_that_without_its_guide() -> None:
    """A straight leaf moved along its width: the tip gives way along its length by stretch and by bending alone."""
    nodes = {"a": Node(0, 0, CLAMPED), "b": Node(LENGTH, 0, guided(np.pi / 2, rotates=False))}
    path = functional_path(
        Network(nodes, {"x": Beam("a", "b", STRIP)}), Displacement("b", np.pi / 2, np.array([1e-7])), 10
    )
    stretch = MODULUS * WIDTH * THICKNESS / LENGTH
    assert cross_stiffness(path, "b", np.pi / 2)[0] == pytest.approx(stretch, rel=1e-6)
    assert not poles(path, "b", np.pi / 2).any()


def test_a_node_that_a_link_moves_has_no_reaction() -> None:
    net = beam_networks.network(3)
    path = functional_path(net, beam_networks.drives(net, 3)[3], 8)
    with pytest.raises(InputError, match="moved by a link"):
        path.reaction("bb")


def arch(points: int, load: bool = False) -> tuple[Network, Displacement | Loading]:
    """An arch that is pressed flat: its force has a largest and a smallest value on the way."""
    nodes = {"a": Node(0, 0, CLAMPED), "b": Node(LENGTH, 0.02, guided(np.pi / 2, rotates=False))}
    net = Network(nodes, {"x": Beam("a", "b", STRIP, Polynomial((0.0, 0.9, -0.4)))})
    if load:
        return net, Loading((PointLoad("b", fy=1.0),), np.linspace(0, 1.5, points)[1:])
    return net, Displacement("b", -np.pi / 2, np.linspace(0, 0.04, points)[1:])


def test_between_its_points_a_path_is_that_of_the_shooting_engine() -> None:
    net, drive = arch(14)
    old = today.between_points(trace(net, drive, Control(tolerance=1e-9)), allowed=6e6)
    new = between_points(functional_path(net, drive, 14), allowed=6e6)
    assert old is not None
    assert new is not None
    places = np.linspace(0.01, 0.039, 20)  # at the start, which the old path has a point at, cubics differ
    assert_near(new.effort("", places), old.effort("", places), 1e-7)
    assert_near(new.stress("", places), old.stress("", places), 1e-5)
    assert new.largest_stress("", 0.01, 0.037) == pytest.approx(old.largest_stress("", 0.01, 0.037), rel=1e-6)
    assert_near(np.array(new.peaks), np.array(old.peaks), 1e-6)


def test_between_its_points_a_path_under_a_load_is_that_of_the_shooting_engine() -> None:
    net, drive = arch(12, load=True)
    old = today.between_loads(trace(net, drive, Control(tolerance=1e-9)), "b", np.pi / 2)
    new = between_loads(functional_path(net, drive, 14), "b", np.pi / 2)
    assert old is not None
    assert new is not None
    low, high = new.places[[0, -1]]
    places = np.linspace(max(low, old.places[0]), min(high, old.places[-1]), 13)[4:-1]
    assert_near(new.effort("", places), old.effort("", places), 1e-7)
    assert_near(new.stress("", places), old.stress("", places), 1e-5)
