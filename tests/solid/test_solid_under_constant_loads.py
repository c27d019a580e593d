"""Constant loads on nodes of a part as a solid, beside those on the same beams."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from half_vee import VEE

import cfmkit
from cfmkit.errors import UsageError
from cfmkit.results import Status

if TYPE_CHECKING:
    from cfmkit.results import Result

SLENDER = {
    "mechanism.thickness": "0.25 mm",
    "mechanism.part.fillet": "0 mm",
    "analysis.travel": "0.4 mm",
    "analysis.solid.error": 0.1,
    "analysis.outputs.nodes": ["middle"],
}
MIDDLE = {"kind": "point", "node": "middle", "fx": "0.03 N", "fy": "0.1 N", "moment": "0.2 N*mm"}
SHUTTLE = {"kind": "point", "node": "shuttle", "fx": "0.2 N", "fy": "0.3 N"}


def solved(*loads: dict[str, str], fidelity: str = "solid", **changes: object) -> Result:
    keys = {"mechanism.loads": list(loads), "analysis.fidelity": fidelity}
    return cfmkit.analyze(cfmkit.loads(VEE).replace(SLENDER | keys | changes))


def read(result: Result, *names: str) -> np.ndarray:
    return np.array([result.curve.extra[name].values for name in names])


@pytest.fixture(scope="module")
def loaded() -> tuple[Result, Result]:
    return solved(MIDDLE), solved(MIDDLE, fidelity="reissner")


def test_a_dead_load_on_a_slender_part_does_what_it_does_to_beams(loaded):
    solid, beams = loaded
    assert solid.status is Status.COMPLETE
    largest = np.abs(beams.curve.effort).max()
    np.testing.assert_allclose(solid.curve.effort, beams.curve.effort, atol=0.02 * largest)
    for names in (("middle_x", "middle_y"), ("root_fx", "root_fy"), ("root_m",)):
        expected = read(beams, *names)
        np.testing.assert_allclose(read(solid, *names), expected, atol=0.02 * np.abs(expected).max())
    bare = solved(fidelity="reissner").curve.effort
    assert np.abs(bare - beams.curve.effort).max() > 0.2 * largest  # the load counts


def test_loads_and_reactions_are_in_equilibrium(loaded):
    total = read(loaded[0], "root_fx", "root_fy") + read(loaded[0], "shuttle_fx", "shuttle_fy")
    np.testing.assert_allclose(total.T, -np.tile([0.03, 0.1], (9, 1)), atol=1e-6)


def test_a_load_on_the_driven_node_is_carried_by_the_drive():
    bare, pulled = solved(), solved(SHUTTLE)
    np.testing.assert_allclose(pulled.curve.effort - bare.curve.effort, 0.3, atol=1e-9)
    np.testing.assert_allclose(read(pulled, "shuttle_fx") - read(bare, "shuttle_fx"), -0.2, atol=1e-9)
    # the corner at which it buckles is placed by the forces, which are rounded
    np.testing.assert_allclose(read(pulled, "max_stress"), read(bare, "max_stress"), rtol=1e-11)


def test_loads_on_mirrored_halves_are_mirrored(loaded):
    copies = {"mechanism.copies": {"mirror": ["24.6 mm", "3.3 mm"]}}
    halves, beams = solved(MIDDLE, SHUTTLE, **copies), solved(MIDDLE, SHUTTLE, fidelity="reissner", **copies)
    largest = np.abs(beams.curve.effort).max()
    np.testing.assert_allclose(halves.curve.effort, beams.curve.effort, atol=0.02 * largest)
    expected = read(beams, "shuttle_fx", "shuttle_fy", "root_fx", "root_fy")
    found = read(halves, "shuttle_fx", "shuttle_fy", "root_fx", "root_fy")
    np.testing.assert_allclose(found, expected, atol=0.02 * np.abs(expected).max())


def test_a_strut_that_buckles_under_its_load_has_no_curve():
    strut = {
        "mechanism.nodes": {
            "root": {"at": ["0 mm", "0 mm"], "support": "clamped"},
            "middle": {"at": ["10 mm", "0 mm"]},
            "shuttle": {"at": ["20 mm", "0 mm"], "support": "guided", "direction": "90 deg"},
        },
        "analysis.outputs": {},
    }
    found = solved({"kind": "point", "node": "middle", "fx": "-60 N"}, **strut)
    assert found.status is Status.NO_EQUILIBRIUM
    assert "no stable equilibrium under its constant loads" in found.message


def test_a_deck_of_a_loaded_part_is_refused():
    spec = cfmkit.loads(VEE).replace(SLENDER | {"mechanism.loads": [SHUTTLE]})
    with pytest.raises(UsageError, match="decks have no constant loads"):
        cfmkit.export(spec, format="inp")
