"""Properties of elements at their Gauss points: angle, rigidity, compliances, arc length; dimensionless, (e, q) each.

Most beams have a polynomial angle and one thickness: their tables are made together. The others' are made for all
elements of a smooth part at once.
"""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.elastica.mechanics.compiled_module import load_compiled, shape_row
from cfmkit.elastica.mechanics.polynomials import N_EXTRA_POINTS, basis, integrals_to_points, slopes_at_points
from cfmkit.elastica.model.section import Taper

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.mechanics.units import MechanicsUnits
    from cfmkit.elastica.model.beam import Beam, Fit
    from cfmkit.elastica.model.beam_fits import BeamFits

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
    beams, bundle, numbers = fits[0].network.beams, fits[0].bundle, [own.number for own in fits]
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
            each = [_smooth_tables(own.network.beams[name], own[name], scales, degree, between, wide) for own in fits]
            parts.append({column: np.array([tables[column] for tables in each]) for column in each[0]})
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
    t, own, angle = cuts[:, :1] + width * rule.places, coefficients[..., row, :], 0.0
    for k in reversed(range(own.shape[-1])):
        angle = angle * t + own[..., k, None]
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
        own = cuts[(begin <= middle) & (middle < end)]
        if len(own):  # else the marks are at one place but for rounding
            parts.append(smooth_tables(beam, fitted, scales, degree, own, 0.5 * (begin + end), wide))
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
