"""The derivatives written out for plain beams are those of complex steps, which serve all other networks."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from cfmkit.elastica import CLAMPED, Beam, Displacement, Network, Node, Polynomial, Section, gradient, guided, trace
from cfmkit.elastica.sensitivity import array_derivatives

LAN = np.array([1.877, 3.05, 1.244, 2.40, 1.3092, -1.5707, -0.7560, 1.5707, 0.3013, 1.5707, 0.226, -1.148, 1.0, 2.0])


def lan(x: Any) -> Network:
    """Node positions [cm], shape coefficients, thickness [mm] and modulus [GPa]; beams that stretch and shear."""
    section = Section(x[13] * 1e9, 10e-3, x[12] * 1e-3, shear=True)
    nodes = {
        "n1": Node(0.25e-2, 0, CLAMPED),
        "n2": Node(3.45e-2, 0, CLAMPED),
        "n3": Node(x[1] * 1e-2, x[0] * 1e-2),
        "n4": Node(x[2] * 1e-2, x[3] * 1e-2),
        "n5": Node(0.25e-2, 4e-2, guided(np.pi / 2)),
    }
    ends = [("n1", "n3"), ("n2", "n3"), ("n3", "n4"), ("n4", "n5")]
    beams = {
        f"b{k}": Beam(a, b, section, Polynomial((0.5, x[4 + 2 * k], x[5 + 2 * k])), end_offset=(1e-4 * x[0], 1e-3))
        for k, (a, b) in enumerate(ends)
    }
    return Network(nodes, beams)


@pytest.mark.parametrize("every", [False, True])
def test_written_out_derivatives_are_those_of_complex_steps(monkeypatch: pytest.MonkeyPatch, every: bool) -> None:
    path = trace(lan(LAN), Displacement("n5", -np.pi / 2, np.array([2e-3])))
    solver = path.solver
    written = array_derivatives.ComplexSteps(path.layout, lan, LAN)
    assert written.plain is not None
    monkeypatch.setattr(array_derivatives, "plain_slopes", lambda *_: None)
    stepped = array_derivatives.ComplexSteps(path.layout, lan, LAN)
    assert stepped.plain is None
    one, other = (tilts.arrays(solver.model, solver.cut, every) for tilts in (written, stepped))
    for name in one._fields:
        a, b = getattr(one, name), getattr(other, name)
        assert a.shape == b.shape, name
        if every and name == "touches":  # with pairs that are requested and not needed, complex steps mark them, too
            assert not (a & ~b).any()
            continue
        np.testing.assert_allclose(a, b, rtol=1e-9, atol=1e-11 * max(1.0, np.abs(b).max(initial=0.0)), err_msg=name)


def test_outputs_that_look_at_the_shape_of_beams_are_the_same_both_ways(monkeypatch: pytest.MonkeyPatch) -> None:
    path = trace(lan(LAN), Displacement("n5", -np.pi / 2, np.array([2e-3, 4e-3])))
    written = gradient(path, lan, LAN)
    monkeypatch.setattr(array_derivatives, "plain_slopes", lambda *_: None)
    stepped = gradient(path, lan, LAN)
    for beam in path.layout.network.beams:
        for a, b in (
            (written.shape(beam), stepped.shape(beam)),
            (written.sections(beam).bending_stress, stepped.sections(beam).bending_stress),
            (written.stress_extremes(beam), stepped.stress_extremes(beam)),
        ):
            np.testing.assert_allclose(a, b, rtol=1e-7, atol=1e-9 * np.abs(b).max())
    np.testing.assert_allclose(written.effort, stepped.effort, rtol=1e-9)
