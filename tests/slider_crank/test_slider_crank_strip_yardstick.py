"""Designed strips against the strokes that Bilancia et al. 2019 and later searches reached.

Yardstick: nine evenly spaced thicknesses from 0.5 to 2 mm, found with finite differences and a band that was looked at
in eleven points; ABS with 1800 MPa and 42.5 MPa, 1.5 N, the line of the paper's flexures. Here the band is kept
everywhere. Not the thicknesses are compared, but the stroke that a ripple allows.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from flexure_support import ABS, LINKAGE, MM, SHARES, THICKNESS, UNLOADED, WIDTH, corners, strip_chain

from cfmkit import Run
from cfmkit.families.slider_crank.printed.flexures_as_beam_network import Elasticity, joints
from cfmkit.families.slider_crank.printed.flexures_as_beam_network import kink as offset
from cfmkit.families.slider_crank.printed.solution import first_at
from cfmkit.families.slider_crank.printed.sqp_program import Form, StripProgram, StripTask
from cfmkit.families.slider_crank.printed.strip_thickness_search import (
    FoundStrip,
    descend,
    search,
    uniform_for_stroke,
    uniform_thickness,
)
from cfmkit.numerics import SearchEnding

TASK = StripTask(corners(), np.pi, ABS, 1.5, 1 * MM, 20 * MM, 0.01, "stroke", 60 * MM)

YARDSTICK = [
    # width, ripple, stroke of the yardstick, share of it that nine thicknesses reach with the band kept everywhere
    (5.138, 0.01, 38.205, 1.005),
    (5.138, 0.005, 33.909, 0.998),
    (5.138, 0.002, 28.361, 1.004),
    (8.0, 0.01, 46.223, 0.997),
    (8.0, 0.002, 36.041, 1.005),
]


def first_and_slow(rows: list[tuple[float, ...]]) -> list[Any]:
    """Return the first row, and all others marked slow: they prove the same search at other widths and ripples."""
    return [rows[0], *(pytest.param(*row, marks=pytest.mark.slow) for row in rows[1:])]


@cache
def found_for(width: float, ripple: float, nodes: int) -> FoundStrip:
    ranges = np.tile([0.5, 2.0], (nodes, 1))
    return search(replace(TASK, ripple=ripple), Form(nodes, width=width * MM), ranges, 1, Run())


def kept(found: FoundStrip) -> tuple[float, float]:
    """Return largest deviation and stress of a found strip over its stroke, looked at in 150 places."""
    form = found.program.form
    stroke = found.program.stroke(found.descent.z)
    travel = np.linspace(1 * MM, stroke, 150)
    chain = strip_chain(found.values * MM, form.places(found.values, corners()), width=form.width or 0.0)
    pressed = chain.press(travel)
    return float(np.abs(pressed.force / 1.5 - 1).max()), float(pressed.path.peak_stress().value.max())


@pytest.mark.parametrize(("width", "ripple", "stroke", "share"), first_and_slow(YARDSTICK))
def test_nine_thicknesses_come_up_to_the_yardstick(width: float, ripple: float, stroke: float, share: float) -> None:
    """Two rows stay 0.15 and 0.25 % below: the yardstick's strips have half a percent less force than they say."""
    found = found_for(width, ripple, 9)
    assert found.descent.ending is SearchEnding.OPTIMUM
    assert found.program.stroke(found.descent.z) / MM >= share * stroke - 0.06
    deviation, stress = kept(found)
    assert deviation <= ripple + 5e-5
    assert stress <= 42.5e6 * (1 + 5e-5)


@pytest.mark.parametrize(
    ("width", "stroke", "upper", "lower", "stress"),
    first_and_slow(
        [
            (5.138, 38.205, 0.60, -1.49, 42.56),
            (5.138, 33.909, -0.00, -1.05, 42.47),
            (5.138, 28.361, -0.33, -0.76, 42.37),
            (8.0, 46.223, 0.49, -1.68, 42.58),
            (8.0, 36.041, -0.30, -0.79, 42.40),
        ]
    ),
)
def test_nine_thicknesses_beat_the_yardstick_at_its_own_force_band_and_stress(
    width: float, stroke: float, upper: float, lower: float, stress: float
) -> None:
    """The printed strips, pressed exactly, have this band [% of 1.5 N] and stress [MPa]: half a percent too little."""
    level = 1.5 * (1 + (upper + lower) / 200)
    ripple = 1.5 * (upper - lower) / 200 / level
    task = replace(TASK, force=level, ripple=ripple, material=Elasticity(1800e6, 0.35, stress * 1e6))
    found = search(task, Form(9, width=width * MM), np.tile([0.5, 2.0], (9, 1)), 1, Run())
    assert found.descent.ending is SearchEnding.OPTIMUM
    assert found.program.stroke(found.descent.z) / MM > 1.01 * stroke


@pytest.mark.slow
@pytest.mark.parametrize(("width", "ripple", "stroke", "share"), YARDSTICK)
def test_seventeen_thicknesses_beat_the_yardstick(width: float, ripple: float, stroke: float, share: float) -> None:
    found = found_for(width, ripple, 17)
    assert found.program.stroke(found.descent.z) / MM > 1.1 * stroke
    deviation, stress = kept(found)
    assert deviation <= ripple + 5e-5
    assert stress <= 42.5e6 * (1 + 5e-5)


@pytest.mark.slow
def test_one_more_halving_of_the_intervals_beats_the_tightest_row() -> None:
    """Row 3, 0.2 %: 28.361 mm with nine thicknesses, 35.6 mm with seventeen."""
    found = found_for(5.138, 0.002, 17)
    assert found.program.stroke(found.descent.z) / MM == pytest.approx(35.6, abs=0.1)


def test_a_taper_gains_an_eighth_on_the_uniform_strip() -> None:
    """12 % of stroke at 1 % ripple and the same width; its real use is a tight ripple."""
    found = found_for(5.138, 0.01, 9)
    assert found.uniform is not None
    assert found.program.stroke(found.descent.z) / (0.01 * found.uniform.z[-1]) == pytest.approx(1.13, abs=0.01)


# --- one thickness ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("width", "thickness", "stroke"), [(5.138, 0.977, 34.0), (6.0, 0.928, 37.7)])
def test_uniform_strip_of_a_width_and_its_stroke(width: float, thickness: float, stroke: float) -> None:
    """Thicknesses to a thousandth of a millimetre as the level is taken: here the middle of the extremes."""
    assert uniform_thickness(replace(TASK, stroke=30 * MM), width * MM) / MM == pytest.approx(thickness, abs=1.5e-3)
    found = uniform_for_stroke(replace(TASK, stroke=stroke * MM))
    assert found is not None
    assert found[0] / MM == pytest.approx(thickness, abs=1.5e-3)
    assert found[1] / MM == pytest.approx(width, rel=0.011)


def test_uniform_strip_of_eight_millimetres_goes_beyond_forty() -> None:
    thickness = uniform_thickness(replace(TASK, stroke=30 * MM), 8 * MM)
    assert thickness / MM == pytest.approx(0.843, abs=1.5e-3)
    pressed = strip_chain(thickness, width=8 * MM).press(np.array([40 * MM]))
    assert pressed.path.peak_stress().value[pressed.path.at_requested[-1]] < 42.5e6


# --- the paper's 23 variables in its ranges ---------------------------------------------------------------------------

THICKNESSES = [
    (0.85, 1.1), (0.85, 1.1), (0.85, 1.1), (1.2, 1.4), (1.2, 1.4), (0.8, 1.15), (0.8, 1.15), (1.3, 1.6), (1.3, 1.6),
    (0.9, 1.1), (0.9, 1.1), (0.9, 1.1),
]  # fmt: skip
PLACES = [
    (0.125, 0.5), (0.625, 0.875), (0.5, 0.625), (0.75, 0.875), (0.125, 0.375), (0.625, 0.875), (0.375, 0.625),
    (0.75, 0.875), (0.125, 0.375), (0.75, 0.875),
]  # fmt: skip
BOX = np.array([*THICKNESSES, *PLACES, (5.0, 8.0)])
FORM = Form(12, (2,) * 5)
PRINTED = np.concatenate([THICKNESS / MM, np.concatenate(SHARES), [WIDTH / MM]])


@pytest.mark.parametrize(("modulus", "stroke"), first_and_slow([(1800e6, 27.25), (1500e6, 38.6)]))
def test_paper_s_variables_reach_a_longer_stroke_in_their_own_ranges(modulus: float, stroke: float) -> None:
    """Within 1 % and 42.5 MPa; the paper's optimum has 16.0 mm."""
    task = replace(TASK, material=Elasticity(modulus, 0.35, 42.5e6))
    program = StripProgram(task, FORM)
    found = descend(program, np.append(BOX.mean(axis=1), 1.6), np.vstack([BOX, [0.5, 6.0]]))
    assert found.ending is SearchEnding.OPTIMUM
    assert found.feasible
    assert 10 * found.z[-1] >= stroke
    assert 10 * found.z[-1] == pytest.approx(stroke, rel=6e-3)


E_F = replace(TASK, material=Elasticity(1800e6), start=0.0, stroke=30 * MM, goal="rms")


def test_table_3_has_a_fifth_of_its_force_as_error() -> None:
    """e_F of ten points over 30 mm: 0.295 N of 1.5 N."""
    printed = StripProgram(E_F, FORM).state(PRINTED)
    assert printed is not None
    assert np.sqrt(np.mean((printed.force - 1.5) ** 2)) == pytest.approx(0.29468, abs=6e-6)


@pytest.mark.slow
@pytest.mark.parametrize(("steps", "rms"), [(25, 5e-3), (200, 1.04e-3)])
def test_table_3_is_not_the_optimum_of_its_own_objective(steps: int, rms: float) -> None:
    """e_F of ten points over 30 mm without a stress limit: 1.04e-3 N is known to be possible, Table 3 has 0.295 N."""
    program = StripProgram(E_F, FORM)
    found = descend(program, PRINTED, BOX, steps=steps, tolerance=1e-10)
    state = program.state(found.z)
    assert state is not None
    assert np.sqrt(np.mean((state.force - 1.5) ** 2)) <= rms


def test_paper_s_optimum_violates_its_own_stress_limit() -> None:
    """Eq. 15 asks for 42.5 MPa over 30 mm; Table 3 has 57.9 MPa there."""
    pressed = strip_chain().press(np.array([30 * MM]))
    stress = pressed.path.peak_stress().value[pressed.path.at_requested[-1]]
    assert stress / 1e6 == pytest.approx(57.865, abs=1e-3)


# --- run-in -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("unloaded", "kink", "at_95", "at_98"),
    [(UNLOADED, 0.085, 0.08, 0.39), (0.545, 0.25, 0.39, 1.68), (0.55, 0.52, 1.16, 3.63), (0.56, 1.06, 2.85, 6.27)],
)
def test_a_larger_kink_takes_longer_to_the_level(unloaded: float, kink: float, at_95: float, at_98: float) -> None:
    """Uniform strip of 0.977 mm; the level is the mean from 5 to 30 mm."""
    chain = strip_chain(0.977 * MM, unloaded=unloaded)
    travel = np.linspace(0.0, 8.0, 321) * MM
    pressed = chain.press(travel)
    level = chain.press(np.linspace(5.0, 30.0, 101) * MM).force.mean()
    assert offset(joints(LINKAGE, unloaded)) / MM == pytest.approx(kink, abs=0.01)
    for share, expected in ((0.95, at_95), (0.98, at_98)):
        place = first_at(travel, pressed.force, share * level)
        assert place is not None
        assert place / MM == pytest.approx(expected, rel=0.03, abs=0.01)
