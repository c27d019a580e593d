"""Classical problems of large deflection: closed forms, elliptic integrals and published digits.

References
----------
[FF] R. Frisch-Fay, Flexible Bars, Butterworths, London 1962.
[TG] S. P. Timoshenko, J. M. Gere, Theory of Elastic Stability, 2nd ed., McGraw-Hill 1961.
[TS] S. P. Timoshenko, Strength of Materials, part II, 3rd ed., Van Nostrand 1956.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq
from scipy.special import ellipe, ellipk

import cfmkit.elastica as el

FINE = el.Control(tolerance=1e-9)
RIGIDITY = 2.0e-2  # E b t^3 / 12 of the section below [N m2]
SLIM = el.Section(2.4e9, 0.1, 1e-3, axial=False)
LENGTH = 0.4


def cantilever(section: el.Section = SLIM, **beam: object) -> el.Network:
    nodes = {"root": el.Node(0, 0, el.CLAMPED_SUPPORT), "tip": el.Node(LENGTH, 0)}
    return el.Network(nodes, {"beam": el.Beam("root", "tip", section, **beam)})  # type: ignore[arg-type]


def pushed(network: el.Network, points: list[float], control: el.Control = FINE, **load: object) -> el.Path:
    path = el.trace(network, el.Loading((el.PointLoad("tip", **load),), np.array(points)), control)  # type: ignore[arg-type]
    assert path.status is el.PathStatus.COMPLETE, path.message
    return path


def test_cantilever_under_an_inclined_end_force_obeys_its_elliptic_integral() -> None:
    """[FF] Force at angle b to the beam: sqrt(P/EI) L = integral of d(psi)/sqrt(2(cos(b - tip) - cos(b - psi)))."""
    lean, force = np.radians(135.0), 4.0 * RIGIDITY / LENGTH**2
    p = pushed(cantilever(), [force], fx=float(np.cos(lean)), fy=float(np.sin(lean)))
    tip = float(p.motion("tip")[-1, 2])

    def reach(weight: object) -> float:
        # psi = tip (1 - s^2) removes the root's singularity at the tip
        def f(s: float) -> float:
            psi = tip * (1 - s * s)
            drop = np.cos(lean - tip) - np.cos(lean - psi)
            return float(weight(psi) * 2 * tip * s / np.sqrt(2 * drop))  # type: ignore[operator]

        return float(quad(f, 0, 1, epsabs=1e-12, epsrel=1e-12)[0]) * np.sqrt(RIGIDITY / force)

    assert reach(lambda psi: 1.0) == pytest.approx(LENGTH, rel=1e-8)
    assert reach(np.cos) == pytest.approx(LENGTH + p.motion("tip")[-1, 0], rel=1e-8)
    assert reach(np.sin) == pytest.approx(p.motion("tip")[-1, 1], rel=1e-8)


@pytest.mark.parametrize("factor", [1.0, 4.0, 10.0])
def test_cantilever_under_a_follower_force(factor: float) -> None:
    """Seen from the tip an initial-value problem, alpha'' = k cos(alpha), so that L is a quadrature of the angle.

    B. S. Shvartsman, J. Sound Vib. 304 (2007) 969.
    """
    k = factor / LENGTH**2

    def length(tip: float) -> float:
        return quad(lambda r: 2 / np.sqrt(2 * k * np.sin(r * r) / (r * r)), 0, np.sqrt(tip), epsabs=1e-13)[0]

    tip = brentq(lambda angle: length(angle) - LENGTH, 1e-6, np.pi - 1e-9, xtol=1e-13)
    p = pushed(cantilever(), [factor * RIGIDITY / LENGTH**2], fy=1.0, follows=True)
    assert p.motion("tip")[-1, 2] == pytest.approx(tip, abs=1e-8)


def test_column_buckles_at_euler_s_load_and_follows_the_elastica() -> None:
    """Clamped-free: P/Pcr = (2 K/pi)^2, height 2E/K - 1, deflection 2k/K, k = sin(tip angle / 2) [TG, sec. 2.7]."""
    critical = np.pi**2 * RIGIDITY / (4 * LENGTH**2)
    ratios = np.array([0.5, 1.05, 1.3, 2.0])
    p = pushed(cantilever(), (critical * ratios).tolist(), fx=-1.0)
    assert p.events[0].kind == "bifurcation"
    assert p.events[0].drive == pytest.approx(critical, rel=1e-7)
    moved = p.motion("tip")[p.at_requested]
    assert p.stable[p.at_requested].all()
    assert np.abs(moved[0]).max() < 1e-9
    for ratio, (dx, dy, turn) in zip(ratios[1:], moved[1:], strict=True):
        k = brentq(lambda k, r=ratio: (2 * ellipk(k * k) / np.pi) ** 2 - r, 1e-6, 0.99999, xtol=1e-15)
        assert abs(turn) == pytest.approx(2 * np.arcsin(k), abs=1e-8)
        assert (dx + LENGTH) / LENGTH == pytest.approx(2 * ellipe(k * k) / ellipk(k * k) - 1, abs=1e-8)
        assert abs(dy) / LENGTH == pytest.approx(2 * k / ellipk(k * k), abs=1e-8)


def test_column_kept_on_its_primary_path_is_marked_unstable() -> None:
    critical = np.pi**2 * RIGIDITY / (4 * LENGTH**2)
    p = pushed(cantilever(), [2 * critical], el.Control(branch="primary"), fx=-1.0)
    assert p.unstable[-1] == 1
    assert np.abs(p.motion("tip")[-1]).max() < 1e-9


def test_curved_beam_under_an_end_moment_only_changes_its_curvature() -> None:
    """A circle stays one: curvature 1/R + M/EI [FF]."""
    sweep, turn = np.pi / 2, -1.2
    p = el.trace(cantilever(shape=el.arc(sweep)), el.Rotation("tip", np.array([turn])), FINE)
    length = LENGTH * (sweep / 2) / np.sin(sweep / 2)
    start = -sweep / 2
    radius = length / (sweep + turn)
    x, y = (
        radius * (np.sin(start + sweep + turn) - np.sin(start)),
        radius * (np.cos(start) - np.cos(start + sweep + turn)),
    )
    np.testing.assert_allclose(p.motion("tip")[-1, :2], [x - LENGTH, y], atol=1e-10)
    assert p.effort[-1] == pytest.approx(turn * RIGIDITY / length, rel=1e-9)


def test_shear_flexible_cantilever() -> None:
    """Deflection by bending and by shear, P L^3 / 3 EI + P L / (kappa G A), kappa = 5/6 [TS]."""
    section = el.Section(2.4e9, 0.1, 0.08, shear=True, poisson_ratio=0.25)
    stiff, shear = 2.4e9 * 0.1 * 0.08**3 / 12, 5 / 6 * 2.4e9 / 2.5 * 0.1 * 0.08
    p = pushed(cantilever(section), [1.0], fy=1.0)
    assert p.motion("tip")[-1, 1] == pytest.approx(LENGTH**3 / (3 * stiff) + LENGTH / shear, rel=1e-8)


def test_stepped_cantilever() -> None:
    """The same integral in two parts [TS]."""
    section = el.Section(
        2.4e9, 0.1, el.Taper(np.array([0, 0.3, 0.3, 1]), np.array([2e-3, 2e-3, 1e-3, 1e-3])), axial=False
    )
    force, cut = 1e-6, 0.3 * LENGTH
    thick, thin = 8 * RIGIDITY, RIGIDITY
    exact = (LENGTH**3 - (LENGTH - cut) ** 3) / (3 * thick) + (LENGTH - cut) ** 3 / (3 * thin)
    assert pushed(cantilever(section), [force], fy=1.0).motion("tip")[-1, 1] == pytest.approx(force * exact, rel=1e-8)


def test_cantilever_under_its_own_weight_small_and_large() -> None:
    """Small: w L4 / 8 EI. Large: EI psi'' = w (L - s) cos(psi), by collocation.

    F. V. Rohde, Q. Appl. Math. 11 (1953) 337.
    """
    from scipy.integrate import solve_bvp

    factor = 8.0
    weight = factor * RIGIDITY / LENGTH**3
    p = el.trace(cantilever(), el.Loading((el.LineLoad("beam", wy=-weight),), np.array([1e-6, 1.0])), FINE)
    moved = p.motion("tip")[p.at_requested]
    assert moved[0, 1] == pytest.approx(-1e-6 * weight * LENGTH**4 / (8 * RIGIDITY), rel=1e-6)

    def slopes(s: np.ndarray, y: np.ndarray) -> np.ndarray:
        return np.vstack([y[1], factor * (1 - s) * np.cos(y[0]), np.cos(y[0]), np.sin(y[0])])

    s = np.linspace(0, 1, 41)
    guess = np.vstack([-s, -1 + s, s, -s * s / 2])
    found = solve_bvp(slopes, lambda a, b: np.array([a[0], b[1], a[2], a[3]]), s, guess, tol=1e-10, max_nodes=20000)
    assert found.success
    np.testing.assert_allclose(
        moved[1], [(found.y[2, -1] - 1) * LENGTH, found.y[3, -1] * LENGTH, found.y[0, -1]], atol=2e-9
    )


def test_pretensioned_beam_is_stiffened_as_a_tie_rod() -> None:
    """Guided end, tension N: k = N / (l (1 - tanh(u)/u)), l = L (1 + strain), u = L sqrt(N (1 + strain) / EI) / 2.

    Two halves of a tie rod [TS], of a material whose bending rigidity is per unit of the length before.
    """
    section = el.Section(2.4e9, 0.1, 1e-3)
    pull = 2e-5 * LENGTH
    nodes = {
        "root": el.Node(0, 0, el.Support(True, True, True, displacement=(-pull, 0, 0))),
        "tip": el.Node(LENGTH, 0, el.slider_support(np.pi / 2)),
    }
    p = el.trace(
        el.Network(nodes, {"beam": el.Beam("root", "tip", section)}), el.Displacement("tip", np.pi / 2, [1e-7]), FINE
    )
    stretch, tension = 1 + 2e-5, 2.4e9 * 0.1 * 1e-3 * 2e-5
    u = 0.5 * LENGTH * np.sqrt(tension * stretch / RIGIDITY)
    assert p.effort[-1] / 1e-7 == pytest.approx(tension / (stretch * LENGTH * (1 - np.tanh(u) / u)), rel=1e-7)


def test_precompressed_clamped_beam_buckles_at_four_pi_squared() -> None:
    """P = 4 pi^2 EI / L^2 [TG, sec. 2.2], here of a beam that is shorter by its strain."""
    section = el.Section(2.4e9, 0.1, 1e-3)
    nodes = {"root": el.Node(0, 0, el.CLAMPED_SUPPORT), "tip": el.Node(LENGTH, 0, el.slider_support(0.0))}
    p = el.trace(
        el.Network(nodes, {"beam": el.Beam("root", "tip", section)}),
        el.Displacement("tip", np.pi, [1e-4 * LENGTH]),
        FINE,
    )
    critical = 4 * np.pi**2 * RIGIDITY / LENGTH**2
    event = p.events[0]
    # Reissner: P = EA e at the bifurcation, and P (1 - e) = 4 pi^2 EI / (L (1 - e))^2 (1 - e)^2
    strain = event.drive / LENGTH
    assert event.kind == "bifurcation"
    assert 2.4e9 * 0.1 * 1e-3 * strain * (1 - strain) == pytest.approx(critical, rel=1e-6)
    assert p.stable[-1]
    assert np.abs(p.shape("beam", -1)[:, 1]).max() > 1e-4


def test_springs_at_the_tip_and_root_add_as_they_should() -> None:
    force, stiffness = 1e-7, 0.7
    nodes = {"root": el.Node(0, 0, el.CLAMPED_SUPPORT), "tip": el.Node(LENGTH, 0)}
    sprung = el.Network(
        nodes, {"beam": el.Beam("root", "tip", SLIM)}, springs=(el.SlideSpring("tip", np.pi / 2, stiffness),)
    )
    assert pushed(sprung, [force], fy=1.0).motion("tip")[-1, 1] == pytest.approx(
        force / (3 * RIGIDITY / LENGTH**3 + stiffness), rel=1e-7
    )
    nodes = {"root": el.Node(0, 0, el.PINNED_SUPPORT), "tip": el.Node(LENGTH, 0)}
    hinged = el.Network(nodes, {"beam": el.Beam("root", "tip", SLIM)}, springs=(el.TorsionSpring(None, "root", 0.03),))
    turn = pushed(hinged, [0.06], moment=1.0).motion("tip")[-1, 2]
    assert turn == pytest.approx(0.06 / 0.03 + 0.06 * LENGTH / RIGIDITY, rel=1e-9)
