"""What a closure did to a mechanism is reported with numbers."""

from __future__ import annotations

import numpy as np
import pytest
from beam_support import solved


def test_the_closure_chain_says_which_nodes_it_moved_and_how_far():
    result = solved("beam_lan2010", "mechanism.closure=chain", "analysis.points=19")
    reported = next(item.message for item in result.warnings if "nodes were moved" in item.message)
    assert reported.startswith("nodes were moved to where the beams end: n3 by ")
    network = result.state.path.network
    for part in reported.split(": ")[1].split(", "):
        name, _, size, unit = part.split(" ")
        node, given = network.nodes[name], result.spec.mechanism.nodes[name].at
        assert unit == "mm"
        assert float(size) == pytest.approx(1e3 * np.hypot(node.x - given[0], node.y - given[1]), rel=1e-3)
    assert reported.count(" by ") == 3


def test_the_closure_chain_takes_guides_along_and_says_so():
    reported = [
        item.message for item in solved("beam_lan2010", "mechanism.closure=chain", "analysis.points=19").warnings
    ]
    assert "the guides of moved nodes were moved with them: n5" in reported


def test_the_closure_rotscale_moves_no_node():
    result = solved("beam_lan2010")
    assert not any("nodes were moved" in item.message for item in result.warnings)
