"""Derivatives by design variables from the functional: beside those of traced paths, and differences."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from equilibria import equilibria
from varied_networks import LAN, X, arms, lan, pushed, turned

from cfmkit.elastica import (
    CLAMPED_SUPPORT,
    Beam,
    Control,
    Displacement,
    Link,
    Network,
    Node,
    Polynomial,
    Section,
    gradient,
    slider_support,
    trace,
)
from cfmkit.elastica.mechanics import energy
from cfmkit.elastica.mechanics.design_derivatives import Equilibria, effort_slopes, unknown_slopes
from cfmkit.elastica.mechanics.designs import NetworkDesigns, design_of, set_up
from cfmkit.elastica.mechanics.discretise import discretise
from cfmkit.elastica.results import beam_states
from cfmkit.elastica.results.path import node_motion, strain_energy
from cfmkit.numerics.dual_array import COMPLEX_STEP

FINE = Control(tolerance=1e-11)


def stepped(template: Any, build: Any, x: Any) -> NetworkDesigns:
    """Return a complex step in each variable of a function that builds network and drive."""
    each = [build(x + 1j * COMPLEX_STEP * unit) for unit in np.eye(len(x))]
    return set_up(template, build(x), each)


def lan_pushed(x: Any) -> Any:
    return lan(x), Displacement("n5", -np.pi / 2, np.array([2e-3, 6e-3]))


def arms_pushed(x: Any) -> Any:
    return arms(x), Displacement("d", -np.pi / 2, np.array([2e-3, 6e-3]))


CASES = [
    (lan_pushed, LAN),
    (arms_pushed, np.array([1.3e-3, 4e-3, 2e-3, 3e-3])),
    (pushed, X),
    pytest.param(turned, X, marks=pytest.mark.slow),
]


@pytest.mark.parametrize(("build", "x"), CASES)
def test_effort_slopes_are_those_of_the_gradient_of_a_trace(build: Any, x: Any) -> None:
    """By nodes, offsets, shapes, sections, springs, loads, supports: every kind of variable that there is."""
    net, drive = build(x)
    known = gradient(trace(net, drive, FINE), build, x).effort
    at, rates = equilibria(net, drive)
    found = effort_slopes(at, stepped(at.mesh, build, x), rates)
    size = np.abs(known * x).max()
    np.testing.assert_allclose(found * x, known * x, rtol=2e-6, atol=1e-7 * size)


def test_unknowns_have_the_slopes_of_differences() -> None:
    net, drive = arms_pushed(CASES[1][1])
    x = np.array(CASES[1][1])
    at, _ = equilibria(net, drive, 10)
    exact = unknown_slopes(at, stepped(at.mesh, arms_pushed, x))
    for k in range(len(x)):
        h = 1e-4 * x[k]
        sides = [equilibria(*arms_pushed(x + step * h * np.eye(len(x))[k]), 10)[0] for step in (-1, 1)]
        scales = [side.mesh.scales.length / at.mesh.scales.length for side in sides]
        node = at.mesh.bodies["b"]
        moved = [side.z[:, node] * np.array([scale, scale, 1.0]) for side, scale in zip(sides, scales, strict=True)]
        slope = (moved[1] - moved[0]) / (2 * h)
        np.testing.assert_allclose(exact[:, k, node], slope, rtol=1e-5, atol=1e-6 * np.abs(slope).max())


def hooked(x: Any) -> Any:
    """Two beams of several elements: one at an arm, with an offset, that turns by 3.4 rad, and a thin one."""
    section = Section(2e9, 10e-3, x[0], shear=True)
    nodes = {
        "arm": Node(5e-3, 0.0),
        "a": Node(0.0, 0.0, CLAMPED_SUPPORT),
        "b": Node(30e-3, 20e-3 * x[3], slider_support(-np.pi / 2)),
        "c": Node(60e-3, 0.0, CLAMPED_SUPPORT),
    }
    beams = {
        "hook": Beam("arm", "b", section, Polynomial((0.0, x[1], x[2])), end_offset=(1e-3, 2e-3)),
        "thin": Beam("b", "c", replace(section, thickness=0.5 * x[0]), Polynomial((0.0, -x[1]))),
    }
    return Network(nodes, beams, links=(Link("a", "arm"),)), Displacement("b", -np.pi / 2, np.array([1e-3]))


HOOK = np.array([1e-3, 2.8, 0.6, 1.0])


@pytest.mark.parametrize(("build", "x", "pieces"), [(lan_pushed, LAN, 1), (lan_pushed, LAN, 2), (hooked, HOOK, 1)])
def test_networks_of_plain_beams_are_set_up_together_as_one_by_one(build: Any, x: Any, pieces: int) -> None:
    """Real designs, and complex steps of each variable."""
    net, drive = build(x)
    template = discretise(net, drive, 7, pieces)
    steps = 1j * COMPLEX_STEP * np.diag(x)
    moved = [x * (1 + 0.01 * k) for k in range(3)]
    for variables in ([x + step for step in steps], moved):
        networks = [build(own) for own in variables]
        together = set_up(template, (net, drive), networks)
        assert not together.each
        for number, pair in enumerate(networks):
            alone, mine = discretise(*pair, 7, pieces, scales=template.scales), design_of(together, number)
            for record, other in ((mine.elements, alone.elements), (mine.attachments, alone.attachments)):
                for name in record._fields:
                    if name not in ("beam", "cuts") and getattr(alone.elements, name, 0) is not None:
                        own, right = np.asarray(getattr(record, name)), np.asarray(getattr(other, name))
                        size = max(float(np.abs(right.real).max()), 1e-300)
                        assert np.abs(own.real - right.real).max() < 1e-12 * size, name
                        tiny = max(float(np.abs(right.imag).max()), COMPLEX_STEP * 1e-3)
                        assert np.abs(own.imag - right.imag).max() < 1e-10 * tiny, name


def test_the_tangent_of_the_path_is_the_adjoint() -> None:
    """With slopes of the path, and with one solution a point, the same derivatives."""
    net, drive = lan_pushed(LAN)
    at, rates = equilibria(net, drive, 8)
    designs = stepped(at.mesh, lan_pushed, LAN)
    np.testing.assert_allclose(effort_slopes(at, designs, rates), effort_slopes(at, designs), rtol=1e-7)


def test_the_effort_s_slope_by_an_array_is_a_difference_of_the_functional() -> None:
    """At a state that is no equilibrium the derivative by a table is that of the gradient along the motion."""
    net, drive = lan_pushed(LAN)
    at, rates = equilibria(net, drive, 6)
    designs = stepped(at.mesh, lan_pushed, LAN)
    one = design_of(designs, 3)
    motions = np.tile(at.mesh.rate, (len(at.z), 1))
    motions[:, at.mesh.free] = rates
    direct = [
        (energy.gradient(one, z, drive).imag / COMPLEX_STEP) @ w
        for z, drive, w in zip(at.z, at.drive, motions, strict=True)
    ]
    unit = at.mesh.scales.moment / at.mesh.scales.drive
    np.testing.assert_allclose(effort_slopes(at, designs, rates)[:, 3], np.array(direct) * unit, rtol=1e-10)


@pytest.mark.parametrize(("build", "x"), [*CASES[:2], pytest.param(pushed, X, marks=pytest.mark.slow)])
def test_slopes_of_other_outputs_are_those_of_the_gradient_of_a_trace(build: Any, x: Any) -> None:
    """Motions of nodes, energy, forces on the ends of beams, stresses at their ends."""
    net, drive = build(x)
    known = gradient(trace(net, drive, FINE), build, x)
    at, _ = equilibria(net, drive)
    beam, node = next(iter(net.beams)), "b" if "b" in net.nodes else "n3"
    ends = np.array([0.0, 1.0])

    def end_force(model: Any, states: Any) -> Any:
        seen = beam_states.states(model, states, beam, ends)
        return np.stack([seen.h[:, -1], seen.v[:, -1], seen.moment[:, -1]], axis=-1)

    def stress(model: Any, states: Any) -> Any:
        seen = beam_states.sections(model, beam, beam_states.states(model, states, beam, ends))
        return np.stack([seen.bending_stress[:, 0], seen.axial_stress[:, 0]], axis=-1)

    outputs = {
        "motion": lambda _, states: node_motion(states, node),
        "energy": lambda _, states: strain_energy(states) * at.mesh.scales.moment,
        "force": end_force,
        "stress": stress,
    }
    designs = stepped(at.mesh, build, x)
    slopes = unknown_slopes(at, designs)
    moved = [
        Equilibria(design_of(designs, k), at.z + 1j * COMPLEX_STEP * slopes[:, k], at.drive) for k in range(len(x))
    ]
    pairs = list(zip(designs.networks, moved, strict=True))
    found = {
        name: np.stack([np.imag(output(net, one)) / COMPLEX_STEP for (net, _), one in pairs], axis=-1)
        for name, output in outputs.items()
    }
    sections = known.sections(beam)
    wanted = {
        "motion": known.motion[node],
        "energy": known.energy,
        "force": known.end_force(beam, 1),
        "stress": np.stack([sections.bending_stress[:, 0], sections.axial_stress[:, 0]], axis=1),
    }
    for name, slopes in wanted.items():
        size = np.abs(slopes * x).max()
        np.testing.assert_allclose(found[name] * x, slopes * x, rtol=1e-5, atol=1e-6 * size, err_msg=name)
