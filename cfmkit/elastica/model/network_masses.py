"""What the parts of a network weigh. Statics does not ask for it: it is no part of the network."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import isfinite
from types import MappingProxyType
from typing import TYPE_CHECKING

from cfmkit.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Mapping


@dataclass(frozen=True)
class NetworkMasses:
    """Masses of a network.

    Parameters
    ----------
    density : mapping
        Of every beam, by its name [kg/m^3].
    nodes : mapping
        Mass [kg] and moment of inertia [kg m^2] of what is fixed to nodes, by their names.
    """

    density: Mapping[str, float]
    nodes: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Freeze and check the values."""
        for name, value in self.density.items():
            if not (value > 0 and isfinite(value)):
                raise InputError(f"the density of beam {name!r} must be positive, got {value}")
        for name, values in self.nodes.items():
            if not all(value >= 0 and isfinite(value) for value in values):
                raise InputError(f"mass and inertia of node {name!r} must not be negative, got {values}")
        object.__setattr__(self, "density", MappingProxyType(dict(self.density)))
        object.__setattr__(self, "nodes", MappingProxyType(dict(self.nodes)))
