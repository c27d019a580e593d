"""Whether a mesh is the part that was specified: its area, and the section moduli of its beams."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cfmkit.errors import GeometryError
from cfmkit.export.beam_sections import SECTION_RTOL

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cfmkit.arrays import FloatArray
    from cfmkit.export.beam_sections import BeamSection
    from cfmkit.solid.mesh import TriangleMesh

LINES_PER_EDGE = 8  # lines that stand for the parabola of an edge


def check_mesh(grid: TriangleMesh, area: float, sections: Sequence[BeamSection]) -> None:
    """Refuse a mesh whose area [m2] or whose beams are not those of the part.

    Pieces of beams that are shorter than they are thick are not judged: where a thickness changes from station to
    station elements smooth the kinks between them.

    Raises GeometryError with the place and the values.
    """
    if abs(grid.area - area) > SECTION_RTOL * area:
        raise GeometryError(f"the mesh covers {1e6 * grid.area:.6g} mm2 of the part's {1e6 * area:.6g} mm2")
    starts, ends = _edges(grid)
    for section in sections:
        if section.length >= section.thickness:
            section.check(sum(section.cut(starts, ends)), "mesh", "check mechanism.part")


def _edges(grid: TriangleMesh) -> tuple[FloatArray, FloatArray]:
    """Return the boundary of a mesh as short lines: starts and ends (n, 2) [m]."""
    a, b, middle = (grid.nodes[grid.edges[:, k], None] for k in range(3))
    s = np.linspace(0.0, 1.0, LINES_PER_EDGE + 1)[:, None]
    curve = (1 - s) * (1 - 2 * s) * a + 4 * s * (1 - s) * middle + s * (2 * s - 1) * b
    return curve[:, :-1].reshape(-1, 2), curve[:, 1:].reshape(-1, 2)
