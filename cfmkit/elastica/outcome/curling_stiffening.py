"""By how much the curling of wide beams would stiffen a network that was solved without it.

Assumes: curvatures are those of the solution, ends curl as freely as the middle does. The law, and its reference:
`cfmkit.elastica.kernels.wide_strip`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.arrays import read_only
from cfmkit.elastica.model.section import curl_hindered, curling
from cfmkit.elastica.outcome.sections import along_beam

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.outcome.path import Path
    from cfmkit.elastica.outcome.sections import Sampler, Sections

_STEP = 1e-30
"""Of a complex step: nothing is subtracted, so that its square may vanish beside one."""


@dataclass(frozen=True)
class HinderedCurling:
    """What beams that are wide, but solved as narrow ones, are too soft by.

    Attributes
    ----------
    share : (n,) array
        Of the strain energy of bending of all beams, at every point [1].
    beam : (n,) array of str
        The beam that is too soft by most of that.
    """

    share: FloatArray
    beam: Any


def hindered_curling(path: Path) -> HinderedCurling:
    """Return by what share the energy of bending would be larger at every point of a path, if curling is hindered.

    To first order that is the share of the force that is missing, too. Beams that are solved as wide strips miss
    nothing.
    """
    sampler, names = path.sampler, list(path.layout.network.beams)
    energies, missing = [], []
    for number, name in enumerate(names):
        section, found = path.layout.network.beams[name].section, along_beam(sampler, number)
        weights = np.real(sampler.weights(path.layout, number))
        thickness, rest = _at_rest(sampler, number, found)
        rigidity = section.youngs_modulus * section.width * thickness**3 / 12
        density = 0.5 * found.moment**2 / rigidity
        energies.append(density @ weights)
        curl, plate = curling(section.width, thickness, section.poisson_ratio)
        hindered = plate * curl_hindered(curl * (rest + found.moment / rigidity) ** 2)
        missing.append((density * hindered) @ weights if not section.wide else np.zeros(len(path)))
    total, lost = np.sum(energies, axis=0), np.array(missing)
    share = lost.sum(axis=0) / np.where(total > 0, total, 1.0)
    return HinderedCurling(read_only(share), read_only(np.array(names)[lost.argmax(axis=0)], np.str_))


def _at_rest(sampler: Sampler, beam: int, found: Sections) -> tuple[FloatArray, FloatArray]:
    """Return thickness [m] and curvature before any load [1/m] at the rows of a beam, (rows,)."""
    rows, cut, name = sampler.rows(beam), sampler.cut, list(sampler.layout.network.beams)[beam]
    fitted, section = sampler.layout.fits[name], sampler.layout.network.beams[name].section
    thickness, curvature, place = np.empty(len(rows.t)), np.empty(len(rows.t)), found.place[0]
    pieces = cut.piece[rows.step]
    for piece in sorted(set(pieces.tolist())):
        here = pieces == piece
        first = int(rows.step[here][0])
        middle, t = cut.middle[first], rows.t[here]
        thickness[here] = section.thickness_at(place[here], cut.inside[first])
        rising = fitted.angle(t + 1j * _STEP, middle).imag / _STEP
        curvature[here] = rising / np.real(fitted.speed(t, middle))
    return thickness, curvature
