"""Equilibrium equations of a network with pads and stops of nodes, whose contact forces are unknowns.

They are the equations of the network without contacts (`ContactEquations.plain`), with the force of each contact as a
further unknown and its gap as a further equation. A discretised network and values of its unknowns go in; gradient and
Hessian of its energy, linearised equations and equilibria come out.

If `ContactAt.closed` is None, a contact is taken as closed or open by its force and gap at each of Newton's steps
[HIK]: so an equilibrium near a guess is found whatever its contacts do. The path-following solver sets it to True or
False, so that the path that it follows is smooth.

Reference
---------
[HIK] M. Hintermueller, K. Ito, K. Kunisch, SIAM J. Optim. 13 (2003) 865: an active set as Newton's method.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cfmkit.elastica.contact.line_tangent import raise_pad
from cfmkit.elastica.contact.terms import contact_contribution, measure
from cfmkit.elastica.mechanics.discretise import keep_equations
from cfmkit.elastica.mechanics.equations import LinearEquations, NumpyEquations
from cfmkit.elastica.mechanics.numbering import number_free
from cfmkit.elastica.model.contact import FrictionState

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.mechanics.discretise import Discretisation


def open_all_contacts(mesh: Discretisation) -> Discretisation:
    """Return the arrays of a network in which every contact is open: forces of contacts are held at zero."""
    if not mesh.contacts:
        return mesh
    return replace(mesh, contacts=(), moving=None, free=mesh.free[mesh.free < _first_contact(mesh)])


def with_closed(
    mesh: Discretisation, closed: frozenset[int], friction: Mapping[int, FrictionState] | None = None
) -> Discretisation:
    """Return the arrays of a network in which some contacts are closed, by their numbers, and all others open.

    `friction` says what closed contacts that rub do, by their numbers: nothing, if they are not in it.
    """
    if closed:
        states = friction or {}
        contacts = tuple(
            contact._replace(closed=number in closed, friction=states.get(number, NO_FRICTION))
            for number, contact in enumerate(mesh.contacts)
        )
        held = [unknown for contact in contacts if not contact.closed for unknown in contact.own_unknowns]
        held += [unknown for contact in contacts if contact.rub >= 0 for unknown in (contact.flag, contact.anchor)]
        pressed = replace(mesh, contacts=contacts, free=np.delete(mesh.free, np.searchsorted(mesh.free, held)))
    elif mesh.moving is None:
        pressed = open_all_contacts(mesh)
    else:
        return open_all_contacts(mesh)
    return keep_equations(mesh, pressed)


NO_FRICTION = FrictionState(2.0)


def _first_contact(mesh: Discretisation) -> int:
    return min(contact.unknown for contact in mesh.contacts)


class SymmetricRow(NamedTuple):
    """A row of a condition in the symmetric matrix that stability is counted from."""

    unknowns: Any  # (k,) among the free ones
    values: FloatArray  # (k,)
    pivot: float


@dataclass(frozen=True, eq=False)
class EquationsWithNodes(NumpyEquations):
    """Equations of a network with contacts, as far as pads and stops of nodes go."""

    plain: NumpyEquations = field(kw_only=True)  # without contacts; its free unknowns are the first of these
    slots: Any = field(init=False)  # (size,) number of every unknown among the free ones, -1 where it is held

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "slots", number_free(self.mesh.free, self.mesh.size))

    def place_among_all(self, at: LinearEquations) -> LinearEquations:
        """Return the equations without contacts among those of all unknowns, the others zero."""
        n, count = self.n, self.plain.n
        tangent, residual, change = np.zeros((n, n)), np.zeros(n), np.zeros(n)
        tangent[:count, :count], residual[:count], change[:count] = at.tangent, at.residual, at.change
        return LinearEquations(residual, tangent, change)

    def add_nodes(self, z: FloatArray, at: LinearEquations) -> list[SymmetricRow]:
        """Add the contacts of nodes to the equations at a state; return their rows of the symmetric matrix."""
        moved, rows = self.mesh.base if self.ramp else self.mesh.rate, list[SymmetricRow]()
        for contact in self.mesh.node_contacts:
            if contact.closed is None and (lowered := raise_pad(self.mesh, contact, z[None])[0]):
                contact = contact._replace(
                    closed=bool(z[contact.unknown] > measure(self.mesh, contact, z).value + lowered)
                )
            term = contact_contribution(self.mesh, contact, z)
            slots = self.slots[term.unknowns]
            inside = slots >= 0
            pushed, slot = slots[inside], self.slots[contact.unknown]
            at.residual[pushed] += term.gradient[inside]
            at.tangent[np.ix_(pushed, pushed)] += term.hessian[np.ix_(inside, inside)]
            at.change[pushed] += term.hessian[inside] @ moved[term.unknowns]
            values, pivot = term.hessian[-1, :-1][inside[:-1]], float(term.hessian[-1, -1])
            rows.append(SymmetricRow(pushed[pushed != slot], values, pivot))
        return rows


class ContactEquations(EquationsWithNodes):
    """Equations of a network with pads and stops of nodes for its free unknowns."""

    def gradient(self, free: Any, place: Any) -> Any:
        """Return the gradient by all unknowns, (size,)."""
        if np.iscomplexobj(free) or np.iscomplexobj(place) or self.ramp:
            return super().gradient(free, place)
        return self.gradients(np.asarray(self.values(free, place))[None], np.array([place], float))[0]

    def gradients(self, z: FloatArray, drive: FloatArray) -> FloatArray:
        """Return the gradients by all unknowns of states (p, size), (p, size)."""
        whole_gradients = np.array(self.plain.gradients(z, drive))
        for contact in self.mesh.contacts:
            for number in np.flatnonzero(z[:, contact.unknown]).tolist():
                term = contact_contribution(self.mesh, contact, z[number])
                whole_gradients[number, term.unknowns] += term.gradient
        return whole_gradients

    def linearise(self, free: FloatArray, place: float) -> LinearEquations:
        """Return the equations linearised at some unknowns."""
        at = self.place_among_all(self.plain.linearise(free[: self.plain.n], place))
        self.add_nodes(np.asarray(self.values(free, place)), at)
        return at
