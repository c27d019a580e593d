"""Lengths of the beams before loading, and length over chord, with their derivatives by the design variables."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.elastica.model.beam import fit

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.elastica import Network
    from cfmkit.families.beam.shaping.variables import Variables

_U, _W = np.polynomial.legendre.leggauss(24)
_U, _W = 0.5 * (_U + 1), 0.5 * _W
_TINY = 1e-30


@dataclass(frozen=True)
class Length:
    """Arc length [m] and chord over arc length [1] of one beam, and their derivatives by the variables (k,)."""

    length: float
    straightness: float
    by_length: FloatArray
    by_straightness: FloatArray


def lengths(variables: Variables, x: FloatArray) -> dict[str, Length]:
    """Return the lengths of all beams by name."""
    network = variables.build(x)
    shaped = variables.task.shaped
    return {
        name: _of_polynomial(variables, x, network, name) if name in shaped else _of_any(variables, network, name)
        for name in network.beams
    }


def _of_polynomial(variables: Variables, x: FloatArray, network: Network, name: str) -> Length:
    """Return the length of a beam whose shape varies: chord / |chi| with chi the mean of exp(i eta)."""
    order = variables.order
    first = len(variables.task.coordinates) + order * variables.task.shaped.index(name)
    powers = _U[:, None] ** np.arange(1, order + 1)
    turn = np.exp(1j * (powers @ x[first : first + order])) * _W
    chi = turn.sum()
    by_chi = np.zeros(variables.count, dtype=complex)
    by_chi[first : first + order] = 1j * (turn @ powers)
    ratio = abs(chi)
    by_ratio = np.real(np.conj(chi) * by_chi) / ratio
    reach = _reach(network, name)
    chord = abs(reach)
    by_chord = np.real(np.conj(reach) * _by_reach(variables, name)) / chord
    return Length(chord / ratio, ratio, by_chord / ratio - chord / ratio**2 * by_ratio, by_ratio)


def _of_any(variables: Variables, network: Network, name: str) -> Length:
    """Return the length of any other beam; derivatives by complex steps of the places of its nodes."""
    beam, reach = network.beams[name], _reach(network, name)
    length = float(np.real(fit(beam, (reach.real, reach.imag)).length))
    by_reach = _by_reach(variables, name)
    by_length = np.zeros(variables.count)
    for k in np.flatnonzero(by_reach):
        moved = (reach.real + 1j * _TINY * by_reach[k].real, reach.imag + 1j * _TINY * by_reach[k].imag)
        by_length[k] = np.imag(fit(beam, moved).length) / _TINY
    chord = abs(reach)
    by_chord = np.real(np.conj(reach) * by_reach) / chord
    return Length(length, chord / length, by_length, by_chord / length - chord / length**2 * by_length)


def _reach(network: Network, name: str) -> complex:
    """Return the vector between the ends of a beam [m]."""
    beam = network.beams[name]
    start, end = network.nodes[beam.start], network.nodes[beam.end]
    return complex(end.x - start.x, end.y - start.y) + complex(*beam.end_offset) - complex(*beam.start_offset)


def _by_reach(variables: Variables, name: str) -> FloatArray:
    """Return the derivatives of that vector by the variables, complex (k,)."""
    beam = variables.task.network.beams[name]
    out = np.zeros(variables.count, dtype=complex)
    for k, coordinate in enumerate(variables.task.coordinates):
        sense = (coordinate.node == beam.end) - (coordinate.node == beam.start)
        out[k] = sense * variables.task.size * (1j if coordinate.axis else 1.0)
    return out
