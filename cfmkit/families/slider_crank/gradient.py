"""Exact derivatives by the springs' rates: efforts and energies are linear in them.

A largest or smallest value changes with the rate as the value does in its place; the place
itself moves, but that is of second order.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cfmkit.families.refusals import CannotBuild
from cfmkit.families.slider_crank.build import assemble, resolve
from cfmkit.families.slider_crank.model import RATES, efforts_inside, reference_motion, solve, window_of

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from cfmkit.arrays import FloatArray
    from cfmkit.families.slider_crank.model import Solution
    from cfmkit.families.slider_crank.spec import SliderCrankSpec


def gradient(spec: SliderCrankSpec, paths: Sequence[str]) -> dict[str, dict[str, float]]:
    """Return derivatives [SI] of metrics over the window of the analysis by the rates of springs of one leg.

    Parameters
    ----------
    spec : SliderCrankSpec
        The nominal mechanism.
    paths : sequence of str
        Those that are no rate of a spring are left out.
    """
    if spec.fidelity != "prb":
        return {}
    try:
        spec = resolve(spec)
        solution, short = solve(spec, assemble(spec))
    except CannotBuild:
        return {}
    if short or not solution.assembly.rates.any():
        return {}
    known = {path: RATES[path] for path in paths if path in RATES}
    legs = spec.mechanism.legs
    slopes = dict(_slopes(spec, solution))
    return {name: {path: legs * float(by[row]) for path, row in known.items()} for name, by in slopes.items()}


def _slopes(spec: SliderCrankSpec, solution: Solution) -> Iterator[tuple[str, FloatArray]]:
    """Yield each metric with its derivatives by the four total rates."""
    drive, assembly = solution.assembly.drive, solution.assembly
    unit = efforts_inside(assembly, solution.motion, solution.units, window_of(spec, assembly))
    effort = assembly.rates @ unit
    sign = -1.0 if effort.mean() < 0 else 1.0
    high, low = unit[:, int(np.argmax(sign * effort))], unit[:, int(np.argmin(sign * effort))]
    top, bottom = float(assembly.rates @ high), float(assembly.rates @ low)
    yield f"{drive}_mean", unit.mean(axis=1)
    yield f"{drive}_max", high if sign > 0 else low
    yield f"{drive}_min", low if sign > 0 else high
    if top != 0.0:
        yield f"{drive}_ripple", (bottom * high / top - low) / top
    if top + bottom != 0.0:
        yield "half_band", 2.0 * (bottom * high - top * low) / (top + bottom) ** 2
    energy = 0.5 * solution.units.turn**2
    yield "energy_max", energy[:, int(np.argmax(assembly.rates @ energy))]
    reference = reference_motion(spec, assembly)
    if solution.character.low <= reference <= solution.character.high:
        yield f"reference_{drive}", assembly.units(np.array([reference])).effort[:, 0]
    if drive == "torque":
        at = assembly.units(np.array([assembly.stretched]))
        yield "stretched_torque", at.effort[:, 0]
        yield "stretched_stiffness", at.stiffness[:, 0]
