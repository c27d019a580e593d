"""The record of a kind of structure: of leaves that snap through, or of springs of leaves."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping


@dataclass(frozen=True)
class ProposedStructure:
    """Another structure in place of the designed leaves, or of the designed diamond, as `suggest` proposes it."""

    name: str
    variant: str  # what two Vs and a diamond are called with it
    turn: int  # the order in which variants are tried, see `proposals_for_wish.TURNS`
    changes: Callable[[Any], dict[str, Any]]  # from the block as designed: keys of it -> values


@dataclass(frozen=True)
class StructureKind:
    """What kinds of leaves and kinds of springs have in common."""

    name: str  # in `structure` of its block
    description: str  # as the documentation of that key lists it
    law: Callable[..., Any]
    needs: Mapping[str, str] = field(default_factory=dict)  # keys that must be given -> what of
    truss: Callable[..., Any] | None = None  # law of the fidelity `truss`; None if it has none
    is_inclined: bool = True  # whether its leaves have an angle
    can_be_designed: bool = False  # whether `cfmkit design` has sizing rules for it
    proposal: ProposedStructure | None = None  # None: not proposed
