"""The parallel curve of a closed chain of arcs: again a chain of arcs.

An arc of curvature k, moved by d to its right, keeps its turn and scales by 1 + k d.
Where the chain turns away from the parallel, an arc about the node fills the gap; where
it turns towards it, or an arc shrinks to nothing, the neighbours are cut where they cross.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cfmkit.numerics.arc_chain import ArcChain, points_on

_SMOOTH = 1e-7  # a turn below this [rad] is no corner; a fraction of an arc below it is no piece


@dataclass
class _Piece:
    """One arc, kept between the fractions `begin` and `end` of its length."""

    start: complex
    chord: complex
    turn: float
    begin: float = 0.0
    end: float = 1.0

    def at(self, fraction: float) -> complex:
        return complex(points_on(np.array(self.start), np.array(self.chord), np.array(self.turn), np.array(fraction)))

    def slope(self, fraction: float) -> complex:
        """Derivative of `at` by the fraction."""
        return complex(self.chord / np.sinc(self.turn / (2 * np.pi)) * np.exp(1j * (fraction - 0.5) * self.turn))

    @property
    def bulge(self) -> float:
        return float(np.tan((self.end - self.begin) * self.turn / 4))


def parallel(chain: ArcChain, distance: float) -> ArcChain | None:
    """Return the chain at `distance` to the right of a closed chain.

    Arcs that vanish, or are cut off whole, are left out. Only neighbours are looked at:
    whether distant parts of the result cross is for the caller to check.

    Parameters
    ----------
    chain : ArcChain
        A closed chain; counter-clockwise ones grow for a positive distance.
    distance : float
        In the unit of the nodes; negative to the left.

    Returns
    -------
    ArcChain or None
        None where neighbours at a corner do not meet.
    """
    pieces, breaks = _pieces(chain, distance)
    kept = list(range(len(pieces)))
    for index in breaks:
        i, j = index % len(pieces), (index + 1) % len(pieces)
        if i in kept and j in kept and not _trim(pieces, kept, i, j):
            return None
    if len(kept) < 2:
        return None
    nodes = [pieces[index].at(pieces[index].begin) for index in kept]
    return ArcChain(np.array([*nodes, nodes[0]]), np.array([pieces[index].bulge for index in kept]))


def _pieces(chain: ArcChain, distance: float) -> tuple[list[_Piece], list[int]]:
    """Return the moved arcs with those that fill the gaps, and after which of them the next one does not follow on."""
    scale = 1 + chain.curvatures * distance
    into, out = chain.tangents
    starts = (chain.nodes[:-1] - 1j * distance * into).tolist()
    corners = (np.angle(np.roll(into, -1) / out) * np.sign(distance)).tolist()
    pieces: list[_Piece] = []
    breaks: list[int] = []
    for index, (chord, turn) in enumerate(zip((chain.chords * scale).tolist(), chain.turns.tolist(), strict=True)):
        if scale[index] > 0:
            pieces.append(_Piece(starts[index], chord, turn))
        else:
            breaks.append(len(pieces) - 1)
        if corners[index] > _SMOOTH:
            begin = complex(chain.nodes[index + 1] - 1j * distance * out[index])
            end = starts[(index + 1) % len(starts)]
            pieces.append(_Piece(begin, end - begin, float(corners[index] * np.sign(distance))))
        elif corners[index] < -_SMOOTH:
            breaks.append(len(pieces) - 1)
    return pieces, list(dict.fromkeys(breaks))


def _trim(pieces: list[_Piece], kept: list[int], i: int, j: int) -> bool:
    """End piece i and begin piece j where they cross, and drop from `kept` what lies beyond; tell whether they do."""
    while i != j and len(kept) > 2:
        crossing = _crossing(pieces[i], pieces[j])
        if crossing is None:
            return False
        if crossing[0] <= pieces[i].begin + _SMOOTH:
            before = kept[kept.index(i) - 1]
            kept.remove(i)
            i = before
        elif crossing[1] >= pieces[j].end - _SMOOTH:
            after = kept[(kept.index(j) + 1) % len(kept)]
            kept.remove(j)
            j = after
        else:
            pieces[i].end, pieces[j].begin = crossing
            return True
    return False


def _crossing(first: _Piece, second: _Piece) -> tuple[float, float] | None:
    """Return the fractions of both pieces, extended if need be, where they cross near their common corner."""
    at, tolerance = np.array([1.0, 0.0]), 1e-13
    for _ in range(40):
        gap = second.at(at[1]) - first.at(at[0])
        a, b = first.slope(at[0]), second.slope(at[1])
        cross = (a.conjugate() * b).imag
        if cross == 0:
            return None
        step = np.array([(gap.conjugate() * b).imag, (gap.conjugate() * a).imag]) / cross
        if not np.abs(step).max() < 1e6:
            return None
        at = at + step
        if np.abs(step).max() < tolerance * max(1.0, np.abs(at).max()):
            return float(at[0]), float(at[1])
    return None
