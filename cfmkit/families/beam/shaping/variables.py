"""The design variables: free node coordinates and shape coefficients, closure eliminated.

Angle and length of a beam follow from its chord: a shape is turned and scaled to fit between its nodes. So of
eta = c0 + c1 u + ... only c1, c2, ... vary, and none of the closure equations of [Lan, table 1] is a constraint.

Reference
---------
[Lan] C.-C. Lan, J.-H. Wang, Y.-H. Chen, A compliant constant-force mechanism (2010).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.elastica import Network, Polynomial

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.families.beam.shaping.task import Task


@dataclass(frozen=True)
class Variables:
    """The vector of design variables of a task, for one order of the shapes.

    Coordinates in units of the task's size, then the coefficients c1..cm of each shaped beam in turn.
    """

    task: Task
    order: int

    @property
    def count(self) -> int:
        """How many there are."""
        return len(self.task.coordinates) + self.order * len(self.task.shaped)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """As reports call them."""
        places = [coordinate.name for coordinate in self.task.coordinates]
        return (*places, *(f"{beam}.c{k}" for beam in self.task.shaped for k in range(1, self.order + 1)))

    @cached_property
    def bounds(self) -> FloatArray:
        """Lowest and highest values, (k, 2)."""
        size, limit = self.task.size, self.task.coefficient_limit
        places = [(coordinate.low / size, coordinate.high / size) for coordinate in self.task.coordinates]
        rest = self.count - len(places)
        return np.array([*places, *([(-limit, limit)] * rest)]).reshape(-1, 2)

    def build(self, x: Any) -> Network:
        """Return the network of a vector of variables, which may be complex."""
        network, places = self.task.network, len(self.task.coordinates)
        nodes = dict(network.nodes)
        for value, coordinate in zip(x[:places], self.task.coordinates, strict=True):
            at = value * self.task.size
            nodes[coordinate.node] = replace(nodes[coordinate.node], **{"xy"[coordinate.axis]: at})
        beams = dict(network.beams)
        for beam, row in zip(self.task.shaped, x[places:].reshape(len(self.task.shaped), self.order), strict=True):
            beams[beam] = replace(beams[beam], shape=Polynomial((0.0, *row)), closure="rotscale")
        return Network(nodes, beams, network.links, network.springs, network.loads)

    def read(self) -> FloatArray:
        """Return the variables of the task's own network; terms above the order are dropped."""
        nodes, beams = self.task.network.nodes, self.task.network.beams
        places = [(nodes[one.node].x, nodes[one.node].y)[one.axis] / self.task.size for one in self.task.coordinates]
        rows = [self._coefficients(beams[beam].shape) for beam in self.task.shaped]
        return np.array([*places, *(value for row in rows for value in row)], dtype=float)

    def _coefficients(self, shape: Any) -> list[float]:
        given = list(shape.coefficients[1:]) if isinstance(shape, Polynomial) else []
        return (given + [0.0] * self.order)[: self.order]

    def raised(self, x: FloatArray, order: int) -> tuple[Variables, FloatArray]:
        """Return the variables of another order and the same shapes in them, terms above the order dropped."""
        places = len(self.task.coordinates)
        rows = x[places:].reshape(len(self.task.shaped), self.order)[:, :order]
        wider = np.zeros((len(self.task.shaped), order))
        wider[:, : rows.shape[1]] = rows
        return Variables(self.task, order), np.concatenate([x[:places], wider.ravel()])
