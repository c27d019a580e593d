"""Random starts: free nodes anywhere, beams straight or bent at random, no chord crossing another, none too short."""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.families.beam.build import thickest_of

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica import Network
    from cfmkit.families.beam.shaping.variables import Variables

_MOST = 2000
_LEAST_CHORD = 0.1  # of the mean distance of joined nodes, if no slenderness is asked


def candidates(variables: Variables, rng: np.random.Generator) -> Iterator[FloatArray]:
    """Yield vectors of variables, coefficients up to half their limit; at most 2000 places are tried."""
    low, high = variables.bounds.T
    places = len(variables.task.coordinates)
    for _ in range(_MOST):
        x = rng.uniform(low, high)
        x[places:] *= 0.5
        if sound(variables, x):
            yield x


def sound(variables: Variables, x: FloatArray) -> bool:
    """Tell whether the chords of the beams do not cross and are long enough."""
    network = variables.build(x)
    chords = {name: _chord(network, name) for name in network.beams}
    least = _least_chord(variables, network)
    if any(abs(b - a) < least for a, b in chords.values()):
        return False
    return not any(_cross(*chords[one], *chords[other]) for one, other in combinations(chords, 2))


def _least_chord(variables: Variables, network: Network) -> float:
    slenderness = variables.task.limits.slenderness
    if slenderness is not None:
        return slenderness * max(thickest_of(beam.section) for beam in network.beams.values())
    return _LEAST_CHORD * float(np.mean([abs(b - a) for a, b in (_chord(network, name) for name in network.beams)]))


def _chord(network: Network, name: str) -> tuple[complex, complex]:
    beam = network.beams[name]
    start, end = network.nodes[beam.start], network.nodes[beam.end]
    return complex(start.x, start.y) + complex(*beam.start_offset), complex(end.x, end.y) + complex(*beam.end_offset)


def _cross(a: complex, b: complex, c: complex, d: complex) -> bool:
    """Tell whether the segments a-b and c-d cross; sharing an end is no crossing."""
    if {a, b} & {c, d}:
        return False
    return _side(a, b, c) * _side(a, b, d) < 0 and _side(c, d, a) * _side(c, d, b) < 0


def _side(a: complex, b: complex, c: complex) -> float:
    return float(((b - a).conjugate() * (c - a)).imag)
