"""Identities and invariants of the beam engine."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import cfmkit.elastica as el
from cfmkit.elastica import BeamOnObstacle, NodeOnObstacle, circle_edge
from cfmkit.elastica.model.beam_fits import BeamFits
from cfmkit.errors import InputError

TIGHT = el.Control(tolerance=1e-10)
UP = np.pi / 2
TAPER = el.Taper(np.array([0, 0.4, 1]), np.array([1.0e-3, 1.6e-3, 0.8e-3]))


def frame(
    section: el.Section | None = None,
    turn: float = 0.0,
    size: float = 1.0,
    mirrored: bool = False,
    bend: tuple[float, float] = (0.8, -0.5),
) -> el.Network:
    """Return a network with curved and straight beams, a pin, a spring, an offset and a linked node."""
    section = section or el.Section(2e9, 8e-3 * size, _scaled(TAPER, size), shear=True)
    sign = -1.0 if mirrored else 1.0

    def at(x: float, y: float, support: el.Support = el.FREE_SUPPORT) -> el.Node:
        c, s = np.cos(turn), np.sin(turn)
        support = dataclasses.replace(support, direction=sign * support.direction + turn)
        y *= sign
        return el.Node(size * (c * x - s * y), size * (s * x + c * y), support)

    def arm(x: float, y: float) -> tuple[float, float]:
        c, s = np.cos(turn), np.sin(turn)
        y *= sign
        return size * (c * x - s * y), size * (s * x + c * y)

    nodes = {
        "a": at(0, 0, el.CLAMPED_SUPPORT),
        "b": at(0.05, 0.03),
        "bb": at(0.055, 0.03),
        "c": at(0.09, 0.0, el.PINNED_SUPPORT),
        "d": at(0.06, 0.07, el.slider_support(UP)),
    }
    beams = {
        "ab": el.Beam("a", "b", section, el.Polynomial((0.0, sign * bend[0], sign * bend[1]))),
        "bc": el.Beam("bb", "c", section, el.arc(-sign * 0.7), end_joint="pin"),
        "bd": el.Beam("b", "d", section, start_offset=arm(0.0, 0.004)),
    }
    springs = (
        el.TorsionSpring(None, "b", 0.02 * size**3),
        el.LineSpring("b", None, 30.0 * size, ground=arm(0.0, 0.06)),
    )
    return el.Network(nodes, beams, links=(el.Link("b", "bb"),), springs=springs)


def _scaled(taper: el.Taper, size: float) -> el.Taper:
    return el.Taper(taper.stations, np.array(taper.values) * size)


def driven(network: el.Network, travel: np.ndarray, turn: float = 0.0, control: el.Control = TIGHT) -> el.Path:
    path = el.trace(network, el.Displacement("d", -UP + turn, travel), control)
    assert path.status is el.PathStatus.COMPLETE, path.message
    return path


TRAVEL = np.array([2e-3, 5e-3, 9e-3])


@pytest.fixture(scope="module")
def reference() -> el.Path:
    return driven(frame(), TRAVEL)


@given(turn=st.floats(-np.pi, np.pi))
@settings(max_examples=4, deadline=None)
def test_a_turned_network_has_the_same_forces(reference: el.Path, turn: float) -> None:
    p = driven(frame(turn=turn), TRAVEL, turn)
    np.testing.assert_allclose(p.effort[p.at_requested], reference.effort[reference.at_requested], rtol=1e-8)
    c, s = np.cos(turn), np.sin(turn)
    moved, was = p.motion("bb")[-1], reference.motion("bb")[-1]
    np.testing.assert_allclose(moved, [c * was[0] - s * was[1], s * was[0] + c * was[1], was[2]], atol=1e-10)


@given(bend=st.tuples(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0)))
@settings(max_examples=4, deadline=None)
def test_a_mirrored_network_has_mirrored_motions(bend: tuple[float, float]) -> None:
    p = el.trace(frame(bend=bend), el.Displacement("d", -UP, TRAVEL), TIGHT)
    q = el.trace(frame(bend=bend, mirrored=True), el.Displacement("d", UP, TRAVEL), TIGHT)
    assert p.status is q.status
    np.testing.assert_allclose(q.effort, p.effort, rtol=1e-8)
    np.testing.assert_allclose(q.motion("b"), p.motion("b") * [1, -1, -1], atol=1e-10)


@given(size=st.floats(0.1, 25.0))
@settings(max_examples=3, deadline=None)
def test_a_scaled_network_has_scaled_forces(reference: el.Path, size: float) -> None:
    """All lengths times k (width too): forces times k^2, torsion springs times k^3, line springs times k."""
    p = driven(frame(size=size), TRAVEL * size)
    np.testing.assert_allclose(p.effort[p.at_requested], reference.effort[reference.at_requested] * size**2, rtol=1e-8)


def rubbing(size: float) -> el.Path:
    """Return the path of a cantilever whose clamp is lowered and raised, and whose round tip rubs on a disc."""
    nodes = {"root": el.Node(0, 0, el.slider_support(UP)), "tip": el.Node(size, 0)}
    disc = NodeOnObstacle("disc", "tip", circle_edge((1.1 * size, -0.4 * size), 0.3 * size), 0.05 * size, friction=0.2)
    beam = el.Beam("root", "tip", el.Section(1.0, 12.0 * size, size, axial=False))
    drive = el.Displacement("root", -UP, size * np.array([0.2, 0.3, 0.1]))
    return el.trace(el.Network(nodes, {"b": beam}, contacts=(disc,)), drive, TIGHT)


def wrapping(size: float) -> el.Path:
    """Return the path of a leaf whose side a force at its tip presses onto a disc."""
    nodes = {"root": el.Node(0, 0, el.CLAMPED_SUPPORT), "tip": el.Node(size, 0)}
    disc = BeamOnObstacle("disc", "b", circle_edge((0.5 * size, -0.1 * size), 0.045 * size))
    beam = el.Beam("root", "tip", el.Section(1.2e7, size, 0.01 * size, axial=False))
    drive = el.Loading((el.PointLoad("tip", fy=-(size**2)),), np.array([0.4, 1.0, 3.0, 0.4]))
    return el.trace(el.Network(nodes, {"b": beam}, contacts=(disc,)), drive, TIGHT)


@pytest.mark.parametrize("size", [0.02, 30.0])
@pytest.mark.parametrize(("build", "by_motion"), [(rubbing, True), (wrapping, False)])
def test_contacts_of_another_size_have_scaled_forces_and_change_at_the_same_share(
    build: object, by_motion: bool, size: float
) -> None:
    """All lengths times k: forces times k^2."""
    one, other = build(1.0), build(size)  # type: ignore[operator]
    force = one.contact_force(0)[one.at_requested]
    assert force.max() > 0.1
    np.testing.assert_allclose(other.contact_force(0)[other.at_requested], force * size**2, rtol=1e-7, atol=1e-12)
    assert [event.kind for event in other.contact_events] == [event.kind for event in one.contact_events]
    drives = [event.drive * (size if by_motion else 1.0) for event in one.contact_events]
    assert [event.drive for event in other.contact_events] == pytest.approx(drives, rel=1e-7)


def test_a_guide_bears_no_force_along_itself() -> None:
    p = el.trace(frame(), el.Rotation("b", np.array([0.1, 0.3])), TIGHT)
    np.testing.assert_allclose(p.reaction("d")[:, 1], 0, atol=1e-9)
    assert p.motion("b")[-1, 2] == pytest.approx(0.3)


def test_linked_nodes_move_as_one_body(reference: el.Path) -> None:
    b, bb = reference.motion("b"), reference.motion("bb")
    np.testing.assert_allclose(b[:, 2], bb[:, 2])
    gap = np.array([0.005, 0.0]) + (bb - b)[:, :2]
    np.testing.assert_allclose(np.hypot(*gap.T), 0.005, rtol=1e-12)


def test_force_control_and_displacement_control_agree(reference: el.Path) -> None:
    force = float(reference.effort[-1])
    if not (np.diff(reference.effort) > 0).all():
        pytest.fail("the reference is meant to stiffen monotonically")
    p = el.trace(frame(), el.Loading((el.PointLoad("d", fy=-force),), np.array([1.0])), TIGHT)
    assert -p.motion("d")[-1, 1] == pytest.approx(9e-3, rel=1e-7)


def test_a_path_repeats_bit_by_bit(reference: el.Path) -> None:
    np.testing.assert_array_equal(driven(frame(), TRAVEL).effort, reference.effort)


def test_results_cannot_be_written_to(reference: el.Path) -> None:
    for array in (reference.effort, reference.drive, reference.motion("b"), reference.stable):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1


def test_shapes_by_points_approach_the_exact_arc() -> None:
    angles = np.linspace(-0.6, 0.6, 41)
    circle = np.column_stack([0.1 * np.sin(angles), 0.1 - 0.1 * np.cos(angles)])
    section = el.Section(2e9, 8e-3, 1e-3)

    def force(shape: object) -> float:
        nodes = {"a": el.Node(*circle[0], el.CLAMPED_SUPPORT), "d": el.Node(*circle[-1], el.slider_support(0.0))}
        network = el.Network(nodes, {"x": el.Beam("a", "d", section, shape)})  # type: ignore[arg-type]
        return float(el.trace(network, el.Displacement("d", np.pi, [5e-3]), TIGHT).effort[-1])

    exact = force(el.arc(1.2))
    assert force(el.Spline(circle)) == pytest.approx(exact, rel=1e-5)
    assert force(el.Polyline(circle)) == pytest.approx(exact, rel=2e-3)
    assert force(el.Polyline(circle)) != pytest.approx(exact, rel=1e-6)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: el.Network({"a": el.Node(0, 0)}, {}), "at least one beam"),
        (lambda: el.Network({"a": el.Node(0, 0)}, {"x": el.Beam("a", "z", el.Section(1, 1, 1))}), "not a node"),
        (lambda: el.Beam("a", "a", el.Section(1, 1, 1)), "two different nodes"),
        (lambda: el.Section(1.0, 1.0, -1.0), "thickness must be positive"),
        (lambda: el.Section(float("nan"), 1.0, 1.0), "youngs_modulus"),
        (lambda: el.Taper(np.array([0, 0.5]), np.array([1, 1])), "from 0 to 1"),
        (lambda: el.Displacement("a", 0.0, [0.0]), "other than zero"),
        (lambda: el.Control(tolerance=0.0), "tolerance"),
        (lambda: el.Support(displacement=(1.0, 0, 0)), "not held"),
        (lambda: el.trace(frame(), el.Displacement("a", 0.0, [1.0])), "it is held"),
        (lambda: el.trace(frame(), el.Displacement("bb", 0.0, [1.0])), "cannot be driven"),
        (lambda: el.trace(frame(), el.Displacement("d", 0.3, [1.0])), "it is held"),
        (lambda: el.trace(frame(), el.Displacement("d", np.inf, [1.0])), "cannot be moved along inf deg"),
        (
            lambda: el.Network({"z": el.Node(0, 0)}, {"x": el.Beam("a", "z", el.Section(1, 1, 1))}),
            "'a', which is not a node",
        ),
        (lambda: dataclasses.replace(frame(), springs=(el.LineSpring("d", "d", 1.0),)), "ends at one place"),
        (lambda: el.Beam("a", "b", el.Section(1, 1, 1), start_joint="hinge"), "got 'hinge'"),
        (lambda: el.Beam("a", "b", el.Section(1, 1, 1), end_joint="hinge"), "got 'hinge'"),
        (lambda: el.Support(True, True, displacement=np.array([0.0, 0.0, 1.0])), "rotation is given"),
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
    sprung = dataclasses.replace(network, springs=(*network.springs, el.SlideSpring("d", UP, 50.0)))
    more, less = (driven(net, TRAVEL).effort[-1] for net in (sprung, network))
    assert more - less == pytest.approx(50.0 * 9e-3, rel=1e-9)


def test_a_cosine_arch_fits_its_span_exactly() -> None:
    nodes = {
        "a": el.Node(0, 0, el.CLAMPED_SUPPORT),
        "d": el.Node(0.1, 0.0, el.CLAMPED_SUPPORT),
        "e": el.Node(0.1, 0.05),
    }
    beams = {
        "x": el.Beam("a", "d", el.Section(1e9, 1e-2, 1e-3), el.CosineArch(0.004)),
        "y": el.Beam("d", "e", el.Section(1e9, 1e-2, 1e-3)),
    }
    fitted = BeamFits(el.Network(nodes, beams))["x"]
    assert (fitted.rotation, fitted.scale) == (pytest.approx(0, abs=1e-12), pytest.approx(1, rel=1e-12))
    assert fitted.length == pytest.approx(0.1 * (1 + (np.pi * 0.004 / 0.1) ** 2 / 4), rel=1e-4)
