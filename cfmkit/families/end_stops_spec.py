"""Specification of the end stops of a shuttle or a slider, and checks of their names and of requirements on them."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING, Annotated

from pydantic import Field

from cfmkit.specs.spec import Model
from cfmkit.specs.units import Length, Stiffness

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Mapping, Sequence

    from cfmkit.specs.spec import Requirement

_NAME_PATTERN = re.compile(r"[A-Za-z_][A-Za-z0-9_-]{0,39}")
FreeWay = Annotated[Length, Field(ge=0)]

BEFORE_STOP = 1e-6  # distance from a rigid stop at which a complete motion ends [m]: at the stop its drive is blocked


def travel_up_to_stop(end: float) -> float:
    """Return how far a drive goes that a rigid stop at an end does not block [m], in whole nanometres.

    >>> travel_up_to_stop(0.005457)
    0.005456
    """
    return round(end - BEFORE_STOP, 9)


class EndStop(Model):
    """A stop of a guided part, along its motion."""

    gap: FreeWay | tuple[FreeWay, FreeWay] = Field(
        description="free way from the unloaded pose: of a motion along the drive, or two: [against, along] it"
    )
    stiffness: Annotated[Stiffness, Field(gt=0)] | None = Field(
        None, description="of the stop; default: it is rigid, and the curve ends there"
    )

    @property
    def ends(self) -> tuple[float, float]:
        """Motions between which the part is free [m]; infinite where nothing limits it."""
        if isinstance(self.gap, tuple):
            return 0.0 - self.gap[0], self.gap[1]
        return -math.inf, self.gap


def stop_faults(
    stops: Mapping[str, EndStop], requirements: Sequence[Requirement]
) -> Iterator[tuple[tuple[str | int, ...], str]]:
    """Yield names of stops that cannot be columns, and requirements on the force of a stop that is not there."""
    for name in stops:
        if not _NAME_PATTERN.fullmatch(name):
            yield ("mechanism", "stops", name), "a name is a letter and then at most 39 letters, digits, '_' or '-'"
    yield from contact_requirement_faults(stops, "a stop", requirements)


def contact_requirement_faults(
    names: Collection[str], kinds: str, requirements: Sequence[Requirement]
) -> Iterator[tuple[tuple[str | int, ...], str]]:
    """Yield requirements on the force of a contact that is none of those of some kinds that a mechanism has."""
    for number, requirement in enumerate(requirements):
        plain, bracket, rest = requirement.metric.partition("[")
        if plain in ("contact_force", "contact_force_ripple") and not (bracket and rest.removesuffix("]") in names):
            listed = ", ".join(names) or "none"
            text = f"{plain!r} needs the name of {kinds} in brackets; there are: {listed}"
            yield ("requirements", number, "metric"), text
