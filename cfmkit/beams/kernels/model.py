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

from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from cfmkit.curves import FloatArray

IntArray = NDArray[Any]

TABLE_COLUMNS = 6  # see `Model`


class Model(NamedTuple):
    """A network, discretised.

    Attributes
    ----------
    table : (steps, rows, 6) array
        What the drifts and kicks of every step take, see `cfmkit.beams.kernels.splitting`: the reference angle at the
        kick; the arc length L of the kick; the integral of ds/EI over the drift before it; L/EA and L/GA of the kick;
        the arc length from the step's start to the kick. The last row is the closing drift, without a kick.
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
        (n, 2) int attachments; (n,) int; (n, 5) values, see `cfmkit.beams.kernels.springs`.
    """

    table: FloatArray
    segment_step: IntArray
    segment_turn: FloatArray
    beam_segment: IntArray
    beam_end: IntArray
    line_load: FloatArray
    place_dof: IntArray
    place_frame: FloatArray
    place_origin: FloatArray
    place_arm: FloatArray
    base: FloatArray
    rate: FloatArray
    slot: IntArray
    load_place: IntArray
    load_value: FloatArray
    load_follows: IntArray
    spring_place: IntArray
    spring_kind: IntArray
    spring_value: FloatArray


class Tilt(NamedTuple):
    """Derivatives of a model's arrays by k design variables.

    Attributes
    ----------
    variable : (pairs,) int array
        The variables that the beams' tables depend on, beam after beam.
    first : (beams + 1,) int array
        Where each beam begins in `variable`.
    table : (n,) array
        Per beam its steps x rows x 6 table columns x its variables, flattened.
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

    variable: IntArray
    first: IntArray
    table: FloatArray
    begin: IntArray
    moves: Any
    shifts: Any
    touches: Any
    origin: FloatArray
    arm: FloatArray
    frame: FloatArray
    base: FloatArray
    rate: FloatArray
    spring: FloatArray
    load: FloatArray
    line: FloatArray


Arrays = TypeVar("Arrays", Model, Tilt)


def in_order(arrays: Arrays) -> Arrays:
    """Return the arrays with their entries in C order: for every other order the code is compiled again."""
    return type(arrays)(*map(np.ascontiguousarray, arrays))
