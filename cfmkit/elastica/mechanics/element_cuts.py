"""Cuts of beams into elements: at marks, at layers of taut ones, at places of contacts."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cfmkit.elastica.mechanics.element_tables import smooth_marks
from cfmkit.elastica.model.shapes import Polynomial

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.model.beam import Beam, Fit
    from cfmkit.elastica.model.beam_fits import BeamFits

MAX_TURN = 3.0  # of an unloaded element [rad]; a basis of degree 10 integrates its sine to 1e-10
TAUT_RATIO = 12.0  # L sqrt(N/EI) of a beam from which on its ends are resolved by elements of their own
LAYER_WIDTH = 10.0  # of the first of these elements, in sqrt(EI/N)
LAYER_GROWTH = 4.0  # factor from one of them to the next


class MovingCuts(NamedTuple):
    """Elements whose ends move with the places of contacts: their ends are fixed + shares @ places."""

    elements: Any  # (r,)
    fixed: FloatArray  # (r, 2)
    shares: FloatArray  # (r, 2, k)
    places: Any  # (k,) unknowns


def find_cuts(beam: Beam, fitted: Fit, pieces: int, tautness: float) -> list[float]:
    """Return the parameters between which the elements of a beam lie."""
    count = pieces if turns_little(beam) else max(pieces, int(np.ceil(fitted.turn / MAX_TURN)))
    smooth = itertools.pairwise(smooth_marks(beam, fitted))
    cuts = [left + (right - left) * k / count for left, right in smooth for k in range(count)]
    cuts.append(1.0)
    return _refine_ends(cuts, tautness) if tautness > TAUT_RATIO else cuts


class CutLaw(NamedTuple):
    """Cuts of a beam that move with the places of contacts on it: fixed + shares @ places."""

    fixed: FloatArray  # (cuts,)
    shares: FloatArray  # (cuts, places)

    def evaluate(self, places: Sequence[float]) -> list[float]:
        """Return the cuts with the contacts at some places."""
        return (self.fixed + self.shares @ np.array(places)).tolist()  # type: ignore[no-any-return]


def find_moving_cuts(beam: Beam, fitted: Fit, places: Sequence[float]) -> CutLaw:
    """Return the cuts of a beam with contacts: where it is not smooth, which contacts do not pass, and at contacts.

    There are more, which move with these, only where the unloaded beam turns far: what lies on an obstacle is one.
    """
    marks, n = smooth_marks(beam, fitted), len(places)
    order = np.argsort([*marks, *places], kind="stable")
    fixed = np.array([*marks, *(0.0 for _ in places)])[order]
    shares = np.concatenate([np.zeros((len(marks), n)), np.eye(n)])[order]
    count = 1 if turns_little(beam) else int(np.ceil(fitted.turn / MAX_TURN))
    even = np.arange(1, count + 1)[:, None] / count
    fixed_inside = fixed[:-1] + even * (fixed[1:] - fixed[:-1])
    shares_inside = shares[:-1, None] + even * (shares[1:] - shares[:-1])[:, None]
    return CutLaw(np.append(fixed[0], fixed_inside.T), np.concatenate([shares[:1], shares_inside.reshape(-1, n)]))


def join_cut_laws(laws: Mapping[str, CutLaw], beams: tuple[str, ...], sides: Sequence[tuple[str, int]]) -> MovingCuts:
    """Return the moving ends of the elements of all beams; `sides` are beam and unknown place of each contact."""
    rows, fixed, shares = [], [], []
    for name, law in laws.items():
        mine = [k for k, (beam, _) in enumerate(sides) if beam == name]
        columns = [number for number, beam in enumerate(beams) if beam == name]
        spread = np.zeros((len(law.fixed), len(sides)))
        spread[:, mine] = law.shares
        rows += columns
        fixed.append(np.stack([law.fixed[:-1], law.fixed[1:]], axis=1))
        shares.append(np.stack([spread[:-1], spread[1:]], axis=1))
    return MovingCuts(np.array(rows), np.concatenate(fixed), np.concatenate(shares), [unknown for _, unknown in sides])


def is_straight(beam: Beam, fits: BeamFits, name: str) -> bool:
    """Return True if a beam is straight before it is loaded."""
    if isinstance(beam.shape, Polynomial):
        return not any(coefficient.real for coefficient in beam.shape.coefficients[1:])
    fitted = fits[name]
    angle = np.real(fitted.angle(np.linspace(0, 1, 9), 0.5)) + np.zeros(9)
    return len(fitted.course.breaks) == 2 and not np.ptp(angle) > 0


def turns_little(beam: Beam) -> bool:
    """Return True if the angle of an unloaded beam is a polynomial that cannot turn by more than an element may."""
    return isinstance(beam.shape, Polynomial) and sum(map(abs, beam.shape.coefficients[1:])) <= MAX_TURN


def _refine_ends(cuts: list[float], tautness: float) -> list[float]:
    """Return cuts with layers at both ends of every element: a taut beam bends there, within sqrt(EI/N)."""
    refined = []
    for left, right in itertools.pairwise(cuts):
        width, layers = LAYER_WIDTH / tautness, []
        while width < 0.3 * (right - left):
            layers.append(width)
            width *= LAYER_GROWTH
        refined += [left, *(left + layer for layer in layers), *(right - layer for layer in reversed(layers))]
    return [*refined, 1.0]
