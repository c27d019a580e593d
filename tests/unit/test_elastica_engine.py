"""Identities and invariants of the beam engine."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from cfmkit.elastica import (
    CLAMPED_SUPPORT,
    FREE_SUPPORT,
    PINNED_SUPPORT,
    Beam,
    Control,
    CosineArch,
    Displacement,
    LineSpring,
    Link,
    Loading,
    Network,
    Node,
    Path,
    PathStatus,
    PointLoad,
    Polyline,
    Polynomial,
    Rotation,
    Section,
    SlideSpring,
    Spline,
    Support,
    Taper,
    TorsionSpring,
    arc,
    slider_support,
    trace,
)
from cfmkit.elastica.model.beam_fits import BeamFits
from cfmkit.errors import InputError

TIGHT = Control(tolerance=1e-10)
UP = np.pi / 2
TAPER = Taper(np.array([0, 0.4, 1]), np.array([1.0e-3, 1.6e-3, 0.8e-3]))


def frame(section: Section | None = None, turn: float = 0.0, size: float = 1.0, mirrored: bool = False) -> Network:
    """Return a network with curved and straight beams, a pin, a spring, an offset and a linked node."""
    section = section or Section(2e9, 8e-3 * size, _scaled(TAPER, size), shear=True)
    sign = -1.0 if mirrored else 1.0

    def at(x: float, y: float, support: Support = FREE_SUPPORT) -> Node:
        c, s = np.cos(turn), np.sin(turn)
        support = dataclasses.replace(support, direction=sign * support.direction + turn)
        y *= sign
        return Node(size * (c * x - s * y), size * (s * x + c * y), support)

    def arm(x: float, y: float) -> tuple[float, float]:
        c, s = np.cos(turn), np.sin(turn)
        y *= sign
        return size * (c * x - s * y), size * (s * x + c * y)

    nodes = {
        "a": at(0, 0, CLAMPED_SUPPORT),
        "b": at(0.05, 0.03),
        "bb": at(0.055, 0.03),
        "c": at(0.09, 0.0, PINNED_SUPPORT),
        "d": at(0.06, 0.07, slider_support(UP)),
    }
    beams = {
        "ab": Beam("a", "b", section, Polynomial((0.0, sign * 0.8, -sign * 0.5))),
        "bc": Beam("bb", "c", section, arc(-sign * 0.7), end_joint="pin"),
        "bd": Beam("b", "d", section, start_offset=arm(0.0, 0.004)),
    }
    springs = (TorsionSpring(None, "b", 0.02 * size**3), LineSpring("b", None, 30.0 * size, ground=arm(0.0, 0.06)))
    return Network(nodes, beams, links=(Link("b", "bb"),), springs=springs)


def _scaled(taper: Taper, size: float) -> Taper:
    return Taper(taper.stations, np.array(taper.values) * size)


def driven(network: Network, travel: np.ndarray, turn: float = 0.0, control: Control = TIGHT) -> Path:
    path = trace(network, Displacement("d", -UP + turn, travel), control)
    assert path.status is PathStatus.COMPLETE, path.message
    return path


TRAVEL = np.array([2e-3, 5e-3, 9e-3])


@pytest.fixture(scope="module")
def reference() -> Path:
    return driven(frame(), TRAVEL)


@pytest.mark.parametrize("turn", [0.3, 2.0, -1.1])
def test_a_turned_network_has_the_same_forces(reference: Path, turn: float) -> None:
    p = driven(frame(turn=turn), TRAVEL, turn)
    np.testing.assert_allclose(p.effort[p.at_requested], reference.effort[reference.at_requested], rtol=1e-8)
    c, s = np.cos(turn), np.sin(turn)
    moved, was = p.motion("bb")[-1], reference.motion("bb")[-1]
    np.testing.assert_allclose(moved, [c * was[0] - s * was[1], s * was[0] + c * was[1], was[2]], atol=1e-10)


def test_a_mirrored_network_has_mirrored_motions(reference: Path) -> None:
    p = trace(frame(mirrored=True), Displacement("d", UP, TRAVEL), TIGHT)
    np.testing.assert_allclose(p.effort[p.at_requested], reference.effort[reference.at_requested], rtol=1e-8)
    np.testing.assert_allclose(p.motion("b")[-1], reference.motion("b")[-1] * [1, -1, -1], atol=1e-10)


@pytest.mark.parametrize("size", [0.1, 25.0])
def test_a_scaled_network_has_scaled_forces(reference: Path, size: float) -> None:
    """All lengths times k (width too): forces times k^2, torsion springs times k^3, line springs times k."""
    p = driven(frame(size=size), TRAVEL * size)
    np.testing.assert_allclose(p.effort[p.at_requested], reference.effort[reference.at_requested] * size**2, rtol=1e-8)


def test_the_reported_error_bounds_the_true_one() -> None:
    exact = driven(frame(), TRAVEL, control=Control(tolerance=1e-11))
    for tolerance in (1e-3, 1e-5, 1e-7):
        p = driven(frame(), TRAVEL, control=Control(tolerance=tolerance))
        true = np.abs(p.effort[p.at_requested] - exact.effort[exact.at_requested]).max() / np.abs(exact.effort).max()
        assert p.error <= tolerance
        assert true <= 3 * tolerance


def test_a_pin_carries_no_moment_and_a_guide_no_force_along_itself(reference: Path) -> None:
    np.testing.assert_allclose(reference.end_force("bc", 1)[:, 2], 0, atol=1e-11)
    p = trace(frame(), Rotation("b", np.array([0.1, 0.3])), TIGHT)
    np.testing.assert_allclose(p.reaction("d")[:, 1], 0, atol=1e-9)
    assert p.motion("b")[-1, 2] == pytest.approx(0.3)


def test_linked_nodes_move_as_one_body(reference: Path) -> None:
    b, bb = reference.motion("b"), reference.motion("bb")
    np.testing.assert_allclose(b[:, 2], bb[:, 2])
    gap = np.array([0.005, 0.0]) + (bb - b)[:, :2]
    np.testing.assert_allclose(np.hypot(*gap.T), 0.005, rtol=1e-12)


def test_force_control_and_displacement_control_agree(reference: Path) -> None:
    force = float(reference.effort[-1])
    if not (np.diff(reference.effort) > 0).all():
        pytest.fail("the reference is meant to stiffen monotonically")
    p = trace(frame(), Loading((PointLoad("d", fy=-force),), np.array([1.0])), TIGHT)
    assert -p.motion("d")[-1, 1] == pytest.approx(9e-3, rel=1e-7)


def test_a_path_repeats_bit_by_bit(reference: Path) -> None:
    np.testing.assert_array_equal(driven(frame(), TRAVEL).effort, reference.effort)


def test_results_cannot_be_written_to(reference: Path) -> None:
    for array in (reference.effort, reference.drive, reference.motion("b"), reference.stable):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1


def test_shapes_by_points_approach_the_exact_arc() -> None:
    angles = np.linspace(-0.6, 0.6, 41)
    circle = np.column_stack([0.1 * np.sin(angles), 0.1 - 0.1 * np.cos(angles)])
    section = Section(2e9, 8e-3, 1e-3)

    def force(shape: object) -> float:
        nodes = {"a": Node(*circle[0], CLAMPED_SUPPORT), "d": Node(*circle[-1], slider_support(0.0))}
        network = Network(nodes, {"x": Beam("a", "d", section, shape)})  # type: ignore[arg-type]
        return float(trace(network, Displacement("d", np.pi, [5e-3]), TIGHT).effort[-1])

    exact = force(arc(1.2))
    assert force(Spline(circle)) == pytest.approx(exact, rel=1e-5)
    assert force(Polyline(circle)) == pytest.approx(exact, rel=2e-3)
    assert force(Polyline(circle)) != pytest.approx(exact, rel=1e-6)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Network({"a": Node(0, 0)}, {}), "at least one beam"),
        (lambda: Network({"a": Node(0, 0)}, {"x": Beam("a", "z", Section(1, 1, 1))}), "not a node"),
        (lambda: Beam("a", "a", Section(1, 1, 1)), "two different nodes"),
        (lambda: Section(1.0, 1.0, -1.0), "thickness must be positive"),
        (lambda: Section(float("nan"), 1.0, 1.0), "youngs_modulus"),
        (lambda: Taper(np.array([0, 0.5]), np.array([1, 1])), "from 0 to 1"),
        (lambda: Displacement("a", 0.0, [0.0]), "other than zero"),
        (lambda: Control(tolerance=0.0), "tolerance"),
        (lambda: Support(displacement=(1.0, 0, 0)), "not held"),
        (lambda: trace(frame(), Displacement("a", 0.0, [1.0])), "it is held"),
        (lambda: trace(frame(), Displacement("bb", 0.0, [1.0])), "cannot be driven"),
        (lambda: trace(frame(), Displacement("d", 0.3, [1.0])), "it is held"),
        (lambda: trace(frame(), Displacement("d", np.inf, [1.0])), "cannot be moved along inf deg"),
        (lambda: Network({"z": Node(0, 0)}, {"x": Beam("a", "z", Section(1, 1, 1))}), "'a', which is not a node"),
        (lambda: Beam("a", "b", Section(1, 1, 1), start_joint="hinge"), "got 'hinge'"),
        (lambda: Beam("a", "b", Section(1, 1, 1), end_joint="hinge"), "got 'hinge'"),
        (lambda: Support(True, True, displacement=np.array([0.0, 0.0, 1.0])), "rotation is given"),
    ],
)
def test_what_cannot_be_is_refused_with_a_reason(make: object, message: str) -> None:
    with pytest.raises(InputError, match=message):
        make()  # type: ignore[operator]


def test_importing_the_beams_loads_no_scipy() -> None:
    import subprocess
    import sys

    code = "import cfmkit.elastica, sys; sys.exit(any(name.split('.')[0] == 'scipy' for name in sys.modules))"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_a_slide_spring_pulls_along_its_direction_only() -> None:
    network = frame()
    sprung = dataclasses.replace(network, springs=(*network.springs, SlideSpring("d", UP, 50.0)))
    more, less = (driven(net, TRAVEL).effort[-1] for net in (sprung, network))
    assert more - less == pytest.approx(50.0 * 9e-3, rel=1e-9)


def test_a_cosine_arch_fits_its_span_exactly() -> None:
    nodes = {"a": Node(0, 0, CLAMPED_SUPPORT), "d": Node(0.1, 0.0, CLAMPED_SUPPORT), "e": Node(0.1, 0.05)}
    beams = {
        "x": Beam("a", "d", Section(1e9, 1e-2, 1e-3), CosineArch(0.004)),
        "y": Beam("d", "e", Section(1e9, 1e-2, 1e-3)),
    }
    fitted = BeamFits(Network(nodes, beams))["x"]
    assert (fitted.rotation, fitted.scale) == (pytest.approx(0, abs=1e-12), pytest.approx(1, rel=1e-12))
    assert fitted.length == pytest.approx(0.1 * (1 + (np.pi * 0.004 / 0.1) ** 2 / 4), rel=1e-4)
