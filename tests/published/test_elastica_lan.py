"""The compliant mechanism of Lan, Wang and Chen (2010), Tables 2 to 4, through the beam engine.

Forces are those of the model of the paper (inextensible) with each beam turned and scaled to fit between its rounded
nodes; the table of forces, reactions and stresses was computed by two independent programs to 1e-8. The paper prints
four digits; where it prints a number, it is asserted to what the rounding of its tables allows.
"""

from __future__ import annotations

import numpy as np
import pytest
from lan_2010 import CM, LEG, ROWS, TRAVEL, VALUES, half

import cfmkit.elastica as el

MM = 1e-3
DOWN = -np.pi / 2

SECTION = el.Section(2e9, 10 * MM, 1 * MM, axial=False)


def table_4() -> el.Network:
    section = el.Section(2e9, 6 * MM, 0.4 * MM, axial=False)
    nodes = {
        "n1": el.Node(1 * CM, 0.2 * CM, el.CLAMPED_SUPPORT),
        "n2": el.Node(0.99 * CM, 0.55 * CM),
        "n3": el.Node(0.15 * CM, 0.64 * CM),
        "n4": el.Node(0, 1 * CM, el.slider_support(np.pi / 2)),
    }
    beams = {
        "b1": el.Beam("n1", "n2", section, el.Polynomial((1.6401, 0.9920, -1.5706))),
        "b2": el.Beam("n2", "n3", section, el.Polynomial((3.2380, -0.8791, 0.7358))),
        "b3": el.Beam("n3", "n4", section, el.Polynomial((2.4429, -1.1268, 0.2199))),
    }
    return el.Network(nodes, beams)


@pytest.fixture(scope="module")
def path() -> el.Path:
    return el.trace(half(SECTION), el.Displacement("n5", DOWN, np.append(0.0, TRAVEL)), el.Control(tolerance=1e-9))


def test_table_3_force_at_every_half_millimetre(path: el.Path) -> None:
    assert path.status is el.PathStatus.COMPLETE
    np.testing.assert_allclose(2 * path.effort[path.at_requested][1:], VALUES[:, 1], rtol=0, atol=1.1e-8)
    assert abs(path.effort[0]) < 1e-9


def test_table_3_is_stable_under_displacement_control(path: el.Path) -> None:
    assert path.stable.all()
    assert path.events == ()


@pytest.mark.parametrize(("beam", "v", "h"), [("b1", 2, 5), ("b2", 3, 6), ("b3", 4, 7)])
def test_table_3_forces_of_each_beam(path: el.Path, beam: str, v: int, h: int) -> None:
    force = path.end_force(beam, 1)[path.at_requested][1:]
    np.testing.assert_allclose(-force[:, 1], VALUES[:, v], atol=6e-7)
    np.testing.assert_allclose(force[:, 0], VALUES[:, h], atol=6e-7)


def test_table_3_largest_stress_and_its_place(path: el.Path) -> None:
    peak = path.peak_stress(axial=False)
    keep = path.at_requested[1:]
    np.testing.assert_allclose(peak.value[keep] / 1e6, VALUES[:, 8], atol=6e-7)
    assert peak.beam[keep].tolist() == [row[9] for row in ROWS]
    np.testing.assert_allclose(peak.place[keep], VALUES[:, 9], atol=6e-6)


def test_paper_force_and_stress_at_full_travel() -> None:
    """F_d = 9.736 N and 48.1013 MPa at 13.6 mm: half an ulp of Tables 3's entries is worth 0.005 N and 0.09 MPa."""
    p = el.trace(half(SECTION), el.Displacement("n5", DOWN, [13.6 * MM]), el.Control(tolerance=1e-9))
    assert 2 * p.effort[-1] == pytest.approx(9.739693, abs=6e-7)
    assert 2 * p.effort[-1] == pytest.approx(9.736, abs=3 * 0.0047)
    stress = p.peak_stress(axial=False)
    assert stress.value[-1] / 1e6 == pytest.approx(48.218741, abs=6e-7)
    assert stress.value[-1] / 1e6 == pytest.approx(48.1013, abs=3 * 0.09)
    assert (stress.beam[-1], round(float(stress.place[-1]), 4)) == ("b4", 0.2597)


def test_paper_thinner_beams_with_the_same_rigidity_class() -> None:
    """Figure 9: w = 0.85 mm, t = 16.28 mm; F_d at 16.8 mm, stress 48.10 MPa."""
    p = el.trace(half(el.Section(2e9, 16.28 * MM, 0.85 * MM, axial=False)), el.Displacement("n5", DOWN, [16.8 * MM]))
    assert 2 * p.effort[-1] == pytest.approx(9.983741, abs=2e-6)
    assert p.peak_stress(axial=False).value[-1] / 1e6 == pytest.approx(48.057829, abs=2e-5)


def test_raw_closure_is_prestressed_as_the_rounding_says() -> None:
    lengths = {"b1": 3.404 * CM, "b2": 1.987 * CM, "b3": 2.199 * CM, "b4": 1.959 * CM}
    p = el.trace(half(SECTION, closure="raw", lengths=lengths), el.Displacement("n5", DOWN, [0.0, 13.6 * MM]))
    force = 2 * p.effort[p.at_requested]
    assert force[0] == pytest.approx(0.0360, abs=6e-5)
    assert force[1] == pytest.approx(9.734157, abs=1e-6)


def test_closure_reports_what_it_changed(path: el.Path) -> None:
    assert all(0 < abs(path.fits[name].rotation) < 2e-3 for name in path.fits)
    lengths = {"b1": 3.404 * CM, "b2": 1.987 * CM, "b3": 2.199 * CM, "b4": 1.959 * CM}
    fits = el.trace(half(SECTION, lengths=lengths), el.Displacement("n5", DOWN, [MM])).fits
    np.testing.assert_allclose([fits[n].gap / CM for n in lengths], [0.0006, 0.0004, 0.0004, 0.0009], atol=6e-5)
    assert all(abs(fits[n].scale - 1) < 1e-3 for n in lengths)


def test_a_force_that_stretches_beams_is_smaller_at_first() -> None:
    """Axial strain lowers F(0.5 mm) by 1.53 %, with shear by 2.56 %; F_d rises by 0.14 and 0.06 %."""
    drive = el.Displacement("n5", DOWN, [0.5 * MM, 13.6 * MM])
    rigid = el.trace(half(SECTION), drive).effort
    axial = el.trace(half(el.Section(2e9, 10 * MM, 1 * MM)), drive).effort
    both = el.trace(half(el.Section(2e9, 10 * MM, 1 * MM, shear=True, poisson_ratio=0.35)), drive).effort
    first, last = 1, -1
    assert 100 * (axial[first] / rigid[first] - 1) == pytest.approx(-1.53, abs=0.006)
    assert 100 * (both[first] / rigid[first] - 1) == pytest.approx(-2.56, abs=0.006)
    assert 100 * (axial[last] / rigid[last] - 1) == pytest.approx(0.14, abs=0.006)
    assert 100 * (both[last] / rigid[last] - 1) == pytest.approx(0.06, abs=0.006)


def test_extensible_force_of_an_independent_finite_element_program() -> None:
    """A corotational program, extrapolated from 160 and 320 elements, gives 9.7534534 N at 13.5 mm."""
    p = el.trace(
        half(el.Section(2e9, 10 * MM, 1 * MM)), el.Displacement("n5", DOWN, [13.5 * MM]), el.Control(tolerance=1e-9)
    )
    assert 2 * p.effort[-1] == pytest.approx(9.753453385, abs=2e-8)


def test_table_4_leg_force_and_stress() -> None:
    p = el.trace(table_4(), el.Displacement("n4", DOWN, LEG[:, 0] * MM), el.Control(tolerance=1e-8))
    np.testing.assert_allclose(p.effort[p.at_requested], LEG[:, 1], atol=6e-7)
    np.testing.assert_allclose(p.peak_stress(axial=False).value[p.at_requested] / 1e6, LEG[:, 2], atol=6e-5)
