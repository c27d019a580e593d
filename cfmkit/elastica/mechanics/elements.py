"""Elements of beams: where beams are cut, how cuts move with contacts, properties at Gauss points (dimensionless).

Beams are cut at marks, at layers of taut ones, at places of contacts. Properties are angle, rigidity, compliances and
arc length, (e, q) each. Most beams have a polynomial angle and one thickness: their tables are made together. The
others' are made for all elements of a smooth part at once.
"""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cfmkit.elastica.mechanics.compiled_module import load_compiled, shape_row
from cfmkit.elastica.mechanics.polynomials import N_EXTRA_POINTS, basis, integrals_to_points, slopes_at_points
from cfmkit.elastica.model.beam_fits import is_plain
from cfmkit.elastica.model.section import Taper
from cfmkit.elastica.model.shapes import Polynomial

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.model.beam import Beam, Fit
    from cfmkit.elastica.model.beam_fits import BeamFits


class MechanicsUnits(NamedTuple):
    """Units of length [m], force [N] and the drive (m, rad or 1)."""

    length: float
    force: float
    drive: float

    @property
    def moment(self) -> float:
        """Unit of moment and energy [N m]."""
        return self.force * self.length


TABLES_AT_POINTS = "angle", "weight", "rigidity", "axial", "shear", "ahead"
SAME_PLACE = 1e-12  # parameters of a shape that differ by less are one


def element_tables(
    fits: Sequence[BeamFits],  # the beams of d networks
    scales: MechanicsUnits,  # units of the tables
    degree: int,  # of the rotation on an element
    # row, cuts: (e,), (e, 2): number of each element's beam, ascending, and the parameters of its shape between which
    # it lies
    row: Any,
    cuts: FloatArray,
) -> dict[str, Any]:
    """Return the tables of the elements between cuts of the beams, one beam after the other: (d, e, q) or (d, e)."""
    beams, bundle, numbers = fits[0].network.beams, fits[0].bundle, [fit.number for fit in fits]
    if not bundle.others:
        return plain_tables(*bundle.rows(numbers), scales, degree, row, cuts)
    wide = any(beam.section.wide for beam in beams.values())
    plain, together, first = [] if wide else bundle.plain, dict[str, Any](), 0
    if plain:
        rows = np.isin(row, plain)
        together = plain_tables(*bundle.rows(numbers), scales, degree, np.searchsorted(plain, row[rows]), cuts[rows])
    parts: list[dict[str, Any]] = []
    for k, name in enumerate(beams):
        between = cuts[row == k]
        if k in plain:
            parts.append({column: values[:, first : first + len(between)] for column, values in together.items()})
            first += len(between)
        else:
            sets = [_smooth_tables(fit.network.beams[name], fit[name], scales, degree, between, wide) for fit in fits]
            parts.append({column: np.array([tables[column] for tables in sets]) for column in sets[0]})
    return {column: np.concatenate([part[column] for part in parts], axis=1) for column in parts[0]}


def plain_tables(
    # coefficients, length, rigidities: (d, b, m), (d, b), (3, d, b): as of `Bundle`, [rad], [m], [N m2], [1/N]
    coefficients: Any,
    length: Any,
    rigidities: Any,
    # scales, degree: as of `element_tables`
    scales: MechanicsUnits,
    degree: int,
    # row, cuts: (e,), (e, 2): number of each element's beam, and the parameters between which it lies
    row: Any,
    cuts: FloatArray,
) -> dict[str, Any]:
    """Return the tables of elements of plain beams of d networks, (d, e, q) each; of one by compiled code."""
    if len(length) == 1 and coefficients.dtype == rigidities.dtype == float and (compiled := load_compiled()):
        table, lengths = np.empty((6, 1, len(row), degree + N_EXTRA_POINTS)), np.empty((1, len(row)))
        given = (np.ascontiguousarray(values, float) for values in (cuts, coefficients, length, rigidities))
        compiled.tables(shape_row(degree)[0], row, *given, table, lengths, scales.length, scales.force)
        return {**dict(zip(TABLES_AT_POINTS, table, strict=True)), "length": lengths}
    rule, force, width = basis(degree), scales.force, cuts[:, 1:] - cuts[:, :1]
    t, c, angle = cuts[:, :1] + width * rule.places, coefficients[..., row, :], 0.0
    for k in reversed(range(c.shape[-1])):
        angle = angle * t + c[..., k, None]
    speed, ones = length[..., row, None] / scales.length * width, np.ones(len(rule.places))
    bending, axial, shear = (values[..., row, None] for values in rigidities)
    return {
        "angle": angle + 0.0 * t,
        "weight": speed * rule.weights,
        "rigidity": bending / (force * scales.length**2) / speed**2 * ones,
        "axial": axial * force * ones,
        "shear": shear * force * ones,
        "ahead": speed * (1 - rule.places),
        "length": speed[..., 0],
    }


def _smooth_tables(
    beam: Beam, fitted: Fit, scales: MechanicsUnits, degree: int, cuts: FloatArray, wide: bool
) -> dict[str, Any]:
    """Return the tables of the elements of a beam, those of one smooth part after the other."""
    parts, middle = list[dict[str, Any]](), 0.5 * (cuts[:, 0] + cuts[:, 1])
    for begin, end in itertools.pairwise(smooth_marks(beam, fitted)):
        inside = cuts[(begin <= middle) & (middle < end)]
        if len(inside):  # else the marks are at one place but for rounding
            parts.append(smooth_tables(beam, fitted, scales, degree, inside, 0.5 * (begin + end), wide))
    return {column: np.concatenate([part[column] for part in parts]) for column in parts[0]}


def smooth_tables(
    beam: Beam, fitted: Fit, scales: MechanicsUnits, degree: int, cuts: FloatArray, inside: float, wide: bool
) -> dict[str, Any]:
    """Return the tables of elements between cuts (..., e, 2) in the smooth part of a beam that holds `inside`."""
    length, force, rule = scales.length, scales.force, basis(degree)
    left, width = cuts[..., :1], cuts[..., 1:] - cuts[..., :1]
    t = left + width * rule.places
    tapers = isinstance(beam.section.thickness, Taper)
    along = (fitted.arc(t), float(np.real(fitted.arc(inside)))) if tapers else (t, inside)
    speed = fitted.speed(t, inside) * width / length + 0.0 * t
    rigidity, axial, shear = beam.section.rigidities(*along)
    angle, whole = fitted.angle(t, inside) + 0.0 * t, speed @ rule.weights
    tables = {
        "angle": angle,
        "weight": speed * rule.weights,
        "rigidity": rigidity / (force * length**2) / speed**2,
        "axial": axial * force + 0.0 * t,
        "shear": shear * force + 0.0 * t,
        "ahead": whole[..., None] - speed @ integrals_to_points(degree).T,
        "length": whole,
    }
    if wide:
        curl, hindrance = beam.section.curling(beam.section.thickness_at(*along))
        tables["rest"] = angle @ slopes_at_points(degree).T
        tables["curl"] = curl / (speed * length) ** 2
        tables["hindrance"] = hindrance + 0.0 * speed
    return tables


def smooth_marks(beam: Beam, fitted: Fit) -> list[float]:
    """Return the parameters between which a beam is smooth."""
    marks = np.real(fitted.course.breaks).tolist()
    if isinstance(beam.section.thickness, Taper):
        stations = [float(np.real(fitted.parameter(float(s)))) for s in np.real(beam.section.stations)]
        marks = sorted({*marks, *stations})
        marks = [mark for k, mark in enumerate(marks) if k == 0 or mark - marks[k - 1] > SAME_PLACE]
    return [0.0, *marks[1:-1], 1.0]


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

    def evaluate(self, places: Any) -> Any:
        """Return where these elements begin and end with contacts at some places (..., k), (..., r, 2)."""
        return self.fixed + np.einsum("rck,...k->...rc", self.shares, places)


def find_cuts(beam: Beam, fits: BeamFits, name: str, pieces: int, tension: Mapping[str, float]) -> list[float]:
    """Return the parameters between which the elements of a beam lie."""
    tautness, little = tension.get(name, 0.0), turns_little(beam)
    if pieces == 1 and tautness <= TAUT_RATIO and little and is_plain(beam):
        return [0.0, 1.0]
    fitted = fits[name]
    count = pieces if little else max(pieces, int(np.ceil(fitted.turn / MAX_TURN)))
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
