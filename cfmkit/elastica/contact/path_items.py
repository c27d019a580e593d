"""Items of a path with contacts: points, events, changes of contacts, and further points on another mesh."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal, NamedTuple

from cfmkit.numerics.continuation.path import PathEvent, PathStop, Point

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.contact.changes import PieceOfPath
    from cfmkit.elastica.contact.side_conditions import SideCondition
    from cfmkit.elastica.mechanics.discretise import Discretisation
    from cfmkit.elastica.mechanics.problem import NetworkProblem
    from cfmkit.numerics.continuation.problem import PathEquilibrium


class ContactChange(NamedTuple):
    """The begin or end of a contact; unstable directions before and after it."""

    kind: Literal["begins", "ends", "blocks", "moves", "spreads", "closes", "slips", "sticks"]
    number: int  # of the contact in the arrays of its piece
    at: PathEquilibrium
    before: int
    after: int
    contact: int = -1  # in `Network.contacts`
    condition: SideCondition | None = None  # on the side of a beam, that is met
    piece: PieceOfPath | None = None  # whose unknowns `at` has; None: that of the piece before
    states: int = 1  # of friction that are possible behind it


class Remeshed(NamedTuple):
    """The points that follow have other unknowns: sides of beams touch at other places."""

    problem: NetworkProblem


class StatesOfPiece(NamedTuple):
    """States of one piece between two meshes: all unknowns (n, size) and drives (n,)."""

    mesh: Discretisation
    z: FloatArray
    drive: FloatArray


PathItem = Point | PathEvent | PathStop | ContactChange | Remeshed
