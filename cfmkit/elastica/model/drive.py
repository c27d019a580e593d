"""Load cases: a motion of a node or a factor of loads taken through values (`Drive`); options of following (`Control`).

Every drive has `points`, the values at which results are wanted, in the order in which they are passed, starting
from rest (zero, which need not be among them). The values may turn round (up, and down again): what was passed is then
met once more, from the other side. `Control` says how the path is followed. A drive that cannot be applied, because its
node is held or moved by a link, is an error of the user.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from math import isfinite
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

from cfmkit.arrays import ShortRepr, read_only
from cfmkit.elastica.model.network import LineLoad, LoadOn, PointLoad, same_direction
from cfmkit.errors import InputError

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.model.network import Network


@dataclass(frozen=True, repr=False)
class Displacement(ShortRepr):
    """A node is moved along a direction [rad] by `points` [m]; the effort is the force along it [N].

    `loads` grow with it, by so much for one metre.
    """

    node: str
    direction: float
    points: FloatArray
    loads: tuple[LoadOn, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "points", _check_points(self.points))


@dataclass(frozen=True)
class Rotation:
    """A node is turned by `points` [rad]; the effort is the moment [N m].

    `loads` grow with it, by so much for one radian.
    """

    node: str
    points: FloatArray
    loads: tuple[LoadOn, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "points", _check_points(self.points))


@dataclass(frozen=True)
class Loading:
    """Loads are applied times a factor that goes through `points` [1].

    The effort is the work-conjugate displacement: the sum of load times displacement per unit of the factor [J];
    for one unit force it is the displacement along it.
    """

    loads: tuple[LoadOn, ...]
    points: FloatArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "points", _check_points(self.points))
        if not self.loads or not all(isinstance(load, PointLoad | LineLoad) for load in self.loads):
            raise InputError("a load drive needs at least one load")


Drive = Displacement | Rotation | Loading


@dataclass(frozen=True)
class Control:
    """Options of path following, and the accuracy of a path."""

    tolerance: float = 1e-7  # error of forces and positions allowed, relative to the largest of the path [1]
    through_folds: bool = False
    """Follow the path through limit points of the drive, where it would end otherwise: from there on by its arc length,
    until the drive leads on again. Until then it is unstable and stays on its curve, whatever `branch` says; its
    bifurcations are reported. Requested values that are passed several times are delivered every time. It ends where
    the last of them (the last before the points turn round) is passed first."""
    branch: Literal["stable", "primary", "stop"] = "stable"
    """Way on after a loss of stability: leave for a stable branch, stay on the path and say so, or end the path there,
    the quickest way to know that a design is no good. With `through_folds` the path stays on its curve also where no
    stable branch begins."""
    # which of two mirror-image branches is taken, at every bifurcation anew, also where the points turn round
    sign: Literal[1, -1] = 1
    largest_turn: float = 0.35  # largest change in one step, of a rotation [rad], or of a position [mean beam length]
    first_step: float | None = None  # as a fraction of the drive's range; found from the points unless given
    most_points: int = 2000  # besides those requested
    imperfection: float = 0.0
    """Bend the unloaded beams, and move the nodes between them, by so much [m] in the form of the buckling mode at the
    first bifurcation of the perfect path, to either side by its sign. `Path.imperfection` names what was done."""

    def __post_init__(self) -> None:
        if not 1e-12 <= self.tolerance <= 0.1:
            raise InputError(f"the tolerance must be between 1e-12 and 0.1, got {self.tolerance}")
        if self.branch not in ("stable", "primary", "stop") or self.sign not in (1, -1):
            raise InputError("branch is 'stable', 'primary' or 'stop', sign 1 or -1")
        if not (self.largest_turn > 0 and self.most_points >= 2):
            raise InputError("largest_turn must be positive and most_points at least 2")
        if not isfinite(self.imperfection):
            raise InputError(f"the imperfection must be a finite length, got {self.imperfection}")
        if self.first_step is not None and not 0 < self.first_step <= 1:
            raise InputError(f"first_step must be above 0 and at most 1, got {self.first_step}")


def _check_points(points: FloatArray) -> FloatArray:
    array = read_only(np.atleast_1d(np.asarray(points, dtype=float)))
    if array.ndim != 1 or len(array) == 0 or not np.isfinite(array).all():
        raise InputError("a drive needs a list of finite points")
    if (np.diff(array) == 0).any():
        raise InputError("the points of a drive must differ from one to the next")
    if not array.any():
        raise InputError("a drive needs a point other than zero")
    return array


FRAME_OF_DRIVE = 3  # number of the motion of a node in the frame of its drive


class DrivenNode(NamedTuple):
    """A node and its motion that a drive prescribes."""

    node: str
    # 0 or 1 for the motion along or across the direction of the node's support, 2 for its rotation; `FRAME_OF_DRIVE` if
    # the support holds neither of the first two: its frame is then turned so that its x axis is along the drive
    motion: int
    sense: float  # 1 or -1: a drive may lead against the direction that the support leaves free


def find_driven_node(network: Network, drive: Drive) -> DrivenNode | None:
    """Return the node and the motion that a drive prescribes; None if it prescribes loads.

    Directions may be complex (derivatives are taken by complex steps); their real parts decide.

    Raises InputError if the node is moved by a link, or held where it is to move.
    """
    if isinstance(drive, Loading):
        return None
    if drive.node not in network.nodes or network.is_moved_by_link(drive.node):
        movable = ", ".join(name for name in network.nodes if not network.is_moved_by_link(name))
        raise InputError(f"{drive.node!r} cannot be driven: nodes that are not moved by a link are {movable}")
    support = network.nodes[drive.node].support
    if isinstance(drive, Rotation):
        if support.rotation:
            raise InputError(f"node {drive.node!r} cannot be turned: its rotation is held")
        return DrivenNode(drive.node, 2, 1.0)
    if not support.along and not support.across:
        return DrivenNode(drive.node, FRAME_OF_DRIVE, 1.0)
    for held, is_other_held, offset, turn in (
        (support.along, support.across, 0, 0.0),
        (support.across, support.along, 1, np.pi / 2),
    ):
        if not held and is_other_held and same_direction(drive.direction, support.direction + turn):
            along = math.cos(drive.direction.real - support.direction.real - turn)
            return DrivenNode(drive.node, offset, math.copysign(1.0, along))
    direction = np.degrees(np.real(drive.direction))
    raise InputError(f"node {drive.node!r} cannot be moved along {direction:.6g} deg: it is held")
