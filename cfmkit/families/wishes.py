"""A wish for a constant force, and what a family answers to it: types only, SI throughout.

A family's ``propose(wish, run)`` looks at scaling laws, which takes milliseconds, and names designs that are worth
trying; the caller designs them, analyses each with its exact model and keeps those that do what is wished.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

if TYPE_CHECKING:
    from cfmkit.specs.spec import Spec

MaterialBlock = Mapping[str, Any]

RESERVED = 0.8
"""Share of the strength that is used where made parts have to be good: sources scatter moduli by 10 % and more."""


@dataclass(frozen=True)
class Wish:
    """What somebody wants of a mechanism.

    Attributes
    ----------
    kind : {"force", "torque"}
        What is to be constant: over a travel, or over an angle.
    target : float
        How large [N or N m]; of a band, its middle.
    low, high : float
        Ends of the band in which every force has to lie, or, where only a number is wished, of what the mean may be.
    banded : bool
        Whether a band is wished.
    travel : float
        Over which it is constant [m or rad].
    ripple : float
        Largest (max - min)/max over the travel.
    room : tuple of two or three floats
        Across and along the travel, and out of the plane [m].
    materials : tuple of mapping
        `mechanism.material` of each one allowed; empty: whatever is usual.
    adjustable : (float, float), optional
        Between which forces it is to be adjusted [N].
    hysteresis : float, optional
        Largest loss of a cycle over its work.
    cycles : int, optional
        Presses that it has to survive; judged where the material has fatigue data, whose allowable stress counts.
    thinnest : float
        Thinnest leaf that the process makes [m].
    good_parts : float, optional
        Least share of manufactured parts that meet all of it.
    process : str, optional
        By which tolerances they are made; None: those of the process that is usual for the material.
    reserve : float
        Share of the allowable stress that designs by beams may use: solids have more stress, in fillets.
    """

    kind: Literal["force", "torque"]
    target: float
    low: float
    high: float
    banded: bool
    travel: float
    ripple: float
    room: tuple[float, ...]
    materials: tuple[MaterialBlock, ...] = ()
    adjustable: tuple[float, float] | None = None
    hysteresis: float | None = None
    cycles: int | None = None
    thinnest: float = 2e-5
    good_parts: float | None = None
    process: str | None = None
    reserve: float = 1.0

    @property
    def depth(self) -> float | None:
        """What there is out of the plane [m]; None where it does not matter."""
        return self.room[2] if len(self.room) > 2 else None

    @property
    def strength_used(self) -> float:
        """The share of the allowable stress that designs may use: made parts are thicker and stiffer than drawn."""
        return self.reserve * (1.0 if self.good_parts is None else RESERVED)


@dataclass(frozen=True)
class Candidate:
    """A design that is worth trying.

    Attributes
    ----------
    variant : str
        Which of the family's, in a few words.
    spec : Spec
        Complete, or with a block `design` that the family's own design completes.
    design : bool
        Whether it is to be designed.
    finish : str
        ``"module:function"``, ``function(spec, wish) -> spec``: what makes the designed one the one that is judged, its
        window and travel written out; ``"module:function:word"``, ``function(word, spec, wish)``. Empty: nothing has to
        be done.
    promise : float
        The smaller, the sooner it is worth a try.
    free : tuple of str
        Paths of values of one that is not designed, which may move where made parts miss a yield.
    correct : str
        ``"module:function"``, ``function(spec, wish) -> spec``: solves the part by the finest model of the family and
        returns it with that model, its window, thicknesses and widths corrected by what was found. Empty: it is judged
        by that model as it is.
    reserve : float
        `Wish.reserve` that it was proposed for, and is designed with.
    """

    variant: str
    spec: Spec
    design: bool = False
    finish: str = ""
    promise: float = 0.0
    free: tuple[str, ...] = ()
    correct: str = ""
    reserve: float = 1.0


def called(variant: str, wish: Wish, block: MaterialBlock) -> str:
    """Return what a variant is called: with its material where the wish allows several.

    Examples
    --------
    >>> wish = Wish("force", 1.0, 1.0, 1.0, False, 1.0, 0.1, (1.0, 1.0), ({"name": "pla"}, {"name": "pom"}))
    >>> called("2 Vs", wish, wish.materials[1])
    '2 Vs, pom'
    """
    name = block.get("name") if len(wish.materials) > 1 else None
    return f"{variant}, {name}" if name else variant


@dataclass(frozen=True)
class FamilyOffer:
    """What a family could do with a wish.

    Attributes
    ----------
    candidates : tuple of Candidate
        Worth being made, the most promising first; empty where the wish is out of reach.
    reason : str
        Why there are none.
    """

    candidates: tuple[Candidate, ...] = ()
    reason: str = ""
