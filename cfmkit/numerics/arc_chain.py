"""Chains of circular arcs and straight lines, stored by their nodes and bulges.

The bulge of a piece is tan(turn / 4), positive when it turns left: zero is a straight
line, one a half circle. Nodes and bulges stay well conditioned however flat a piece is,
where centre and radius do not. Points are complex numbers x + iy throughout.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cfmkit.arrays import FloatArray, read_only

ComplexArray = NDArray[np.complex128]


@dataclass(frozen=True)
class ArcChain:
    """A chain of m pieces: `nodes` (m + 1,) complex and `bulges` (m,).

    A closed chain repeats its first node at the end.
    """

    nodes: ComplexArray
    bulges: FloatArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "nodes", read_only(self.nodes, np.complex128))
        object.__setattr__(self, "bulges", read_only(self.bulges))
        if self.nodes.ndim != 1 or self.nodes.shape != (len(self.bulges) + 1,) or not len(self.bulges):
            raise ValueError("a chain of m >= 1 pieces has m + 1 nodes and m bulges")

    @property
    def chords(self) -> ComplexArray:
        """From each node to the next."""
        return np.diff(self.nodes)

    @property
    def turns(self) -> FloatArray:
        """Angle by which each piece turns to the left [rad]."""
        return np.asarray(4 * np.arctan(self.bulges))

    @property
    def curvatures(self) -> FloatArray:
        """Curvature of each piece, positive to the left [1 / length]."""
        return np.asarray(2 * np.sin(self.turns / 2) / np.abs(self.chords))

    @property
    def tangents(self) -> tuple[ComplexArray, ComplexArray]:
        """Unit tangents at the start and at the end of each piece."""
        along = self.chords / np.abs(self.chords)
        half = np.exp(0.5j * self.turns)
        return along / half, along * half

    @property
    def area(self) -> float:
        """Area that a closed chain encloses, positive when it runs counter-clockwise."""
        polygon = 0.5 * float(np.sum((np.conj(self.nodes[:-1]) * self.nodes[1:]).imag))
        turns, chords = self.turns, np.abs(self.chords)
        # the circular segment between a piece and its chord; the series avoids 0/0 on straight pieces
        flat = np.abs(turns) < 1e-3
        safe = np.where(flat, 1.0, turns)
        segment = np.where(flat, turns / 12, (safe - np.sin(safe)) / (8 * np.sin(safe / 2) ** 2))
        return polygon + float(np.sum(chords**2 * segment))

    def append(self, other: ArcChain) -> ArcChain:
        """Return this chain followed by `other`, whose first node is dropped."""
        return ArcChain(np.append(self.nodes, other.nodes[1:]), np.append(self.bulges, other.bulges))

    def close(self) -> ArcChain:
        """Return the chain with its last node exactly on its first."""
        return ArcChain(np.append(self.nodes[:-1], self.nodes[0]), self.bulges)

    def flatten(self, sagitta: float) -> ComplexArray:
        """Return points on the chain, all nodes among them, whose chords stay within `sagitta` of it."""
        turns = np.abs(self.turns)
        step = np.minimum(np.sqrt(8 * sagitta * np.abs(self.curvatures)), np.pi / 4)
        counts = np.maximum(np.ceil(turns / np.maximum(step, 1e-300)), 1).astype(int)
        piece = np.repeat(np.arange(len(counts)), counts)
        first = np.cumsum(counts) - counts
        fraction = (np.arange(len(piece)) - first[piece]) / counts[piece]
        points = points_on(self.nodes[piece], self.chords[piece], self.turns[piece], fraction)
        return np.append(points, self.nodes[-1])


def points_on(start: ComplexArray, chord: ComplexArray, turn: FloatArray, fraction: FloatArray) -> ComplexArray:
    """Return the point at a fraction of an arc's length, given its start, chord and turn [rad].

    >>> bool(abs(points_on(np.array(1 + 0j), np.array(-2 + 0j), np.array(np.pi), np.array(0.5)) - 1j) < 1e-15)
    True
    """
    share = fraction * np.sinc(fraction * turn / (2 * np.pi)) / np.sinc(turn / (2 * np.pi))
    return np.asarray(start + chord * share * np.exp(0.5j * (fraction - 1) * turn))
