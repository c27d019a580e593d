"""Share by which curling of wide beams would stiffen a network that was solved as if they were narrow.

Assumes: curvatures are those of the solution, ends curl as freely as the middle does. The law, and its reference:
`cfmkit.elastica.mechanics.wide_strip`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.arrays import ShortRepr, read_only
from cfmkit.elastica.mechanics.polynomials import basis
from cfmkit.elastica.model.section import curl_hindered, curling_coefficients
from cfmkit.elastica.results.beam_states import elements_of, forces_of_elements

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.results.path import EquilibriumPath

_ENERGY_RTOL = 1e-24  # share of the largest energy below which there is none: squares of rounded moments
_COMPLEX_STEP = 1e-30  # of a complex step: nothing is subtracted, so that its square may vanish beside one


@dataclass(frozen=True, repr=False)
class HinderedCurling(ShortRepr):
    """Share by which beams that are wide, but solved as narrow ones, are too soft."""

    share: FloatArray  # (n,) of the strain energy of bending of all beams, at every point [1]
    beam: Any  # (n,) the beam that is too soft by most of that


def hindered_curling(path: EquilibriumPath) -> HinderedCurling:
    """Return by what share the energy of bending would be larger at every point of a path, if curling is hindered.

    To first order that is the share of the force that is missing, too. Beams that are solved as wide strips miss
    nothing.
    """
    mesh, names = path.mesh, list(path.network.beams)
    places = basis(mesh.degree).places
    energies, lost = (np.zeros((len(names), len(path))) for _ in range(2))
    all_states = forces_of_elements(path.network, path.at, range(len(mesh.elements.beam)), places)
    for number, name in enumerate(names):
        section, fitted = path.network.beams[name].section, mesh.fits[name]
        for element in elements_of(mesh, name):
            of_element = slice(element * len(places), (element + 1) * len(places))
            moment, thickness = all_states.moment[..., of_element], all_states.thickness[..., of_element]
            left, right = mesh.elements.cuts[element]
            t, inside = left + (right - left) * places, 0.5 * (left + right)
            rest = (
                np.imag(fitted.angle(t + 1j * _COMPLEX_STEP, inside)) / _COMPLEX_STEP / np.real(fitted.speed(t, inside))
            )
            rigidity = section.youngs_modulus * section.width * thickness**3 / 12
            weights = mesh.elements.weight[..., element, :] * mesh.scales.length
            density = 0.5 * moment**2 / rigidity * weights
            energies[number] += density.sum(axis=1)
            if not section.wide:
                curl, plate = curling_coefficients(section.width, thickness, section.poisson_ratio)
                hindered = plate * curl_hindered(curl * (rest + moment / rigidity) ** 2)
                lost[number] += (density * hindered).sum(axis=1)
    total = energies.sum(axis=0)
    bent = total > _ENERGY_RTOL * total.max(initial=0.0)
    share = np.where(bent, lost.sum(axis=0) / np.where(bent, total, 1.0), 0.0)
    return HinderedCurling(read_only(share), read_only(np.array(names)[lost.argmax(axis=0)], np.str_))
