"""Networks, and what is wanted of them, for batches: in a module that other processes can import."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cfmkit.elastica import CLAMPED_SUPPORT, Beam, Network, Node, Polynomial, Section, arc, slider_support

if TYPE_CHECKING:
    from cfmkit.elastica import Path


def bent(sweep: float, height: float = 0.03) -> Network:
    nodes = {"a": Node(0, 0, CLAMPED_SUPPORT), "d": Node(0.05, height, slider_support(np.pi / 2))}
    return Network(nodes, {"x": Beam("a", "d", Section(2e9, 1e-2, 1e-3), arc(sweep))})


def standing(height: float) -> Network:
    nodes = {"a": Node(0, 0, CLAMPED_SUPPORT), "d": Node(0.05, height, slider_support(np.pi / 2))}
    return Network(nodes, {"x": Beam("a", "d", Section(2e9, 1e-2, height / 30))})


def two_leaves(
    length: float = 1.0, rise: float = 1.0, bend: float = 1.0, twist: float = 1.0, back: float = 1.0, thick: float = 1.0
) -> Network:
    """Two curved leaves to one slider that moves along them; factors of its dimensions."""
    nodes = {
        "a": Node(0, 0, CLAMPED_SUPPORT),
        "b": Node(0, 0.01, CLAMPED_SUPPORT),
        "d": Node(0.05 * length, 0.004 * rise, slider_support(0.0)),
    }
    section = Section(2e9, 1e-2, 5e-4 * thick)
    shapes = Polynomial((0.0, 0.8 * bend, -0.5 * twist)), Polynomial((0.0, -0.6 * back))
    beams = {f"x{end}": Beam(end, "d", section, shape) for end, shape in zip("ab", shapes, strict=True)}
    return Network(nodes, beams)


def last_effort(path: Path) -> float:
    return float(path.effort[-1])
