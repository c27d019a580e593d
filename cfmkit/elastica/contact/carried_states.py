"""States of a network on other elements: at a change of contacts, and those of several pieces of a path on one mesh."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.arrays import read_only
from cfmkit.elastica.contact.beam_lines import list_elements
from cfmkit.elastica.contact.side_gaps import ElementLines, find_line_tables, find_lines
from cfmkit.elastica.mechanics import energy
from cfmkit.elastica.mechanics.march import equations
from cfmkit.elastica.mechanics.moving_elements import cuts_at
from cfmkit.elastica.mechanics.polynomials import basis

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.contact.side_gaps import LoadStage
    from cfmkit.elastica.mechanics.discretise import Discretisation


def carry(
    old: Discretisation, z: FloatArray, stage: LoadStage, new: Discretisation, places: FloatArray | None = None
) -> FloatArray:
    """Return states (n, size) of a network on other elements of the same degree, their fields evaluated there.

    Forces of contacts are those of the same contacts of nodes; of sides they are zero. `places` (n, k) are those of the
    contacts of sides of the new elements, if they are not those that these were made for.
    """
    values = np.zeros((len(z), new.size), z.dtype)
    for name, place in new.nodes.items():
        values[:, new.attachments.unknowns[place]] = z[:, old.attachments.unknowns[old.nodes[name]]]
    cuts = cuts_at(old, z)
    fresh = np.broadcast_to(new.elements.cuts, (len(z), *new.elements.cuts.shape))
    if places is not None and new.moving is not None:
        fresh = fresh.copy()
        fresh[:, new.moving.elements] = new.moving.fixed + np.einsum("rck,nk->nrc", new.moving.shares, places)
    rule, columns, bubbles = basis(new.degree), energy.rotation_columns(new.degree), _bubble_matrix(new.degree)
    for beam in new.fits:
        before = np.array(list_elements(old, beam))
        after = np.array(list_elements(new, beam))
        for k, side in ((0, 0), (-1, 1)):
            ends = old.elements.ends[before[k], side], new.elements.ends[after[k], side]
            values[:, new.attachments.unknowns[ends[1]]] = z[:, old.attachments.unknowns[ends[0]]]
        rows, joints = new.elements.unknowns[after], new.elements.ends[after[:-1], 1]
        bodies = new.attachments.unknowns[joints]
        if len(before) == len(after) and np.array_equal(cuts[:, before], fresh[:, after]):
            values[:, rows[:, 8:]] = z[:, old.elements.unknowns[before, 8:]]
            last = old.elements.ends[before[:-1], 1]
            values[:, bodies] = z[:, old.attachments.unknowns[last]]
            values[:, bodies[:, :2]] += _places_at_rest(old, last) - _places_at_rest(new, joints)
            continue
        left, right = fresh[:, after, :1], fresh[:, after, 1:]
        at = left + (right - left) * np.append(rule.places, (0.0, 1.0))
        place, turn, force = _sample_parts(old, z, stage, before, cuts[:, before], at)
        values[:, bodies[:, :2]] = place[:, :-1] - _places_at_rest(new, joints)
        values[:, bodies[:, 2]] = turn[:, :-1, -1]
        rest = turn[..., :-2] - turn[..., -2:-1] * rule.values[:, 0] - turn[..., -1:] * rule.values[:, 1]
        values[:, rows[:, columns[2:]]] = rest @ bubbles.T
        values[:, rows[:, -2:]] = force
    number_of = {contact.number: contact.own_unknowns for contact in old.contacts if contact.slide < 0}
    for contact in new.contacts:
        if contact.slide < 0:
            values[:, list(contact.own_unknowns)] = z[:, list(number_of[contact.number])]
        else:
            values[:, contact.slide], values[:, contact.flag] = fresh[:, contact.element, 1], contact.laid
    return values


@lru_cache(maxsize=64)
def _bubble_matrix(degree: int) -> FloatArray:
    """Return the matrix from rotations at the Gauss points, those of both ends taken off, to bubbles."""
    return read_only(np.linalg.pinv(basis(degree).values[:, 2:]))


def _places_at_rest(mesh: Discretisation, places: Any) -> FloatArray:
    return np.asarray(mesh.attachments.origin[places] + mesh.attachments.arm[places])


def _sample_parts(
    mesh: Discretisation, z: FloatArray, stage: LoadStage, elements: Any, cuts: FloatArray, at: FloatArray
) -> tuple[Any, Any, Any]:
    """Return places (n, m, 2) at ends of m parts of a beam, rotations (n, m, k) on them, end forces, in n states."""
    count, states = len(z), np.arange(len(z))[:, None]
    flat = at.reshape(count, -1)
    home = np.minimum((flat[..., None] > cuts[:, None, :, 1]).sum(axis=-1), len(elements) - 1)
    ends, stages = cuts[states, home], stage.rows()
    places = np.empty(ends.shape)
    numbers, fractions = elements[home], np.clip((flat - ends[..., 0]) / (ends[..., 1] - ends[..., 0]), 0.0, 1.0)
    places[..., 0], places[..., 1] = numbers, fractions
    result = equations(mesh).locate(z, stages, places, find_line_tables(mesh.degree))
    if result is None:
        whole = find_lines(mesh, z, stage, np.arange(len(mesh.elements.beam)))
        seen = ElementLines(*whole[:3], *(table[states, numbers] for table in whole[3:])).evaluate(fractions[..., None])
        result = np.concatenate([seen.place[:, :, 0], seen.turn, seen.ahead], axis=-1)
    result = result.reshape(*at.shape, 4)
    last = numbers.reshape(at.shape)[..., -1]
    load = energy.line_load(mesh, stages[:, 0], stages[:, 1, None, None])[states, last]
    force = z[states[..., None], mesh.elements.unknowns[last, -2:]] + load * result[..., -1, 3:]
    return result[..., -1, :2], result[..., 2], force
