"""The arrays that the compiled code works in: it makes none of its own."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.elastica.kernels.passing_arrays_by_address import Packed, floats, objects
from cfmkit.elastica.kernels.status_codes import KEPT

if TYPE_CHECKING:
    from cfmkit.elastica.kernels.network_array_types import DesignSlopes, DiscreteNetwork

SOLVING = (
    floats(2),  # system, with the drive's column and the bordering row
    floats(2),  # its factors
    floats(2),  # two right sides
    floats(1),  # residuals
    floats(1),  # values of the degrees of freedom
    floats(2),  # poses of a beam's ends
    floats(4),  # relations of the beams, see `cfmkit.elastica.kernels.chain`
    floats(4),  # what is kept of each segment
    # small vectors and matrices, Jacobians, a block, outcomes of the segments, what loads act on that turn with their
    # node
    (floats(3), floats(3), floats(2), floats(2), floats(2)),
    floats(1),  # increments of all unknowns
)

MARCHING = (
    (floats(1), floats(2), floats(2)),  # the last points: parameters, unknowns and drive, their slopes
    (floats(1), floats(1), floats(1)),  # the next point: unknowns; its guess and its slopes, with the drive
    floats(1),  # state of a solution
    (floats(1), floats(1), floats(1), floats(1)),  # border, tangent, the border of a given drive, room
    (floats(1), floats(1), floats(1)),  # a point between two others: unknowns, state, tangent
)

SLOPES = (
    # of the beams' closures and start forces, of the segments; frames of the beams' ends
    (floats(3), floats(3), floats(3), floats(3)),
    # ends of a beam's segments; no rows; tangent, right sides, adjoint
    (floats(2), floats(2), floats(2), floats(2), floats(2)),
    (floats(1), floats(1), floats(2), floats(1)),  # degrees of freedom, forces, of springs and loads, a pose
    floats(1),  # a force
)

HELD_SLOPES = ((floats(1), floats(1), floats(1)), floats(2), floats(2), floats(2))


class WorkSpace(Packed, tuple[Any, ...]):
    """Room for single solutions, in the order of `SOLVING`, and for marches. Not for two threads at once."""

    def _all(self) -> tuple[Any, ...]:
        return (*self[:8], *self[8], self[9])

    @cached_property
    def marching(self) -> bytes:
        """Places of the arrays for marches."""
        kept, new, state, vectors, between = self._marching
        return objects((*kept, *new, state, *vectors, *between))

    @cached_property
    def _marching(self) -> Any:
        n, size = len(self[0]) - 1, len(self[9])
        unit = np.zeros(n + 1)
        unit[n] = 1.0
        return (
            (np.zeros(KEPT), np.zeros((KEPT, size + 1)), np.zeros((KEPT, size + 1))),
            (np.zeros(size), np.zeros(size + 1), np.zeros(size + 1)),
            np.zeros(6),
            (np.zeros(n + 1), np.zeros(n + 1), unit, np.zeros(n + 1)),
            (np.zeros(size), np.zeros(6), np.zeros(n + 1)),
        )


def work_space(n: int, beams: int, dofs: int, segments: int) -> WorkSpace:
    """Return room for solutions with n unknowns z, in a network of so many beams, degrees of freedom and segments."""
    order = n + 1
    return WorkSpace(
        (
            np.zeros((order, order)),
            np.zeros((order, order)),
            np.zeros((order, 2)),
            np.zeros(dofs + 3 * beams),
            np.zeros(dofs),
            np.zeros((2, 3)),
            np.zeros((beams, 6, 3, 3)),
            np.zeros((segments, 7, 3, 3)),
            (
                np.zeros((4, 3, 3)),
                np.zeros((2, 3, 4)),
                np.zeros((3, 3)),
                np.zeros((segments, 28)),
                np.empty((dofs, dofs)),
            ),
            np.zeros(n + 6 * segments),
        )
    )


def slope_space(m: DiscreteNetwork, design: DesignSlopes, n: int) -> Any:
    """Return room for the derivatives of solutions with n unknowns z by all variables, in the order of `SLOPES`."""
    count, beams, dofs = len(design.moves), len(m.beam_end), len(m.slot)
    most, wide = int(np.diff(design.first).max(initial=0)), int(np.diff(m.beam_segment).max(initial=0))
    return (
        (
            np.zeros((beams, count, 3)),
            np.zeros((beams, count, 3)),
            np.zeros((len(m.segment_step) - 1, count, 6)),
            np.empty((beams, 2, 4)),
        ),
        (np.empty((wide, 9 * most)), np.empty((1, 1)), np.empty((n, n)), np.empty((n, count)), np.empty((n, 1))),
        (np.zeros(dofs), np.zeros(dofs), np.zeros((12, 7)), np.zeros(7)),
        np.empty(3),
    )


def held_slope_space(m: DiscreteNetwork) -> Any:
    """Return room for the derivatives of forces on degrees of freedom, in the order of `HELD_SLOPES`."""
    beams, dofs = len(m.beam_end), len(m.slot)
    return (
        (np.empty(dofs), np.empty(dofs), np.empty(dofs)),
        np.zeros((12, 7)),
        np.empty((beams, 3)),
        np.empty((beams, 3)),
    )
