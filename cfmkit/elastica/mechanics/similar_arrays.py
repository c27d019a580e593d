"""Arrays of a network that are those of another but for something: without floors."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from cfmkit.elastica.mechanics.discretise import Discretisation


def make_inextensible(mesh: Discretisation, elements: Any) -> Discretisation:
    """Return the same arrays with elements that do not stretch at all."""
    axial, floored = mesh.elements.axial.copy(), mesh.floored.copy()
    axial[elements], floored[elements] = 0.0, False
    stiff = replace(mesh, elements=mesh.elements._replace(axial=axial), floored=floored)
    stiff.known.update((key, made.stiffen(stiff)) for key, made in mesh.known.items())
    return stiff
