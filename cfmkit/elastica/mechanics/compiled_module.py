"""The compiled module and its models, each a row of counts and addresses; rows that networks of one topology share.

C takes a model as a row of 8-byte counts and addresses, so that an array of rows is many designs; what the addresses
point to is kept with the row.
"""

from __future__ import annotations

import os
from functools import cache, lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.arrays import read_only
from cfmkit.elastica.mechanics.numbering import number_free
from cfmkit.elastica.mechanics.polynomials import basis

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.mechanics.numbering import Numbering

WITHOUT_C_VARIABLE = "CFMKIT_WITHOUT_C"  # environment variable that keeps everything in numpy, whatever its value
COUNT_FIELDS = (
    "elements", "points", "degree", "size", "free", "springs", "loads", "ramp", "follows", "contacts", "presses",
    "sides", "moved", "coefficients",
)  # fmt: skip
ADDRESS_FIELDS = (
    "angle", "weight", "rigidity", "axial", "shear", "ahead", "length", "line", "gap", "bend", "unknowns", "ends",
    "places", "arm", "origin", "frame", "values", "slopes", "values_by_shape", "slopes_by_shape", "products", "slot",
    "leaves", "base", "rate", "unit", "spring_at", "spring", "load_at", "load", "rest", "curl", "hindrance",
    "contact_at", "contact", "edge", "side_at", "side", "moved_at", "moved_fixed", "moved_shares", "moved_law", "rule",
    "unit_bend",
)  # fmt: skip
"""Fields of `Model` in march.h, in its order."""
MAX_DEGREE = 40  # as in march.h: arrays of one element are on the stack
N_SIDE_COLUMNS, N_LAW = 13, 3
"""Columns of `side_at`; numbers of an element that moves, before the coefficients of its angle: as in march.h."""


@cache
def find_module() -> Any:
    """Return the compiled module, None if it was not built, or for another version."""
    try:
        from cfmkit.elastica.mechanics import _march  # type: ignore[attr-defined]
    except ImportError:
        return None
    fields = len(COUNT_FIELDS) + len(ADDRESS_FIELDS) + N_SIDE_COLUMNS + N_LAW
    return _march if getattr(_march, "FIELDS", 0) == fields else None


def load_compiled() -> Any:
    """Return the compiled module, None if it was not built, or for another version, or `WITHOUT_C_VARIABLE` is set."""
    return None if WITHOUT_C_VARIABLE in os.environ else find_module()


def make_row(arrays: dict[str, Any], counts: dict[str, int], like: Any = None) -> Any:
    """Return a `Model` with arrays, C order, and counts; what they do not name is that of another, or nothing."""
    row = np.zeros(len(COUNT_FIELDS) + len(ADDRESS_FIELDS), np.int64) if like is None else like.copy()
    for name, count in counts.items():
        row[COUNT_FIELDS.index(name)] = count
    find_module().place(row, len(COUNT_FIELDS), tuple(map(arrays.get, ADDRESS_FIELDS)))
    return row


@lru_cache(maxsize=64)
def slope_products(degree: int) -> FloatArray:
    """Return the products of the slopes of two shape functions at the Gauss points, (q, triangle), by rows of it."""
    slopes, (i, j) = basis(degree).slopes, np.tril_indices(degree + 1)
    return read_only(slopes[:, i] * slopes[:, j])


@lru_cache(maxsize=64)
def shape_row(degree: int) -> tuple[Any, dict[str, Any]]:
    """Return a `Model` with the tables of shape functions alone, and these."""
    rule, (i, j) = basis(degree), np.tril_indices(degree + 1)
    tables = {"values": rule.values, "slopes": rule.slopes, "values_by_shape": rule.values.T}
    tables |= {"slopes_by_shape": rule.slopes.T, "products": rule.values[:, i] * rule.values[:, j]}
    tables |= {"rule": np.stack([rule.places, rule.weights]), "unit_bend": rule.weights @ slope_products(degree)}
    tables = {name: np.ascontiguousarray(table) for name, table in tables.items()}
    return make_row(tables, {"points": len(rule.places), "degree": degree}), tables


@lru_cache(maxsize=128)
def numbered_row(numbering: Numbering, free: bytes) -> tuple[Any, dict[str, Any]]:
    """Return a `Model` with what networks of one topology and the same free unknowns share, and its arrays."""
    row, tables = shape_row(numbering.topology.degree)
    chosen = np.frombuffer(free, np.int64)
    arrays = {"unknowns": numbering.unknowns, "ends": numbering.ends, "places": numbering.places}
    arrays |= {"slot": number_free(chosen, numbering.size), "leaves": numbering.last_element[chosen]}
    counts = {"elements": len(numbering.ends), "size": numbering.size, "free": len(chosen)}
    return make_row(arrays, counts, row), tables | arrays
