"""A contact among the unknowns of a network."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from cfmkit.elastica.model.contact import Contact, FrictionState


class ContactAt(NamedTuple):
    """A contact, where it acts, and the unknown that is its force; of the side of a beam also its place."""

    item: Contact
    place: int  # attachment
    unknown: int
    number: int  # in `Network.contacts`
    closed: bool | None = None  # None: as force and gap say
    slide: int = -1  # unknown that is the parameter of the beam's shape at which it touches; -1: a node touches
    element: int = -1  # that ends there
    laid: int = 0  # -1 or 1: the element before or behind it lies on the obstacle
    # unknown that says the same of a state; of a node with friction: 0 where it sticks, the sense in which it slips
    flag: int = -1
    rub: int = -1  # unknown that is the tangential force; -1: there is no friction
    anchor: int = -1  # unknown that is the place along the obstacle at which it sticks
    friction: FrictionState | None = None  # None: as the state's flag says

    @property
    def own_unknowns(self) -> tuple[int, ...]:
        """Unknowns of the contact of a node: its force, then with friction tangential force, flag and anchor."""
        return (self.unknown,) if self.rub < 0 else (self.unknown, self.rub, self.flag, self.anchor)
