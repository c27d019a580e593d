"""Numbers of unknowns are kept by topology: a network never gets those of another one."""

from dataclasses import replace

import numpy as np
import pytest

import cfmkit.elastica as el
from cfmkit.elastica import Stop
from cfmkit.elastica.mechanics.discretise import Discretisation, discretise
from cfmkit.elastica.mechanics.numbering import find_free, number

STRIP = el.Section(2e9, 1e-2, 1e-3)
PLAIN = el.Network(
    {"a": el.Node(0, 0, el.CLAMPED_SUPPORT), "b": el.Node(0.1, 0), "c": el.Node(0.1, 0), "d": el.Node(0.2, 0.01)},
    {"ab": el.Beam("a", "b", STRIP), "cd": el.Beam("c", "d", STRIP)},
    (el.Link("b", "c"),),
)
DRIVE = el.Displacement("d", 0.0, np.array([1e-3]))
BENT = el.Polyline(np.array([[0.0, 0.0], [0.05, 0.01], [0.1, 0.0]]))


def exchange(**beam: object) -> el.Network:
    """Return the network with another second beam."""
    return replace(PLAIN, beams={**PLAIN.beams, "cd": replace(PLAIN.beams["cd"], **beam)})


VARIANTS = {
    "pin between the beams": replace(PLAIN, links=(el.Link("b", "c", turns=False),)),
    "pinned root": replace(PLAIN, nodes={**PLAIN.nodes, "a": el.Node(0, 0, el.PINNED_SUPPORT)}),
    "pinned end": exchange(start_joint="pin"),
    "two elements": exchange(shape=BENT),
    "rigid arm": replace(PLAIN, nodes={**PLAIN.nodes, "c": el.Node(0.11, 0)}),
    "pin on a rigid arm": replace(
        PLAIN, nodes={**PLAIN.nodes, "c": el.Node(0.11, 0)}, links=(el.Link("b", "c", turns=False),)
    ),
    "offset": exchange(end_offset=(0.01, 0.0)),
    "offset and pinned end": exchange(end_offset=(0.01, 0.0), end_joint="pin"),
    "force": replace(PLAIN, loads=(el.PointLoad("d", 1.0),)),
    "moment": replace(PLAIN, loads=(el.PointLoad("d", moment=1.0),)),
    "pinned end and moment there": replace(exchange(end_joint="pin"), loads=(el.PointLoad("d", moment=1.0),)),
    "spring": replace(PLAIN, springs=(el.LineSpring("b", "d", 1.0),)),
    "torsion spring": replace(exchange(end_joint="pin"), springs=(el.TorsionSpring("b", "d", 1.0),)),
    "stop": replace(PLAIN, contacts=(Stop("stop", "b", 1e-3, 0.0),)),
}


def numbers(mesh: Discretisation) -> list[object]:
    """Return all whole numbers of the arrays of a network."""
    places = [[acting.places for acting in (*mesh.springs, *mesh.loads)], [at.place for at in mesh.contacts]]
    arrays = mesh.elements.unknowns, mesh.elements.ends, mesh.attachments.unknowns, mesh.free
    return [mesh.size, dict(mesh.bodies), dict(mesh.nodes), places, *(array.tolist() for array in arrays)]


@pytest.mark.parametrize("name", VARIANTS)
def test_a_network_has_its_own_numbers_whatever_came_before(name: str) -> None:
    for other in (PLAIN, *VARIANTS.values()):
        discretise(other, DRIVE, 6)
    kept = discretise(VARIANTS[name], DRIVE, 6)
    number.cache_clear()
    find_free.cache_clear()
    assert numbers(discretise(VARIANTS[name], DRIVE, 6)) == numbers(kept)
    assert numbers(kept) != numbers(discretise(PLAIN, DRIVE, 6)) or name in ("rigid arm", "offset")


def test_networks_of_one_topology_share_their_numbers() -> None:
    longer = replace(PLAIN, nodes={**PLAIN.nodes, "d": el.Node(0.3, 0.02)})
    assert discretise(longer, DRIVE, 6).numbering is discretise(PLAIN, DRIVE, 6).numbering
