"""How a network's arrays change with design variables: complex steps of the function that builds the network.

A variable moved by an imaginary step of 1e-30 gives derivatives that are exact to rounding, through any function
that accepts complex numbers. Only what depends on the variable is computed again.
"""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.elastica.equilibrium.mesh import assemble_model, table
from cfmkit.elastica.kernels.network_arrays import DesignSlopes, in_order
from cfmkit.elastica.model.network_under_drive import Layout
from cfmkit.elastica.sensitivity.plain_beam_array_derivatives import plain_slopes
from cfmkit.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Callable

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.equilibrium.mesh import Grid
    from cfmkit.elastica.kernels.network_arrays import DiscreteNetwork

STEP = 1e-30
_WHOLE = ("place_dof", "slot", "load_place", "load_follows", "spring_place", "spring_kind", "beam_end")
_MOVING = {
    "origin": "place_origin",
    "arm": "place_arm",
    "frame": "place_frame",
    "base": "base",
    "rate": "rate",
    "spring": "spring_value",
    "load": "load_value",
    "line": "line_load",
}


def slope(value: Any) -> Any:
    """Return the derivative that the imaginary part of a complex step holds."""
    return np.imag(value) / STEP


class ComplexSteps:
    """A layout and what it becomes with each design variable."""

    def __init__(self, layout: Layout, build: Callable[[Any], Any], variables: Any) -> None:
        """Build the network with each variable in turn moved by an imaginary step.

        `build` returns a network, or a network and its drive where variables change the drive's loads or direction.
        """
        x = np.asarray(variables, dtype=float)
        self.layout, self.built = layout, []
        for k in range(len(x)):
            moved = x.astype(complex)
            moved[k] += 1j * STEP
            built = build(moved)
            self.built.append(built if isinstance(built, tuple) else (built, layout.drive))
        self.plain = plain_slopes(layout, self.built, STEP)

    def __len__(self) -> int:
        """Return the number of variables."""
        return len(self.built)

    @cached_property
    def stepped(self) -> list[Layout]:
        """The layouts with each variable in turn moved by an imaginary step."""
        found = []
        for network, drive in self.built:
            stepped = Layout(network, drive, self.layout)
            stepped.scales = self.layout.scales  # before its table is requested: that is kept in these units
            found.append(stepped)
        return found

    def arrays(self, model: DiscreteNetwork, cut: Grid, every: bool = False) -> DesignSlopes:
        """Return the derivatives of a model's arrays; with `every` each beam is paired with every variable.

        Raises
        ------
        cfmkit.errors.InputError
            If a variable changes how the network is made up, not only its values.
        """
        if self.plain is not None:
            return in_order(self.plain.arrays(cut, every))
        stepped = [self._model(k, layout, model, cut) for k, layout in enumerate(self.stepped)]
        tables = np.stack([slope(table(layout, cut, model.table)) for layout in self.stepped], axis=-1)
        variable, first, begin, blocks = [], [0], [], []
        size = 0
        for number in range(len(self.layout.network.beams)):
            changes = tables[cut.beam_of_step == number]
            touched = changes.any(axis=(0, 1, 2)) | [bool(np.any(np.imag(one.line_load[number]))) for one in stepped]
            own = list(range(len(self))) if every else np.flatnonzero(touched).tolist()
            block = changes[..., own]
            variable += own
            first.append(len(variable))
            begin.append(size)
            size += block.size
            blocks.append(block.ravel())
        parts = {short: _stack(stepped, long, model) for short, long in _MOVING.items()}
        moves = np.zeros(len(self), dtype=np.bool_)
        for values in parts.values():
            moves |= values.reshape(len(self), -1).any(axis=1)
        held = (parts["base"] != 0) | (parts["rate"] != 0)
        shifts = held[:, model.place_dof].any(axis=2)
        for name in ("origin", "arm", "frame"):
            shifts |= parts[name].any(axis=2)
        touches = shifts[:, model.beam_end].any(axis=2).T
        for number in range(len(touches)):
            touches[number, variable[first[number] : first[number + 1]]] = True
        design = DesignSlopes(
            variable=np.array(variable, dtype=np.int64),
            first=np.array(first, dtype=np.int64),
            table=np.concatenate(blocks),
            begin=np.array(begin, dtype=np.int64),
            moves=moves,
            shifts=shifts,
            touches=touches,
            **parts,
        )
        return in_order(design)

    def _model(self, k: int, layout: Layout, model: DiscreteNetwork, cut: Grid) -> DiscreteNetwork:
        """Return the arrays for variable k, except the table."""
        stepped = assemble_model(layout, cut, model.table)
        for name in _WHOLE:
            now, was = getattr(stepped, name), getattr(model, name)
            if now.shape != was.shape or np.any(now != was):
                raise InputError(f"design variable {k} changes how the network is made up: no derivative by it")
        return stepped


def _stack(stepped: list[DiscreteNetwork], name: str, model: DiscreteNetwork) -> FloatArray:
    """Return the derivatives of one array by all variables."""
    own = np.asarray(getattr(model, name))
    return np.ascontiguousarray(
        np.array([slope(getattr(one, name)) for one in stepped]).reshape(len(stepped), *own.shape)
    )
