"""The same network with rotations of a higher degree: for errors, and for what needs more than statics does."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.elastica.mechanics.polynomials import basis, interpolation
from cfmkit.elastica.model.section import Taper
from cfmkit.elastica.model.shapes import Polynomial

if TYPE_CHECKING:
    from cfmkit.elastica.mechanics.discretise import Discretisation
    from cfmkit.elastica.model.network import Network

DENSITIES = ("angle", "axial", "shear", "ahead")
"""Tables that are functions along an element; `weight` and `rigidity` hold the speed of its parameter, too."""


def has_polynomial_tables(network: Network) -> bool:
    """Return True if all tables of a network are polynomials of a low degree: to raise theirs changes nothing."""
    sections = [beam.section for beam in network.beams.values()]
    plain = not any(section.wide or isinstance(section.thickness, Taper) for section in sections)
    return plain and all(isinstance(beam.shape, Polynomial) for beam in network.beams.values())


def raise_degree(network: Discretisation, degree: int) -> Discretisation:
    """Return a network with the same elements and a higher degree of their rotations.

    Its tables are the polynomials through the Gauss points of the old ones, so that it is bent, or without floors of
    its compliance, as that is.
    """
    if degree == network.degree:
        return network
    e, old, new = network.elements, basis(network.degree), basis(degree)
    to_new = _to_points(network.degree, degree)
    speed = (e.weight / old.weights) @ to_new
    tables = {name: getattr(e, name) @ to_new for name in DENSITIES}
    tables["weight"] = speed * new.weights
    tables["rigidity"] = ((e.rigidity * (e.weight / old.weights) ** 2) @ to_new) / speed**2
    if e.curl is not None:
        tables["rest"], tables["hindrance"] = e.rest @ to_new, e.hindrance @ to_new
        tables["curl"] = ((e.curl * (e.weight / old.weights) ** 2) @ to_new) / speed**2
    count, ends = len(e.length), _n_end_motions(network)
    bubbles = ends + np.arange(count * (degree - 1)).reshape(count, -1)
    forces = ends + count * (degree - 1) + np.arange(2 * count).reshape(count, -1)
    unknowns = np.hstack([e.unknowns[:, :8], bubbles, forces])
    size = ends + count * (degree + 1)
    free = np.concatenate([network.free[network.free < ends], np.arange(ends, size)])
    base, rate = np.zeros(size, network.base.dtype), np.zeros(size)
    base[:ends], rate[:ends] = network.base[:ends], network.rate[:ends]
    elements = e._replace(**tables, unknowns=unknowns)
    return replace(network, degree=degree, elements=elements, size=size, free=free, base=base, rate=rate)


@lru_cache(maxsize=64)
def _to_points(degree: int, finer: int) -> Any:
    """Return the matrix that takes values at the Gauss points of a degree to those of another, from the right."""
    return interpolation(basis(degree).places, basis(finer).places).T


def embed(network: Discretisation, fine: Discretisation, z: Any) -> Any:
    """Return a state (..., size) of a network in the unknowns of one of a higher degree: shapes are hierarchical."""
    ends, old, new = _n_end_motions(network), network.elements.unknowns, fine.elements.unknowns
    found = np.zeros((*z.shape[:-1], fine.size), z.dtype)
    found[..., :ends] = z[..., :ends]
    found[..., new[:, 8 : network.degree + 7]] = z[..., old[:, 8 : network.degree + 7]]
    found[..., new[:, -2:]] = z[..., old[:, -2:]]
    return found


def _n_end_motions(network: Discretisation) -> int:
    """Return the number of unknowns that move ends of elements; bubbles and forces come behind them."""
    return network.size - len(network.elements.length) * (network.degree + 1)
