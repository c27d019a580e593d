"""A stated imperfection takes a network past its bifurcations without a choice of branch, and is named."""

from __future__ import annotations

import numpy as np
import pytest

from cfmkit.elastica import CLAMPED, Beam, Control, Displacement, Network, Node, Path, Section, guided, trace
from cfmkit.errors import InputError

TRAVEL = np.arange(1, 13) * 0.5e-3


def pressed(imperfection: float = 0.0, thickness: float = 1e-3) -> Path:
    length, angle = 35e-3, np.radians(7)
    nodes = {"wall": Node(0, 0, CLAMPED), "d": Node(length * np.cos(angle), length * np.sin(angle), guided(np.pi / 2))}
    network = Network(nodes, {"v": Beam("wall", "d", Section(1477e6, 6e-3, thickness))})
    return trace(network, Displacement("d", -np.pi / 2, TRAVEL), Control(imperfection=imperfection))


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
    assert np.abs(deviation(up)).max() == pytest.approx(1e-5, rel=0.1)


def test_a_path_without_bifurcation_gets_no_imperfection_and_says_so() -> None:
    path, plain = pressed(1e-5, thickness=1.4e-3), pressed(thickness=1.4e-3)
    assert path.imperfection == "none: the perfect path has no bifurcation"
    np.testing.assert_array_equal(path.effort, plain.effort)


def test_an_imperfection_must_be_finite() -> None:
    with pytest.raises(InputError, match="imperfection"):
        Control(imperfection=np.nan)
