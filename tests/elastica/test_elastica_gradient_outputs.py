"""Derivatives of every output by every kind of design variable, against differences along random directions."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from varied_networks import BUILDERS, KINDS, LAN, X, lan_pushed, pushed

import cfmkit.elastica as el
from cfmkit.errors import InputError

FINE = el.Control(tolerance=1e-11)


def outputs(path: Any, at: Any = slice(None)) -> dict[str, Any]:
    """Everything that can be requested at the requested points."""
    keep = path.at_requested[at]
    found = {"effort": path.effort[keep], "energy": path.energy[keep]}
    for node in path.network.nodes:
        found[f"motion {node}"] = path.motion(node)[keep]
    for node in path.mesh.bodies:
        found[f"reaction {node}"] = path.reaction(node)[keep]
    for beam in path.network.beams:
        found[f"start force {beam}"] = path.end_force(beam, 0)[keep]
        found[f"end force {beam}"] = path.end_force(beam, 1)[keep]
        found[f"shape {beam}"] = np.array([path.shape(beam, int(k)) for k in keep])
        sections = path.sections(beam)
        for name in ("moment", "normal", "shear", "bending_stress", "axial_stress"):
            found[f"{name} {beam}"] = getattr(sections, name)[keep]
        for axial in (True, False):
            extremes = path.stress_extremes(beam, axial)
            found[f"extremes {beam} {axial}"] = extremes.value[keep]
            found[f"places {beam} {axial}"] = extremes.place[keep]
    return found


def slopes(g: Any) -> dict[str, Any]:
    """The derivatives of the same."""
    found = {"effort": g.effort, "energy": g.energy}
    for node in g.path.network.nodes:
        found[f"motion {node}"] = g.motion(node)
    for node in g.path.mesh.bodies:
        found[f"reaction {node}"] = g.reaction(node)
    for beam in g.path.network.beams:
        found[f"start force {beam}"] = g.end_force(beam, 0)
        found[f"end force {beam}"] = g.end_force(beam, 1)
        found[f"shape {beam}"] = g.shape(beam)
        sections = g.sections(beam)
        for name in ("moment", "normal", "shear", "bending_stress", "axial_stress"):
            found[f"{name} {beam}"] = getattr(sections, name)
        for axial in (True, False):
            found[f"extremes {beam} {axial}"] = g.stress_extremes(beam, axial)
    return found


@given(way=st.lists(st.floats(-0.1, 0.1), min_size=len(LAN), max_size=len(LAN)).filter(any))
@settings(max_examples=5, deadline=None)
def test_a_force_changes_along_any_way_as_its_gradient_says(way: list[float]) -> None:
    x, step = LAN * (1.0 + 0.2 * np.array(way)), LAN * np.array(way)
    a, b, c, d = (outputs(el.trace(*lan_pushed(x + k * 1e-3 * step), FINE))["effort"] for k in (-2, -1, 1, 2))
    slope = el.gradient(el.trace(*lan_pushed(x), FINE), lan_pushed, x).effort @ step
    np.testing.assert_allclose(
        slope, (a - 8 * b + 8 * c - d) / 12e-3, atol=2e-6 * np.abs(slope).max() + 1e-9 * np.abs(b).max()
    )


@pytest.mark.parametrize(("build", "x"), BUILDERS, ids=[build.__name__ for build, _ in BUILDERS])
def test_derivatives_of_all_outputs_are_those_of_differences(build: Any, x: Any) -> None:
    exact = slopes(el.gradient(el.trace(*build(x), FINE), build, x))
    rng = np.random.default_rng(5)
    for _ in range(2):
        way = x * rng.uniform(0.5, 1.0, len(x)) * rng.choice([-1.0, 1.0], len(x))
        values = [outputs(el.trace(*build(x + step * 1e-3 * way), FINE)) for step in (-2, -1, 1, 2)]
        for name, slope in exact.items():
            a, b, c, d = (one[name] for one in values)
            want = (a - 8 * b + 8 * c - d) / 12e-3
            same = np.ones(want.shape, dtype=bool)
            if name.startswith("extremes"):  # where two peaks are equally high the highest has no derivative
                same = np.ptp([one[name.replace("extremes", "places")] for one in values], axis=0) < 0.02
            off = np.abs(slope @ way - want)[same]
            limit = 1e-5 if name.startswith("extremes") else 2e-6  # those are interpolated between sampled places
            assert (off <= limit * np.abs(want).max() + 1e-10).all(), (name, off.max(), np.abs(want).max())


@pytest.mark.parametrize(
    "name", ["line spring", "its direction", "follower", "support direction", "corner", "spline point"]
)
def test_each_of_the_rarer_variables_has_its_own_derivative(name: str) -> None:
    """Effort and reactions by springs, loads, supports, corners: one by one, so that no error hides in a sum."""
    kind = KINDS.index(name)
    found = el.gradient(el.trace(*pushed(X), FINE), pushed, X)
    way = np.zeros(len(X))
    way[kind] = 1e-3 * X[kind]
    values = [el.trace(*pushed(X + step * way), FINE) for step in (-2, -1, 1, 2)]
    for slope, output in (
        (found.effort[:, kind], lambda p: p.effort[p.at_requested]),
        (found.reaction("c")[:, :, kind], lambda p: p.reaction("c")[p.at_requested]),
    ):
        a, b, c, d = (output(p) for p in values)
        want = (a - 8 * b + 8 * c - d) / (12 * way[kind])
        np.testing.assert_allclose(slope, want, rtol=1e-6, atol=1e-6 * np.abs(want).max())


def test_a_variable_that_changes_the_make_up_is_refused() -> None:
    def build(x: Any) -> el.Network:
        joint = "pin" if np.iscomplexobj(x) else "rigid"
        beam = el.Beam("a", "b", el.Section(2e9, 8e-3, 1e-3), el.Polynomial((0.0, x[0])), end_joint=joint)  # type: ignore[arg-type]
        return el.Network(
            {"a": el.Node(0, 0, el.CLAMPED_SUPPORT), "b": el.Node(0.1, 0.0, el.slider_support(np.pi / 2))}, {"ab": beam}
        )

    path = el.trace(build(np.array([0.3])), el.Displacement("b", np.pi / 2, np.array([1e-3])))
    with pytest.raises(InputError, match="changes the make-up of the network"):
        el.gradient(path, build, np.array([0.3]))
