"""Arcs of fillets in an outline that has them as a few lines only.

Where fillets are made by growing and shrinking a polygon, each is an arc whose vertices are exact, but there are so few
of them that lines turn by 3 degrees at a fillet of 0.5 mm and by 20 at one of 0.02 mm. Meshed like that the largest
stress would be that of the corners between the lines.
"""

from __future__ import annotations

import math

import numpy as np

from cfmkit.arrays import read_only
from cfmkit.solid.boundary_and_element_sizes import Ring

AGREE = 1e-3
"""Distance between the centres of an arc's neighbouring lines, in radii: vertices are exact to rounding, and the
shortest line of an arc, a 128th of a circle, is 49 times as long."""


def with_arcs(ring: Ring, radius: float, turn: float) -> Ring:
    """Return a boundary whose fillets of a radius [m] turn by at most `turn` [rad] from line to line.

    An arc is recognised by two lines or more, one after the other, whose ends are on one circle of that radius
    outside the material.

    Parameters
    ----------
    ring : Ring
        Its material is on the left, so that fillets have their centres on the right.
    radius : float
        Of the fillets; 0 for none [m].
    turn : float
        Positive.
    """
    if radius <= 0.0 or len(ring.points) < 3:
        return ring
    start = ring.points[:, 0] + 1j * ring.points[:, 1]
    end = np.roll(start, -1)
    chord = end - start
    length = np.abs(chord)
    fits = (length > 0.0) & (length < 2.0 * radius)
    across = np.sqrt(np.where(fits, radius**2 - 0.25 * length**2, 0.0))
    centre = 0.5 * (start + end) - 1j * across * chord / np.where(fits, length, 1.0)
    same = fits & np.roll(fits, -1) & (np.abs(np.roll(centre, -1) - centre) < AGREE * radius)
    on_arc = same | np.roll(same, 1)
    angle = np.where(on_arc, 2.0 * np.arcsin(np.where(on_arc, 0.5 * length / radius, 0.0)), 0.0)
    pieces = np.where(on_arc, np.ceil(angle / turn - 1e-6), 1).astype(int)
    found: list[complex] = []
    for k, count in enumerate(pieces.tolist()):
        ways = np.arange(count) / max(count, 1)
        spokes = (start[k] - centre[k]) * np.exp(-1j * angle[k] * ways)  # clockwise, as the centre is on the right
        found += (centre[k] + spokes).tolist() if count > 1 else [complex(start[k])]
    points = np.array(found)
    return Ring(read_only(np.column_stack([points.real, points.imag]))) if len(points) > len(start) else ring


def smallest_arc(rough: float) -> float:
    """Return the radius [m] below which an outline that is drawn within `rough` [m] has corners instead of fillets.

    A quarter of a circle needs two lines to be recognised: one alone would be within half of `rough` of it.

    >>> round(1e6 * smallest_arc(1e-6), 2)
    1.71
    """
    return 0.5 * rough / (1.0 - math.cos(math.radians(45.0)))
