"""Pins between beams and rigid bodies, sprung or not, against the same mechanism built otherwise."""

from __future__ import annotations

import numpy as np
import pytest
from varied_networks import pinned

import cfmkit.elastica as el
from cfmkit.errors import InputError

FINE = el.Control(tolerance=1e-10)
SECTION = el.Section(2e9, 8e-3, 1e-3)
PUSH = el.Displacement("c", -np.pi / 2, np.array([2e-3, 6e-3]))
NODES = {
    "a": el.Node(0.0, 0.0, el.CLAMPED_SUPPORT),
    "b": el.Node(0.05, 0.03),
    "p": el.Node(0.05, 0.03),
    "c": el.Node(0.1, 0.05, el.slider_support(np.pi / 2)),
}


def test_a_pin_between_nodes_is_a_pin_at_the_end_of_a_beam() -> None:
    beams = {
        "ab": el.Beam("a", "b", SECTION, el.Polynomial((0.0, 0.4))),
        "bc": el.Beam("b", "c", SECTION, start_joint="pin"),
    }
    nodes = {name: node for name, node in NODES.items() if name != "p"}
    same = el.trace(el.Network(nodes, beams), PUSH, FINE)
    path = el.trace(*pinned([0.0, 0.05]), FINE)
    np.testing.assert_allclose(path.effort, same.effort, rtol=1e-9)
    np.testing.assert_allclose(path.motion("p")[:, :2], path.motion("b")[:, :2])
    np.testing.assert_allclose(path.end_force("pc", 0)[:, 2], 0.0, atol=1e-12)
    assert abs(path.motion("p")[-1, 2] - path.motion("b")[-1, 2]) > 0.01


def test_a_sprung_pin_transmits_the_moment_of_its_spring() -> None:
    path = el.trace(*pinned([0.3, 0.05]), FINE)
    turn = path.motion("p")[:, 2] - path.motion("b")[:, 2]
    np.testing.assert_allclose(path.end_force("pc", 0)[:, 2], 0.3 * turn, rtol=1e-8)


def test_a_stiff_pin_is_a_rigid_joint() -> None:
    beams = {"ab": el.Beam("a", "b", SECTION, el.Polynomial((0.0, 0.4))), "bc": el.Beam("b", "c", SECTION)}
    rigid = el.trace(el.Network({n: node for n, node in NODES.items() if n != "p"}, beams), PUSH, FINE)
    np.testing.assert_allclose(el.trace(*pinned([1e6, 0.05]), FINE).effort, rigid.effort, rtol=1e-5, atol=1e-11)


def test_a_pin_on_a_rigid_arm_moves_with_the_arm() -> None:
    nodes = {**NODES, "p": el.Node(0.055, 0.036)}
    beams = {"ab": el.Beam("a", "b", SECTION), "pc": el.Beam("p", "c", SECTION)}
    path = el.trace(el.Network(nodes, beams, (el.Link("b", "p", turns=False),)), PUSH, FINE)
    offset = {"ab": beams["ab"], "bc": el.Beam("b", "c", SECTION, start_offset=(0.005, 0.006), start_joint="pin")}
    same = el.trace(el.Network({n: node for n, node in NODES.items() if n != "p"}, offset), PUSH, FINE)
    np.testing.assert_allclose(path.effort, same.effort, rtol=1e-9)
    with pytest.raises(InputError, match="pinned to a rigid arm"):
        el.trace(
            el.Network(
                nodes, {**beams, "pc": el.Beam("p", "c", SECTION, start_offset=(1e-3, 0))}, (el.Link("b", "p", False),)
            ),
            PUSH,
        )


def test_a_pinned_node_carries_offsets_that_turn_with_it() -> None:
    beams = {"ab": el.Beam("a", "b", SECTION), "pc": el.Beam("p", "c", SECTION, start_offset=(2e-3, 4e-3))}
    path = el.trace(el.Network(NODES, beams, (el.Link("b", "p", turns=False),)), PUSH, FINE)
    force = path.end_force("pc", 0)
    c, s = np.cos(path.motion("p")[:, 2]), np.sin(path.motion("p")[:, 2])
    arm = np.stack([c * 2e-3 - s * 4e-3, s * 2e-3 + c * 4e-3])
    moment = force[:, 2] + arm[0] * force[:, 1] - arm[1] * force[:, 0]
    np.testing.assert_allclose(moment, 0.0, atol=1e-9)


def test_no_support_acts_on_a_node_that_a_link_moves() -> None:
    path = el.trace(*pinned([0.0, 0.05]))
    with pytest.raises(InputError, match="'p' is moved by a link: what is held is its master, 'b'"):
        path.reaction("p")
    with pytest.raises(InputError, match="'q' is not a node; nodes: a, b, p, c"):
        path.reaction("q")
    with pytest.raises(InputError, match="moved by a link"):
        el.gradient(path, pinned, np.array([0.0, 0.05])).reaction("p")
