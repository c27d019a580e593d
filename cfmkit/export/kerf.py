"""Compensation for the width of the cut: every cut contour moved into the waste, as a parallel chain of arcs.

Outer contours grow and holes shrink; corners that point into the waste become arcs about the corner, so that the cut
stays half a kerf away from the part everywhere. Arcs stay arcs. Only where the moved contour has other pieces than the
contour itself (a fillet that is sharper than half the kerf) it becomes a fine polyline.

The parallel curve of a closed chain of arcs: again a chain of arcs. An arc of curvature k, moved by d to its right,
keeps its turn and scales by 1 + k d. Where the chain turns away from the parallel, an arc about the node fills the
gap; where it turns towards it, or an arc shrinks to nothing, the neighbours are cut where they cross.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.errors import GeometryError
from cfmkit.export.arc_outlines import check_outlines, flat_points, flat_sagitta, place
from cfmkit.numerics.arc_chains import ArcChain, points_on
from cfmkit.specs.units import format_short

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cfmkit.export.arc_outlines import Outline


_ARC_ERROR = 5.0  # of the distance between contour and cut where arcs stay arcs, in errors of the flattening
_POLYLINE_ERROR = 20.0  # of the same where the cut becomes a polyline
_GEOS_ERROR = 0.011  # shapely's buffer smooths inside corners by 1 % of its distance


def with_kerf(
    outlines: Sequence[Outline],  # a drawing as `cfmkit.export.arc_outlines.outlines` gives it
    kerf: float,  # width of the cut [m]
) -> tuple[Outline, ...]:
    """Return the outlines with closed contours on layer `cut` moved into the waste by half the kerf.

    Raises GeometryError if the kerf is not above zero, a contour vanishes or falls into pieces, or cuts meet.
    """
    if not (np.isfinite(kerf) and kerf > 0):
        raise GeometryError(f"the kerf must be a length above zero, not {format_short(kerf, 'length')}")
    moved = tuple(
        _offset_outline(outline, kerf / 2, f"contour {number} on layer 'cut'")
        if outline.layer == "cut" and outline.closed
        else outline
        for number, outline in enumerate(outlines, start=1)
    )
    try:
        check_outlines(moved)
    except GeometryError as error:
        raise GeometryError(f"with a kerf of {format_short(kerf, 'length')}, {error}") from error
    return moved


def _offset_outline(outline: Outline, half: float, name: str) -> Outline:
    region = _grown_region(outline, half, name)
    right = half if (outline.chain.area > 0) != outline.hole else -half
    chain = parallel(outline.chain, right)
    if chain is None or not _follows(chain, outline, half, region, _ARC_ERROR):
        corners = np.asarray(region.exterior.coords) @ [1, 1j]
        chain = ArcChain(corners, np.zeros(len(corners) - 1))
        if not _follows(chain, outline, half, region, _POLYLINE_ERROR):
            raise GeometryError(
                f"{name} has inside corners too sharp for a kerf of {format_short(2 * half, 'length')}; round them"
            )
    circle = outline.circle and (outline.circle[0], outline.circle[1] + (-half if outline.hole else half))
    return replace(outline, chain=chain, circle=circle)


def _grown_region(outline: Outline, half: float, name: str) -> Any:
    """Return the part (or the hole) with half a kerf around it (or less), in one piece without gaps."""
    from shapely import Polygon

    part = Polygon(flat_points(outline.chain))
    region = part.buffer(-half if outline.hole else half, quad_segs=64)
    kerf = format_short(2 * half, "length")
    if region.is_empty:
        raise GeometryError(f"{name}, a hole at {place(outline.chain.nodes[0])}, vanishes with a kerf of {kerf}")
    if region.geom_type != "Polygon" or region.interiors:
        kind = "hole" if outline.hole else "contour"
        raise GeometryError(f"{name}: the {kind} falls into pieces where it is narrower than the kerf of {kerf}")
    return region


def _follows(chain: ArcChain, outline: Outline, half: float, region: Any, error: float) -> bool:
    """Whether `chain` runs at distance `half` of the outline, all around it."""
    import shapely

    edge = flat_points(outline.chain)
    track = flat_points(chain)
    error *= flat_sagitta(outline.chain)
    source = shapely.LinearRing(edge)
    shapely.prepare(source)
    points = shapely.points(track)
    is_near = shapely.dwithin(points, source, half - error).any()
    far = not shapely.dwithin(points, source, half + error).all()
    moved = shapely.Polygon(track)
    slack = region.length * (_GEOS_ERROR * half + error)
    return bool(not is_near and not far and moved.is_valid and abs(moved.area - region.area) < slack)


_TANGENT_ANGLE = 1e-7  # a turn below this [rad] is no corner; a fraction of an arc below it is no piece


@dataclass
class _Piece:
    """One arc, kept between the fractions `begin` and `end` of its length."""

    start: complex
    chord: complex
    turn: float
    begin: float = 0.0
    end: float = 1.0

    def locate(self, fraction: float) -> complex:
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
        None if neighbours at a corner do not meet.
    """
    pieces, breaks = _moved_pieces(chain, distance)
    kept = list(range(len(pieces)))
    for index in breaks:
        i, j = index % len(pieces), (index + 1) % len(pieces)
        if i in kept and j in kept and not _trim_at_crossing(pieces, kept, i, j):
            return None
    if len(kept) < 2:
        return None
    nodes = [pieces[index].locate(pieces[index].begin) for index in kept]
    return ArcChain(np.array([*nodes, nodes[0]]), np.array([pieces[index].bulge for index in kept]))


def _moved_pieces(chain: ArcChain, distance: float) -> tuple[list[_Piece], list[int]]:
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
        if corners[index] > _TANGENT_ANGLE:
            begin = complex(chain.nodes[index + 1] - 1j * distance * out[index])
            end = starts[(index + 1) % len(starts)]
            pieces.append(_Piece(begin, end - begin, float(corners[index] * np.sign(distance))))
        elif corners[index] < -_TANGENT_ANGLE:
            breaks.append(len(pieces) - 1)
    return pieces, list(dict.fromkeys(breaks))


def _trim_at_crossing(pieces: list[_Piece], kept: list[int], i: int, j: int) -> bool:
    """End piece i and begin piece j where they cross, and drop from `kept` what lies beyond; tell whether they do."""
    while i != j and len(kept) > 2:
        crossing = _crossing(pieces[i], pieces[j])
        if crossing is None:
            return False
        if crossing[0] <= pieces[i].begin + _TANGENT_ANGLE:
            before = kept[kept.index(i) - 1]
            kept.remove(i)
            i = before
        elif crossing[1] >= pieces[j].end - _TANGENT_ANGLE:
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
        gap = second.locate(at[1]) - first.locate(at[0])
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
