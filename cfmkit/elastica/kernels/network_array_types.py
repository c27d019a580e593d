"""The arrays that describe a network to the compiled code, and the layout of its unknowns.

Everything is dimensionless: lengths by a length L0, forces by F0 = EI0/L0**2, moments by EI0/L0.

An attachment is a place fixed to a node: the node's position plus a vector that turns with it. Its pose is
(x, y, rotation). A segment is a part of a beam between two places of multiple shooting. The unknowns y are

    z = [free degrees of freedom (n_free) | force (h, v, m) on the last section of every beam (3 each)],
    then for every segment its start pose (x, y, rotation) and start force (h, v, m): 6 each.

The start pose of a beam's first segment is that of its attachment and its slot is only kept up to date.
(h, v, m) is what the part after a section exerts on the part before it.
"""

from __future__ import annotations

from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from cfmkit.elastica.kernels.passing_arrays_by_address import Packed, floats, integers, truths

IntArray = NDArray[Any]

TABLE_COLUMNS = 6
ANGLE, LENGTH, BENDING, STRETCH, SHEAR, RUN = range(TABLE_COLUMNS)
"""Columns of the table: reference angle and arc length L of a kick, integral of ds/EI of the drift before it, L/EA and
L/GA of the kick, arc length from the start of the step to it."""

LINE, TURN, SLIDE = range(3)
"""Kinds of springs: along the line between two places, against their rotation, along a direction."""

STIFFNESS, REST, TIGHTENING = 0, 1, 4
DIRECTION_X, DIRECTION_Y, REST_GAP = 1, 2, 3
"""Values of a spring: stiffness, free length or angle, by how much that or the gap grows with the drive; the direction
(cos, sin) and the free gap of a slide."""

SHARE, HALVES = 6, (7, 10)
"""Columns that a table with wide strips has beside those: nu^2/(1 - nu^2), and where the halves of a drift begin.

A half has its integral of ds/EI, its turn at rest, and its th^4/(turn + rest)^2 of
`cfmkit.elastica.kernels.wide_strip`, each at a node of Gauss' rule with two of them: beams whose curvature or thickness
varies are then integrated to the fourth order, as the splitting is where the energy is no square of the moment.
"""


class _ModelArrays(NamedTuple):
    table: Any
    segment_step: Any
    segment_turn: Any
    beam_segment: Any
    beam_end: Any
    line_load: Any
    place_dof: Any
    place_frame: Any
    place_origin: Any
    place_arm: Any
    base: Any
    rate: Any
    slot: Any
    load_place: Any
    load_value: Any
    load_follows: Any
    spring_place: Any
    spring_kind: Any
    spring_value: Any


class DiscreteNetwork(Packed, _ModelArrays):
    """A network, discretised.

    Attributes
    ----------
    table : (steps, rows, 6 or 13) array
        What the drifts and kicks of every step take, see
        `cfmkit.elastica.kernels.symplectic_splitting_coefficients`: the reference angle at the kick; the arc length L
        of the kick; the integral of ds/EI over the drift before it; L/EA and L/GA of the kick; the arc length from the
        step's start to the kick. The last row is the closing drift, without a kick. Seven columns more where a beam is
        a wide strip: see `HALVES`.
    segment_step : (segments + 1,) int array
        First step of each segment.
    segment_turn : (segments,) array
        Integral of ds/EI over each segment.
    beam_segment : (beams + 1,) int array
        First segment of each beam.
    beam_end : (beams, 2) int array
        Attachments of the two ends.
    line_load : (beams, 2, 2) array
        Dead load per reference length, (constant, per unit of the drive) x (x, y).
    place_dof, place_frame, place_origin, place_arm :
        (n, 4) int degrees of freedom: along and across in the node's frame, rotation of the vector, rotation of the
        pose (another one at a pin); (n, 2) cos, sin of the frame; (n, 2) node; (n, 2) turning vector.
    base, rate : (dofs,) arrays
        Values of the degrees of freedom that are not free: base + rate * drive.
    slot : (dofs,) int array
        Index of the unknown, -1 where not free.
    load_place, load_value, load_follows :
        (n,) int attachment; (n, 2, 3) (constant, per unit of the drive) x (fx, fy, m); (n,) bool.
    spring_place, spring_kind, spring_value :
        (n, 2) int attachments; (n,) int; (n, 5) values, see `STIFFNESS`.
    """

    kinds = _ModelArrays(
        table=floats(3),
        segment_step=integers(1),
        segment_turn=floats(1),
        beam_segment=integers(1),
        beam_end=integers(2),
        line_load=floats(3),
        place_dof=integers(2),
        place_frame=floats(2),
        place_origin=floats(2),
        place_arm=floats(2),
        base=floats(1),
        rate=floats(1),
        slot=integers(1),
        load_place=integers(1),
        load_value=floats(3),
        load_follows=integers(1),
        spring_place=integers(2),
        spring_kind=integers(1),
        spring_value=floats(2),
    )


class _DesignSlopesArrays(NamedTuple):
    variable: Any
    first: Any
    table: Any
    begin: Any
    moves: Any
    shifts: Any
    touches: Any
    origin: Any
    arm: Any
    frame: Any
    base: Any
    rate: Any
    spring: Any
    load: Any
    line: Any


class DesignSlopes(Packed, _DesignSlopesArrays):
    """Derivatives of a model's arrays by k design variables.

    Attributes
    ----------
    variable : (pairs,) int array
        The variables that the beams' tables depend on, beam after beam.
    first : (beams + 1,) int array
        Where each beam begins in `variable`.
    table : (n,) array
        Per beam its steps x rows x table columns x its variables, flattened.
    begin : (beams,) int array
        Where each beam begins in `table`.
    moves : (k,) bool array
        Whether a variable changes anything but the tables.
    shifts : (k, places) bool array
        Whether it moves an attachment at unchanged unknowns.
    touches : (beams, k) bool array
        Whether it changes a beam's table or line load, or shifts one of its ends.
    origin, arm, frame : (k, places, 2) arrays
    base, rate : (k, dofs) arrays
    spring : (k, springs, 5) array
    load : (k, loads, 2, 3) array
    line : (k, beams, 2, 2) array
    """

    kinds = _DesignSlopesArrays(
        variable=integers(1),
        first=integers(1),
        table=floats(1),
        begin=integers(1),
        moves=truths(1),
        shifts=truths(2),
        touches=truths(2),
        origin=floats(3),
        arm=floats(3),
        frame=floats(3),
        base=floats(2),
        rate=floats(2),
        spring=floats(3),
        load=floats(4),
        line=floats(4),
    )


Arrays = TypeVar("Arrays", DiscreteNetwork, DesignSlopes)


def in_order(arrays: Arrays) -> Arrays:
    """Return the arrays with their entries in C order: the compiled code takes no other."""
    return type(arrays)(*map(np.ascontiguousarray, arrays))
