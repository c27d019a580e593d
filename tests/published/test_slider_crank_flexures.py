"""The flexures and the tapered strip of Bilancia et al. 2019 (SMASIS2019-5519), Tables 2 and 3, as exact beams.

Reference values: geometrically exact shooting with shear (k = 5/6, nu = 0.35) and stretching, converged below 4e-6,
and OpenSees' corotational elements without shear where so named. The paper's figures are not among them.
"""

from __future__ import annotations

import numpy as np
import pytest
from flexure_support import (
    ABS,
    LINKAGE,
    MM,
    RATES,
    TABLE_2,
    UNLOADED,
    corners,
    lumped_chain,
    strip_chain,
)
from scipy.optimize import brentq

from cfmkit.families.slider_crank import curves_along_slider
from cfmkit.families.slider_crank.printed import Chain, Elasticity, Flexure, PressingEnd, rotations

STRETCHED = LINKAGE.stretched_angle
DOWN = 2 * STRETCHED - UNLOADED


def force(chain: Chain, travel: list[float], side: int = 0) -> np.ndarray:
    found = chain.press(np.array(travel) * MM, side)
    assert found.ending is PressingEnd.COMPLETE, found.message
    return found.force


def stress(chain: Chain, travel: list[float], side: int = 0) -> np.ndarray:
    path = chain.press(np.array(travel) * MM, side).path
    return path.peak_stress().value[path.at_requested] / 1e6


def stroke(chain: Chain, side: int = 0, limit: float = 42.5) -> float:
    """Return the travel at which the stress limit is reached [mm]."""
    return brentq(lambda d: float(stress(chain, [d], side)[-1]) - limit, 2.0, 40.0, xtol=1e-9)


# --- Table 2 and eq. 12 -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("flexure", "rate", "turn"), [(0, 25.764775, 0.561674), (1, 32.206848, 0.531250)])
def test_table_2_does_not_have_the_rates_of_table_1(flexure: int, rate: float, turn: float) -> None:
    """A misprint by omission: Table 2 is 9 % softer than eq. 12 asks for, beyond its rounding."""
    part = TABLE_2[flexure]
    assert part.rate(1.8e9) * 1e3 == pytest.approx(rate, abs=5e-7)
    assert part.rotation(1.8e9, 42.5e6) == pytest.approx(turn, abs=5e-7)
    assert part.rate(1.8e9) / RATES[flexure] == pytest.approx(0.9103, abs=1e-4)


def test_stroke_of_table_2_by_pure_bending() -> None:
    allowed = np.array([[part.rotation(1.8e9, 42.5e6)] for part in TABLE_2])
    turned = np.abs(rotations(LINKAGE, UNLOADED, np.array([4.8265, 4.8275]) * MM)) / allowed
    assert turned.argmax(axis=0).tolist() == [1, 1]
    assert turned[1, 0] < 1.0 < turned[1, 1]


CORRECTION = [
    (1, 1.0087), (2, 1.0175), (4, 1.0353), (6, 1.0536), (8, 1.0722), (10.8, 1.0988), (14, 1.1299), (18, 1.1696),
    (22, 1.2097),
]  # fmt: skip


@pytest.mark.parametrize(("length", "factor"), CORRECTION)
def test_flexures_of_finite_length_are_stiffer_than_springs(length: float, factor: float) -> None:
    """c(L) = force of the beams over that of the springs, straight start, 0.1 mm of travel; known to 3e-4."""
    parts = []
    for rate in RATES:
        thickness = (12 * rate * length * MM / (1.8e9 * 2.73)) ** 0.25
        parts.append(Flexure(length * MM, thickness, 2.73 * thickness))
    beams = force(lumped_chain(STRETCHED, parts), [0.1])
    springs = RATES @ curves_along_slider(LINKAGE, STRETCHED, 1, np.array([0.1 * MM])).effort[:3]
    assert float(beams[0] / springs[0]) == pytest.approx(factor, abs=3e-4)


def test_correction_explains_table_2() -> None:
    """1/c(10.8 mm) is the factor between Table 2 and eq. 12: the flexures were re-scaled without a word."""
    assert 1 / dict(CORRECTION)[10.8] == pytest.approx(0.9101, abs=5e-5)
    assert TABLE_2[0].rate(1.8e9) / RATES[0] == pytest.approx(1 / dict(CORRECTION)[10.8], abs=4e-4)


# --- the lumped mechanism -----------------------------------------------------------------------------------------

LUMPED = np.array(
    [
        # travel, force for 0.542 rad, force from straight, stress for 0.542 rad
        [0.1, 1.452154, 1.5119022, 6.53],
        [1, 1.494400, 1.5119936, 21.17],
        [2, 1.5001736, 1.5125635, 29.87],
        [3, 1.5031366, 1.5132387, 36.53],
        [4, 1.505207, 1.5139510, 42.15],
        [5, 1.5068599, 1.5146737, 47.09],
        [10, 1.5125769, 1.5180872, 66.48],
        [20, 1.5186519, 1.5225115, 93.83],
        [30, 1.519310, 1.5224042, 114.64],
    ]
)


def test_lumped_mechanism_force_and_stress() -> None:
    """Forces to 3e-6, four of them as a second program gave them converged; stresses to 0.015 %.

    The first program's steps were a little coarse: 42.15 MPa is 42.145 here and by corotational elements.
    """
    travel = LUMPED[:, 0].tolist()
    np.testing.assert_allclose(force(lumped_chain(), travel), LUMPED[:, 1], atol=3e-6)
    np.testing.assert_allclose(force(lumped_chain(STRETCHED), travel), LUMPED[:, 2], atol=3e-6)
    np.testing.assert_allclose(stress(lumped_chain(), travel), LUMPED[:, 3], atol=6e-3)


@pytest.mark.parametrize(("unloaded", "travel"), [(UNLOADED, 4.069), (STRETCHED, 4.020)])
def test_lumped_mechanism_stroke(unloaded: float, travel: float) -> None:
    """The paper says 3 to 4 mm. The stresses of the reference are known to 0.015 %, its strokes to 1 um."""
    assert stroke(lumped_chain(unloaded)) == pytest.approx(travel, abs=1.1e-3)


def test_lumped_mechanism_agrees_with_its_springs() -> None:
    """Table 2's beams against Table 1's springs, straight start: 0.03 % at the start, 0.8 % at 35 mm."""
    travel = np.array([0.1, 35.0])
    springs = RATES @ curves_along_slider(LINKAGE, STRETCHED, 1, travel * MM).effort[:3]
    np.testing.assert_allclose(
        np.abs(force(lumped_chain(STRETCHED), travel.tolist()) / springs - 1), [0, 8e-3], atol=5e-4
    )


def test_kink_kept_inside_the_middle_flexure_is_another_part() -> None:
    """The flexure at the crank pin is the chord across the kink: with the kink kept in it 0.1 mm gives 1.44908 N."""
    straight = force(lumped_chain(), [0.1])[0]
    assert straight == pytest.approx(1.452154, abs=3e-6)
    assert straight - 1.44908 == pytest.approx(3.07e-3, abs=5e-5)


# --- Table 3 ------------------------------------------------------------------------------------------------------

TABLE_3 = np.array(
    [
        [1, 1.80159, 1.10362, 10.717],
        [2, 1.80530, 1.12062, 15.132],
        [5, 1.80659, 1.16045, 23.844],
        [10, 1.80457, 1.22131, 33.642],
        [15, 1.80028, 1.28223, 41.145],
        [18, 1.79653, 1.31953, 45.035],
        [22, 1.78992, 1.37044, 49.726],
        [25, 1.78362, 1.40959, 52.948],
        [30, 1.77025, 1.47683, 57.865],
    ]
)


def test_corners_of_the_strip() -> None:
    points = np.array([[-4.626065, -2.785592], [4.626065, 2.785592], [41.634585, 25.070328], [50.894890, 30.627889]])
    last = np.array([[95.365613, 57.228031], [104.634094, 62.771969]])
    np.testing.assert_allclose(corners() / MM, np.concatenate([points, last]), atol=6e-7)


def test_table_3_as_it_stands() -> None:
    found = strip_chain().press(TABLE_3[:, 0] * MM)
    path = found.path
    np.testing.assert_allclose(found.force, TABLE_3[:, 1], atol=6e-6)
    np.testing.assert_allclose(-path.reaction("slider")[path.at_requested, 1], TABLE_3[:, 2], atol=6e-6)
    peak = path.peak_stress()
    np.testing.assert_allclose(peak.value[path.at_requested] / 1e6, TABLE_3[:, 3], atol=1.1e-3)
    np.testing.assert_allclose(peak.place[path.at_requested] * 127.41903, 63.0936, atol=1e-3)  # p6, central flexure


def test_table_3_gives_1_8_newton_and_not_1_5() -> None:
    """The paper's level is not reproduced by its own data: 20 % more, for reasons that are not known."""
    values = force(strip_chain(), list(range(2, 31)))
    assert values.mean() == pytest.approx(1.7953, abs=5e-5)
    assert values.mean() / 1.5 == pytest.approx(1.197, abs=5e-4)
    assert np.abs(values / values.mean() - 1).max() < 0.015


@pytest.mark.parametrize(
    ("material", "rms"), [(ABS, 0.29468), (Elasticity(1500e6, 0.35, 42.5e6), 0.010976)], ids=["1800", "1500"]
)
def test_table_3_error_of_the_paper_s_objective(material: Elasticity, rms: float) -> None:
    """e_F at 3, 6, ..., 30 mm; a modulus of 1500 MPa would fit the level, and nothing says that it was used."""
    values = force(strip_chain(material=material), list(range(3, 31, 3)))
    assert np.sqrt(np.mean((values - 1.5) ** 2)) == pytest.approx(rms, abs=6e-6)


def test_table_3_stroke_is_16_millimetres() -> None:
    assert stroke(strip_chain()) == pytest.approx(16.013, abs=6e-4)


def test_table_3_on_the_other_branch() -> None:
    """The same chain, bent to the side to which its kink does not lead."""
    chain = strip_chain()
    assert force(chain, list(range(2, 31)), side=-1).mean() == pytest.approx(1.9015, abs=5e-5)
    np.testing.assert_allclose(stress(chain, [18, 22], -1), [47.14, 52.61], atol=6e-3)
    assert stroke(chain, -1) == pytest.approx(14.85, abs=6e-3)


@pytest.mark.parametrize(
    ("changes", "mean", "at_18", "at_22", "reach"),
    [
        ({"material": Elasticity(1500e6, 0.35)}, 1.4962, 37.53, 41.44, 23.16),
        ({"width": 4.294 * MM}, 1.500, 45.03, 49.73, 16.0),
        ({"points": corners(before=(1.0, 0.5, 0.0))}, 1.541, 40.14, 44.32, 20.2),
        ({"points": corners(before=(0.0, 0.5, 1.0))}, 2.120, 51.0, 56.4, 12.4),
    ],
    ids=["E-1500", "B-4.294", "outward", "inward"],
)
def test_what_else_would_give_the_paper_s_level(
    changes: dict[str, object], mean: float, at_18: float, at_22: float, reach: float
) -> None:
    chain = strip_chain(**changes)  # type: ignore[arg-type]
    assert force(chain, list(range(2, 31))).mean() == pytest.approx(mean, abs=6e-4)
    np.testing.assert_allclose(stress(chain, [18, 22]), [at_18, at_22], atol=6e-2)
    assert stroke(chain) == pytest.approx(reach, abs=6e-2)


# --- the uniform strip --------------------------------------------------------------------------------------------


def test_uniform_strip_beats_the_tapered_one() -> None:
    """0.97721 mm throughout: the force within -1.11/+0.40 % from 1 to 30 mm, and twice the stroke of Table 3."""
    chain = strip_chain(0.97721 * MM)
    expected = [1.48337, 1.49751, 1.50361, 1.50558, 1.48972]
    np.testing.assert_allclose(force(chain, [1, 5, 10, 18, 30]), expected, atol=2e-5)  # h is known to 5 digits
    np.testing.assert_allclose(stress(chain, [18, 30]), [30.8, 39.89], atol=6e-3)
    assert stroke(chain) == pytest.approx(34.0, abs=6e-2)
    values = force(chain, list(range(1, 31)))
    assert values.min() / 1.5 - 1 == pytest.approx(-0.0111, abs=6e-5)
    assert values.max() / 1.5 - 1 == pytest.approx(0.0040, abs=6e-5)
