"""Proposals of `suggest` with cams: springs and their depth."""

from __future__ import annotations

import pytest
from suggest_support import candidate_named, offered, proposal_of

import cfmkit
from cfmkit.families.cam.hardware import hardware


def test_catalogue_springs_of_a_cam_take_the_depth_of_their_own_coil():
    asked, candidates = offered("cam", envelope="[80 mm, 60 mm, 20 mm]")
    one = candidate_named(candidates, "catalogue springs")
    made_of = proposal_of("cam", one, asked)
    assert made_of.good, made_of.missed or made_of.message
    springs, plate = made_of.spec.mechanism.springs, made_of.spec.mechanism.contact.width
    assert springs.name.startswith("generic-extension")
    coils = min(springs.count, 2) * (springs.wound.coil + springs.wound.wire)
    slider = hardware(cfmkit.analyze(made_of.spec).state).slider_excess
    assert made_of.numbers["depth"] == pytest.approx(3.0 * plate + slider + coils)
