"""Networks, and what is wanted of them, for batches: in a module that other processes can import."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cfmkit.elastica import CLAMPED, Beam, Network, Node, Section, arc, guided

if TYPE_CHECKING:
    from cfmkit.elastica import Path


def bent(sweep: float, height: float = 0.03) -> Network:
    nodes = {"a": Node(0, 0, CLAMPED), "d": Node(0.05, height, guided(np.pi / 2))}
    return Network(nodes, {"x": Beam("a", "d", Section(2e9, 1e-2, 1e-3), arc(sweep))})


def standing(height: float) -> Network:
    nodes = {"a": Node(0, 0, CLAMPED), "d": Node(0.05, height, guided(np.pi / 2))}
    return Network(nodes, {"x": Beam("a", "d", Section(2e9, 1e-2, height / 30))})


def last_effort(path: Path) -> float:
    return float(path.effort[-1])
