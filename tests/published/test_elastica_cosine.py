"""Where the shallow cosine arch buckles, against its closed form; after Qiu, Lang and Slocum (2004).

J. Qiu, J. H. Lang, A. H. Slocum, J. Microelectromech. Syst. 13 (2004) 137: a clamped arch y = h (1 - cos 2 pi x/L) / 2
of thickness t = h/Q that is pushed at its centre, which does not turn, buckles into the mode 1 - cos 4 pi x/L if
Q > 2.31. While it does not, each half obeys E I (y - y0)'''' + P y'' = 0, and buckles at P = 16 pi^2 E I / L^2.
There y' = -(pi h / 3L) sin(2 pi x/L) + (2 h b / L) (1 - cos(4 pi x/L)), b = 4/3 - d/h, at the displacement d; that its
length has shrunk by P L / 2 E A gives 3 b^2 / 2 - 8 b / 9 + 2 pi^2 / 3 Q^2 - pi^2 / 9 = 0.
"""

from __future__ import annotations

import numpy as np
import pytest

import cfmkit.elastica as el

SPAN, RISE = 0.2, 0.5e-3  # shallow: the closed form leaves out terms of (h/L)^2


def pressed(ratio: float, points: np.ndarray, branch: str = "stable") -> el.Path:
    """Half an arch with `ratio` = rise / thickness, its middle taken to points, in rises."""
    section = el.Section(1e9, 10e-3, RISE / ratio)
    nodes = {
        "wall": el.Node(0, 0, el.CLAMPED_SUPPORT),
        "middle": el.Node(0.5 * SPAN, RISE, el.slider_support(np.pi / 2)),
    }
    arch = el.Network(nodes, {"half": el.Beam("wall", "middle", section, el.CosineArch(RISE, 0.5))})
    path = el.trace(arch, el.Displacement("middle", -np.pi / 2, points * RISE), el.Control(branch=branch))  # type: ignore[arg-type]
    assert path.status is el.PathStatus.COMPLETE
    return path


def places(ratio: float) -> np.ndarray:
    """Return the two displacements, in rises, at which the arch buckles and straightens again."""
    root = np.sqrt((8 / 9) ** 2 + 6 * (np.pi**2 / 9 - 2 * np.pi**2 / (3 * ratio**2)))
    return 4 / 3 - (8 / 9 + np.array([1, -1]) * root) / 3


@pytest.mark.parametrize("ratio", [2.4, 3.0])
def test_cosine_arch_buckles_and_straightens_where_its_closed_form_says(ratio: float) -> None:
    path = pressed(ratio, np.linspace(0.05, 1.98, 40))
    assert [(event.kind, event.before, event.after) for event in path.events] == [
        ("bifurcation", 0, 1),
        ("bifurcation", 1, 0),
    ]
    np.testing.assert_allclose([event.drive / RISE for event in path.events], places(ratio), atol=5e-5)
    assert path.stable.all()


@pytest.mark.parametrize("ratio", [6.0, 10.0, 20.0])
def test_thin_cosine_arch_buckles_where_its_closed_form_says(ratio: float) -> None:
    path = pressed(ratio, np.linspace(0.05, 1.0, 20))
    assert [event.kind for event in path.events] == ["bifurcation"]
    assert path.events[0].drive / RISE == pytest.approx(places(ratio)[0], abs=5e-5)
    assert path.stable.all()


@pytest.mark.parametrize("ratio", [2.0, 2.30])
def test_cosine_arch_thicker_than_the_limit_of_qiu_does_not_buckle(ratio: float) -> None:
    path = pressed(ratio, np.linspace(0.05, 1.98, 40), branch="primary")
    assert path.events == ()
    assert path.stable.all()


def test_cosine_arch_thinner_than_the_limit_of_qiu_buckles() -> None:
    """The limit, 2.31 as printed: 4 pi^2 / (64/81 + 2 pi^2 / 3) is its square."""
    assert np.sqrt(4 * np.pi**2 / (64 / 81 + 2 * np.pi**2 / 3)) == pytest.approx(2.31, abs=0.005)
    path = pressed(2.32, np.linspace(0.05, 1.98, 40), branch="primary")
    assert [event.kind for event in path.events] == ["bifurcation", "bifurcation"]


@pytest.mark.parametrize("ratio", [3.0, 10.0])
def test_buckled_cosine_arch_stays_on_the_line_of_its_mode(ratio: float) -> None:
    """Held in the mode at constant thrust: F L^3 / (E I h) = 64 pi^2 (4/3 - d/h)."""
    points = np.linspace(*places(ratio), 7)[1:-1]
    path = pressed(ratio, points)
    unit = 1e9 * 10e-3 * (RISE / ratio) ** 3 / 12 * RISE / SPAN**3
    force = 2 * path.effort[path.at_requested] / unit
    np.testing.assert_allclose(force, 64 * np.pi**2 * (4 / 3 - points), atol=0.1)
