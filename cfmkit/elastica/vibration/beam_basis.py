"""Small motions of one beam about a pose, as a Ritz basis: rotation, stretch and shear are polynomials on panels.

The places follow exactly from them, r' = t(rotation, stretch, shear), so that an inextensible beam is exactly
inextensible: no penalty stiffness stands for that, and nothing locks. The unknowns of a beam are, in order,

    along, across, swing and pose of its first attachment; the same of its last one; then the inner coefficients:
    rotations between panels, bubbles of the rotation; stretches and shears, where the section has them.

Everything is without dimension, in the units of the network's layout; masses per length are in kg/m.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.elastica.outcome.sections import TURN, H, V

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.outcome.path import Path

ENDS = 8  # degrees of freedom at the attachments of the two ends
_FIRST, _LAST = 3, 7  # rotations of the two ends among them
_DEGREES = ((2, 10), (4, 8), (np.inf, 6))  # of the polynomials, by the number of panels: about as many unknowns
_MANY = 16  # panels of one length; more of them are graded where the beam is flat
_FLAT = 0.5  # [rad]: over such an angle one panel follows an arc to rounding
_MORE = 4  # places of the quadrature beyond the degree: the pose bends, and the thickness may vary, within a panel


@dataclass(frozen=True)
class Panels:
    """Where a beam is sampled, and its basis there.

    Attributes
    ----------
    t : (n,) array
        Parameters of the shape at the places of the quadrature.
    weight : (n,) array
        Arc length that each place stands for.
    run : (n, n) array
        Integral from the start of the beam to each place, of what is given at all of them.
    turn, bend : (n, unknowns) arrays
        Rotation and its derivative by the arc length.
    stretch, slide : (n, unknowns) arrays
        Stretch and shear.
    angle, rigidity, pull, slip : (n,) arrays
        Angle before any load; EI; 1/EA and 1/GA, zero where left out.
    area_mass, turn_mass : (n,) arrays
        Area [m^2] and its second moment [m^4]: masses and moments of inertia per length for a density of one.
    """

    t: FloatArray
    weight: FloatArray
    run: FloatArray
    turn: FloatArray
    bend: FloatArray
    stretch: FloatArray
    slide: FloatArray
    angle: FloatArray
    rigidity: FloatArray
    pull: FloatArray
    slip: FloatArray
    area_mass: FloatArray
    turn_mass: FloatArray

    @property
    def unknowns(self) -> int:
        """Number of unknowns, those of the attachments included."""
        return int(self.turn.shape[1])


@dataclass(frozen=True)
class Quadratic:
    """Second variations of a beam's energies at some poses, and what keeps it together.

    Attributes
    ----------
    stiffness, mass : (points, n, n) arrays
        Of the elastic energy with the section forces; of the kinetic one.
    gap : (points, 2, n) array
        Motion of the last section less that of its attachment, which must vanish: without the attachment's part.
    """

    stiffness: FloatArray
    mass: FloatArray
    gap: FloatArray


@lru_cache(maxsize=32)
def _reference(degree: int) -> tuple[Any, ...]:
    """Return places and weights on (-1, 1), integrals up to them, hats and bubbles, slopes of bubbles, polynomials."""
    from numpy.polynomial import legendre

    places, weights = legendre.leggauss(degree + _MORE)
    count = len(places)
    known = legendre.legvander(places, count)
    # the integral of P_k from -1 is (P_{k+1} - P_{k-1}) / (2 k + 1); that of P_0 is x + 1
    whole = [places + 1.0, *((known[:, k + 1] - known[:, k - 1]) / (2 * k + 1) for k in range(1, count))]
    up_to = np.stack(whole, axis=1) @ np.linalg.inv(known[:, :count])
    hats = np.stack([0.5 * (1 - places), 0.5 * (1 + places)], axis=1)
    bubbles = np.stack(whole[1:degree], axis=1)
    slopes = known[:, 1:degree]
    return places, weights, up_to, np.hstack([hats, bubbles]), slopes, known[:, :degree]


def _strains(degree: int) -> int:
    """Return the number of coefficients of stretch or shear on a panel: half the degree, they count for far less."""
    return degree // 2 + 1


def _cuts(path: Path, beam: int, modes: int) -> list[tuple[float, float, float, float]]:
    """Return the panels of a beam: both ends, and a parameter and a fraction of the length within its smooth piece.

    A panel has at most half a wave of the highest mode that is wanted, and is about as short as the segments of the
    path, which are short enough for the tension.
    """
    cut = path.sampler.cut
    own = np.flatnonzero(cut.beam_of_step == beam)
    segments = int(cut.beam_segment[beam + 1] - cut.beam_segment[beam])
    wanted = max(segments, modes // 2 + 1)
    found, flat = [], _is_flat(path, beam)
    for piece in np.unique(cut.piece[own]):
        steps = own[cut.piece[own] == piece]
        left, right = float(cut.edges[steps[0], 0]), float(cut.edges[steps[-1], 1])
        shares = _shares(int(np.ceil(wanted * len(steps) / len(own))), flat, modes)
        edges = (left + (right - left) * shares).tolist()
        where = float(cut.middle[steps[0]]), float(cut.inside[steps[0]])
        found += [(a, b, *where) for a, b in itertools.pairwise(edges)]
    return found


def _is_flat(path: Path, beam: int) -> bool:
    """Tell whether a beam is bent by little, before any load and at all points of the path."""
    rows, fitted = path.sampler.rows(beam), path.layout.fits[list(path.layout.network.beams)[beam]]
    middles = path.sampler.cut.middle[rows.step].tolist()
    angles = [float(np.real(fitted.angle(t, middle))) for t, middle in zip(rows.t.tolist(), middles, strict=True)]
    turns = path.sampler.states[:, rows.index, TURN]
    return bool(np.ptp(angles) < _FLAT and np.ptp(turns, axis=1).max(initial=0.0) < _FLAT)


def _shares(count: int, flat: bool, modes: int) -> FloatArray:
    """Return where a piece is cut into panels of 1/count, from 0 to 1; between the ends longer ones will do if flat.

    So many are needed where a beam is pulled taut: it then bends near its ends only, and each panel may be twice as
    long as the one before it, up to a quarter of the piece.
    """
    if count <= _MANY or not flat:
        return np.linspace(0.0, 1.0, count + 1)
    near = (2.0 ** np.arange(int(np.log2(0.25 * count + 1)) + 1) - 1.0) / count
    middle = np.linspace(near[-1], 1.0 - near[-1], modes // 2 + 3)
    return np.concatenate([near[:-1], middle, 1.0 - near[-2::-1]])


def panels(path: Path, name: str, modes: int) -> Panels:
    """Return where a beam is sampled, and its basis there, for so many modes of the network."""
    layout = path.layout
    section, fitted = layout.network.beams[name].section, layout.fits[name]
    cuts = _cuts(path, list(layout.network.beams).index(name), modes)
    degree = next(degree for most, degree in _DEGREES if len(cuts) <= most)
    places, weights, up_to, shapes, slopes, steps = _reference(degree)
    count, per = len(cuts), len(places)
    rotations = count - 1 + count * (degree - 1)
    straining = count * _strains(degree)
    size = ENDS + rotations + straining * (int(section.axial) + int(section.shear))
    basis = {key: np.zeros((count * per, size)) for key in ("turn", "bend", "stretch", "slide")}
    rows: dict[str, list[Any]] = {
        key: [] for key in ("t", "weight", "angle", "rigidity", "pull", "slip", "area_mass", "turn_mass")
    }
    run = np.zeros((count * per, count * per))
    for k, (left, right, middle, inside) in enumerate(cuts):
        here = slice(k * per, (k + 1) * per)
        t, half = 0.5 * (left + right) + 0.5 * (right - left) * places, 0.5 * (right - left)
        speed = np.real(fitted.speed(t, middle)) / layout.scales.length * np.ones(per)
        run[here, here] = up_to * (half * speed)
        run[(k + 1) * per :, here] = weights * half * speed
        ends = (_FIRST if k == 0 else ENDS + k - 1, _LAST if k == count - 1 else ENDS + k)
        first = ENDS + count - 1 + k * (degree - 1)
        columns = [*ends, *range(first, first + degree - 1)]
        basis["turn"][here, columns] = shapes
        rising = np.hstack([np.tile([-0.5, 0.5], (per, 1)), slopes])
        basis["bend"][here, columns] = rising / (half * speed)[:, None]
        at = ENDS + rotations + k * _strains(degree)
        for key, counts in (("stretch", section.axial), ("slide", section.shear)):
            if counts:
                basis[key][here, at : at + _strains(degree)] = steps[:, : _strains(degree)]
                at += straining
        place = np.real(fitted.arc(t))
        _sample(rows, layout, section, (t, place, inside))
        rows["weight"].append(weights * half * speed)
        rows["angle"].append(np.real(fitted.angle(t, middle)) * np.ones(per))
    values = {key: np.concatenate(parts) for key, parts in rows.items()}
    return _scaled(Panels(run=run, **basis, **values))


def _sample(rows: dict[str, list[Any]], layout: Any, section: Any, where: tuple[FloatArray, FloatArray, float]) -> None:
    """Add the properties of the section at places of a panel."""
    t, place, inside = where
    bending, axial, shear = section.rigidities(place, inside)
    thick = section.thickness_at(place, inside)
    scales = layout.scales
    rows["t"].append(t)
    rows["rigidity"].append(bending / scales.rigidity)
    rows["pull"].append(axial * scales.force)
    rows["slip"].append(shear * scales.force)
    rows["area_mass"].append(section.width * thick)
    rows["turn_mass"].append(section.width * thick**3 / 12)


def _scaled(given: Panels) -> Panels:
    """Return the basis with inner unknowns of equal elastic energy: stiff ones are then as well conditioned as soft."""
    energy = np.einsum("n,nk,nk->k", given.weight * given.rigidity, given.bend, given.bend)
    for values, compliance in ((given.stretch, given.pull), (given.slide, given.slip)):
        if values.any():
            energy += np.einsum("n,nk,nk->k", given.weight / compliance, values, values)
    size = np.ones(len(energy))
    size[ENDS:] = 1.0 / np.sqrt(energy[ENDS:])
    return replace(given, **{key: getattr(given, key) * size for key in ("turn", "bend", "stretch", "slide")})


def states_at(path: Path, beam: int, given: Panels, points: Any) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the angle of the sections, and the force along and across them, at the places of a beam: (points, n)."""
    sampler = path.sampler
    rows = sampler.rows(beam)
    start = np.searchsorted(rows.t, given.t, side="right") - 1
    count, places = len(points), len(given.t)
    found = sampler.at(beam, rows, np.tile(start, count), np.tile(given.t, count), np.repeat(points, places))
    found = found.reshape(count, places, -1)
    angle = given.angle + found[:, :, TURN]
    c, s, h, v = np.cos(angle), np.sin(angle), found[:, :, H], found[:, :, V]
    return angle, h * c + v * s, v * c - h * s


def quadratic(
    given: Panels, state: tuple[FloatArray, FloatArray, FloatArray], moves: FloatArray, masses: tuple[float, float]
) -> Quadratic:
    """Return the second variations of the energies of a beam.

    Parameters
    ----------
    given : Panels
        Its basis.
    state : three (points, n) arrays
        Angle, normal and shear force at its places.
    moves : (points, 2, 8) array
        Motion of the first section, by the degrees of freedom at the attachments.
    masses : (float, float)
        Density for the motion of the sections [kg/m^3], and for their rotation.
    """
    angle, normal, shear = state
    c, s = np.cos(angle), np.sin(angle)
    along, across = 1.0 + given.pull * normal, given.slip * shear
    pace = np.empty((*angle.shape, 2, given.unknowns))
    for axis, (by_turn, by_stretch, by_slide) in enumerate(
        ((-along * s - across * c, c, -s), (along * c - across * s, s, c))
    ):
        pace[:, :, axis] = by_turn[..., None] * given.turn
        pace[:, :, axis] += by_stretch[..., None] * given.stretch + by_slide[..., None] * given.slide
    move = np.einsum("mn,pnak->pmak", given.run, pace, optimize=True)
    move[:, :, :, :ENDS] += moves[:, None]
    gap = np.einsum("n,pnak->pak", given.weight, pace)
    gap[:, :, :ENDS] += moves
    return Quadratic(_stiffness(given, normal, shear), _mass(given, move, masses), gap)


def _stiffness(given: Panels, normal: FloatArray, shear: FloatArray) -> FloatArray:
    """Return the elastic energy's second variation with that of the work of the section forces, (points, n, n).

    With t the tangent of the centre line and n the section force the latter is - n . (second variation of t):
    (n . t) by the rotation twice, - 2 Q by rotation and stretch, 2 N by rotation and shear.
    """
    w, turn = given.weight, given.turn
    fixed = np.einsum("n,nj,nk->jk", w * given.rigidity, given.bend, given.bend, optimize=True)
    tension = (1.0 + given.pull * normal) * normal + given.slip * shear * shear
    whole = np.einsum("pn,nj,nk->pjk", w * tension, turn, turn, optimize=True)
    for values, compliance, force in ((given.stretch, given.pull, -shear), (given.slide, given.slip, normal)):
        if not values.any():
            continue
        fixed = fixed + np.einsum("n,nj,nk->jk", w / compliance, values, values, optimize=True)
        mixed = np.einsum("pn,nj,nk->pjk", w * force, turn, values, optimize=True)
        whole += mixed + mixed.transpose(0, 2, 1)
    return np.asarray(whole + fixed)


def _mass(given: Panels, move: FloatArray, masses: tuple[float, float]) -> FloatArray:
    """Return the kinetic energy's second variation, (points, n, n), of motions (points, places, 2, n)."""
    density, turning = masses
    shares = np.sqrt(given.weight * given.area_mass * density)
    flat = (shares[:, None, None] * move).reshape(len(move), -1, given.unknowns)
    whole = flat.transpose(0, 2, 1) @ flat
    if turning:
        own = np.sqrt(given.weight * given.turn_mass * turning)[:, None] * given.turn
        whole = whole + own.T @ own
    return np.asarray(whole)


__all__ = ["ENDS", "Panels", "Quadratic", "panels", "quadratic", "states_at"]
