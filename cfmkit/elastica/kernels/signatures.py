"""The doors to the compiled code, and what each takes: numbers, arrays, models and other tuples of arrays."""

from __future__ import annotations

from typing import Any

from cfmkit.elastica.kernels.network_array_types import DesignSlopes, DiscreteNetwork
from cfmkit.elastica.kernels.passing_arrays_by_address import complexes, floats, truths
from cfmkit.elastica.kernels.workspace import HELD_SLOPES, MARCHING, SLOPES, SOLVING

WHOLE, REAL = "integer", "number"

SOLVE, MARCH, FORCES, TANGENT, EACH = range(5)
"""Tasks of the first door, which share most of their code."""

_SOLVER = (floats(2), floats(1), floats(1), floats(1), floats(2), floats(1))

DOORS: dict[str, tuple[Any, ...]] = {
    "solver": (WHOLE, WHOLE, REAL, DiscreteNetwork.kinds, floats(1), _SOLVER, SOLVING, MARCHING),
    "states": (WHOLE, DiscreteNetwork.kinds, floats(2), floats(1), floats(3)),
    "complex_states": (WHOLE, DiscreteNetwork.kinds, complexes(2), complexes(1), complexes(3)),
    "slopes": (
        WHOLE,
        DiscreteNetwork.kinds,
        DesignSlopes.kinds,
        floats(2),
        floats(1),
        (floats(3), floats(2)),
        SOLVING,
        SLOPES,
    ),
    "row_slopes": (
        WHOLE,
        DiscreteNetwork.kinds,
        DesignSlopes.kinds,
        floats(2),
        floats(1),
        floats(3),
        truths(2),
        floats(3),
        floats(1),
    ),
    "held_slopes": (
        WHOLE,
        DiscreteNetwork.kinds,
        DesignSlopes.kinds,
        floats(2),
        floats(1),
        floats(3),
        floats(3),
        HELD_SLOPES,
    ),
}
"""Arguments of each function of `cfmkit.elastica.kernels.functions_called_from_python`."""
