"""Beams that wind many times: coils are fitted, followed and differentiated as what they are, or refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cfmkit
from cfmkit.elastica import CLAMPED_SUPPORT, Beam, Network, Node, PathStatus, Rotation, Section, arc, gradient, trace

LAN = Path(__file__).parents[2] / "configs" / "beam_lan2010.yaml"
CHORD = 0.1


def coil(turns: float, chord: Any = CHORD) -> Network:
    """Return a coil between a clamp and a free node."""
    beam = Beam("a", "b", Section(2e9, 1e-2, 1e-4), arc(2 * np.pi * turns))
    return Network({"a": Node(0.0, 0.0, CLAMPED_SUPPORT), "b": Node(chord, 0.0)}, {"coil": beam})


@pytest.mark.parametrize("turns", [2.25, 10.25, 40.25, 160.25, 900.25])
def test_a_coil_has_the_length_of_its_turns_and_resists_turning_like_a_straight_beam_of_it(turns):
    path = trace(coil(turns), Rotation("b", np.linspace(0.5, 2.0, 3)))
    sweep = 2 * np.pi * turns
    length = CHORD * 0.5 * sweep / np.sin(0.5 * sweep)
    assert path.status is PathStatus.COMPLETE
    assert path.fits["coil"].length == pytest.approx(abs(length), rel=1e-9)
    stiffness = 2e9 * 1e-2 * 1e-4**3 / 12 / abs(length)
    assert path.effort[path.at_requested] == pytest.approx(stiffness * path.drive[path.at_requested], rel=1e-9)


def test_the_derivative_of_a_coil_s_moment_by_its_chord():
    def made(x: Any) -> Network:
        return coil(40.25, x[0])

    path = trace(made(np.array([CHORD])), Rotation("b", np.array([1.0])))
    slope = gradient(path, made, np.array([CHORD])).effort[-1, 0]
    assert slope == pytest.approx(-path.effort[-1] / CHORD, rel=1e-9)


def test_a_coil_that_its_thickness_leaves_no_room_for_is_refused_at_once(tmp_path):
    spec = tmp_path / "coil.yaml"
    text = LAN.read_text().split("\n")
    spec.write_text("\n".join(line.replace("1.5707", "1570.7") if "b3:" in line else line for line in text))
    refusal = r"(?s)mechanism\.beams\.b3\.shape winds the beam to a radius of 0\.2707 mm.*half of its thickness of 1 mm"
    with pytest.raises(cfmkit.InputError, match=refusal):
        cfmkit.analyze(cfmkit.load(spec))
