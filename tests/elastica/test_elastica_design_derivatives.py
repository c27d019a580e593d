"""Derivatives by design variables from the functional: beside those of traced paths, and differences."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from varied_networks import LAN, lan_pushed

import cfmkit.elastica as el
from cfmkit.elastica.mechanics.designs import design_of, set_up
from cfmkit.elastica.mechanics.discretise import discretise

COMPLEX_STEP = 1e-30  # nothing is subtracted: its square vanishes beside one


def hooked(x: Any) -> Any:
    """Two beams of several elements: one at an arm, with an offset, that turns by 3.4 rad, and a thin one."""
    section = el.Section(2e9, 10e-3, x[0], shear=True)
    nodes = {
        "arm": el.Node(5e-3, 0.0),
        "a": el.Node(0.0, 0.0, el.CLAMPED_SUPPORT),
        "b": el.Node(30e-3, 20e-3 * x[3], el.slider_support(-np.pi / 2)),
        "c": el.Node(60e-3, 0.0, el.CLAMPED_SUPPORT),
    }
    beams = {
        "hook": el.Beam("arm", "b", section, el.Polynomial((0.0, x[1], x[2])), end_offset=(1e-3, 2e-3)),
        "thin": el.Beam("b", "c", replace(section, thickness=0.5 * x[0]), el.Polynomial((0.0, -x[1]))),
    }
    return el.Network(nodes, beams, links=(el.Link("a", "arm"),)), el.Displacement("b", -np.pi / 2, np.array([1e-3]))


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
