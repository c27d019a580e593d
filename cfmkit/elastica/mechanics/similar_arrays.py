"""Arrays of a network that are those of another but for something: without floors, of the same make-up."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.elastica.mechanics.discretise import Discretisation, discretise

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cfmkit.elastica.model.drive import Drive
    from cfmkit.elastica.model.network import Network


def make_inextensible(mesh: Discretisation, elements: Any) -> Discretisation:
    """Return the same arrays with elements that do not stretch at all."""
    axial, floored = mesh.elements.axial.copy(), mesh.floored.copy()
    axial[elements], floored[elements] = 0.0, False
    stiff = replace(mesh, elements=mesh.elements._replace(axial=axial), floored=floored)
    stiff.known.update((key, made.stiffen(stiff)) for key, made in mesh.known.items())
    return stiff


def discretise_alike(
    template: Discretisation, network: Network, drive: Drive, cuts: Mapping[str, list[float]] | None = None
) -> Discretisation:
    """Return the arrays of another network of the same make-up: degree, floors and units of the template's.

    It has the template's `cuts` if they are given: where they differ by complex steps only.
    """
    arrays = discretise(network, drive, template.degree, template.pieces, template.tension, template.scales, cuts=cuts)
    return make_inextensible(arrays, np.flatnonzero(arrays.floored & ~template.floored))
