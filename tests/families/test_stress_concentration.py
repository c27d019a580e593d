"""Stress of fillets over that of beams: handbook factors, nominal stresses in closed form, mirror images, no value."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest
from shoulder_fillets import handbook

import cfmkit
from cfmkit.arrays import read_only
from cfmkit.elastica import CLAMPED_SUPPORT, Beam, Displacement, Network, Node, Path, Section, slider_support
from cfmkit.families.fem_results import (
    FilletRow,
    SolvedBeams,
    both_images,
    fillet_table,
    largest_concentration,
    nominal_stresses,
    with_steps,
)
from cfmkit.solid import FilletArc

if TYPE_CHECKING:
    from cfmkit.results import Result

SHOULDER = """
cfmkit: 1
family: beam
name: shoulder
mechanism:
  material: {youngs_modulus: 200 GPa, poisson_ratio: 0.3}
  thickness: [[0, 2 mm], [0.4, 2 mm], [0.4, 1 mm], [1, 1 mm]]
  width: 1 mm
  nodes:
    root: {at: [0 mm, 0 mm], support: clamped}
    tip: {at: [15 mm, 0 mm]}
  beams:
    bar: {start: root, end: tip}
  drive: {kind: rotation, node: tip}
  part: {fillet: 0.3 mm}
analysis: {travel: 1 deg, points: 11, fidelity: solid, solid: {poses: 3}}
"""
PULLED = {
    "mechanism.drive": {"kind": "displacement", "node": "tip", "direction": "0 deg"},
    "analysis.travel": "0.01 mm",
}
MODULUS, WIDTH, STIFF, SLENDER = 200e9, 1e-3, (6e-3, 2e-3), (9e-3, 1e-3)  # lengths and thicknesses


def shoulder(load: str, **keys: object) -> Result:
    spec = cfmkit.loads(SHOULDER).replace({f"mechanism.part.{name}": value for name, value in keys.items()})
    return cfmkit.analyze(spec.replace(PULLED) if load == "tension" else spec)


def nominal(load: str) -> float:
    """Return the stress of the slender part in closed form [MPa]."""
    if load == "tension":
        force = 0.01e-3 / sum(length / (MODULUS * WIDTH * thick) for length, thick in (STIFF, SLENDER))
        return 1e-6 * force / (WIDTH * SLENDER[1])
    moment = math.radians(1.0) / sum(length * 12 / (MODULUS * WIDTH * thick**3) for length, thick in (STIFF, SLENDER))
    return 1e-6 * 6 * moment / (WIDTH * SLENDER[1] ** 2)


@pytest.mark.parametrize("load", ["bending", "tension"])
@pytest.mark.parametrize(
    "radius", [0.3, *(pytest.param(value, marks=pytest.mark.slow) for value in (0.1, 0.2))], ids="{} mm".format
)
def test_the_stress_concentration_of_a_shoulder_is_the_handbooks(load, radius):
    """Within 5 %, which is how well the formula follows its charts."""
    result = shoulder(load, fillet=f"{radius} mm")
    table = result.tables["fillets"]()
    at_step = table["x"] > 3.0
    assert at_step.sum() == 2
    assert table["stress_concentration"][at_step] == pytest.approx(handbook(load, 2.0, 1.0, radius), rel=0.05)
    assert table["nominal_stress"][at_step] == pytest.approx(nominal(load), rel=1e-3)
    assert table["stress_concentration"] == pytest.approx(table["max_stress"] / table["nominal_stress"], rel=1e-12)
    assert result.values["stress_concentration_max"].value == table["stress_concentration"].max()


REACH, RISE, THICK = 24.6e-3, 3.3e-3, 0.5e-3


def leaf(**shuttle: bool) -> Network:
    section = Section(2e9, 10e-3, THICK, shear=True)
    nodes = {"wall": Node(0, 0, CLAMPED_SUPPORT), "shuttle": Node(REACH, RISE, slider_support(0.5 * np.pi, **shuttle))}
    return Network(nodes, {"leaf": Beam("wall", "shuttle", section)})


def pushed(travel: np.ndarray) -> Displacement:
    return Displacement("shuttle", -0.5 * np.pi, travel)


def fillet(place: float, side: float, stress: float = 1.0, off: float = 0.0) -> FilletRow:
    """Return a fillet that ends at a place along the leaf, on its left (1) or right edge (-1), or beside that."""
    way = np.array([REACH, RISE]) / np.hypot(REACH, RISE)
    end = np.array([REACH, RISE]) * place + side * (0.5 * THICK + off) * np.array([-way[1], way[0]])
    return FilletRow("leaf", FilletArc(0, end, 1e-3, read_only([end, end + 5e-3])), stress, 0.0)


@pytest.fixture(scope="module")
def buckled() -> tuple[Path, ...]:
    return tuple(both_images(leaf(), pushed, np.array([2e-3])))


def reported(paths: tuple[Path, ...], *rows: FilletRow, travel: float = 2e-3) -> np.ndarray:
    return nominal_stresses(rows, np.full(len(rows), travel), lambda _travel: paths, lambda points: points)


def test_the_outer_fibres_of_a_section_have_the_axial_stress_less_and_more_the_bending_stress(buckled):
    path = buckled[0]
    point = int(path.at_requested[np.abs(path.drive[path.at_requested] - 2e-3).argmin()])
    found = path.sections("leaf")
    stress = reported((path,), fillet(1e-9, 1.0), fillet(1e-9, -1.0))
    assert stress.mean() == pytest.approx(found.axial_stress[point, 0], rel=1e-6)
    assert 0.5 * np.diff(stress) == pytest.approx(found.bending_stress[point, 0], rel=1e-6)


@pytest.fixture(scope="module")
def cantilever() -> SolvedBeams:
    """A bar of 20 mm whose tip is pushed down by 0.01 mm."""
    network = Network(
        {"root": Node(0, 0, CLAMPED_SUPPORT), "tip": Node(20e-3, 0)},
        {"bar": Beam("root", "tip", Section(2e9, 1e-2, 1e-3))},
    )
    (path,) = both_images(network, lambda travel: Displacement("tip", -0.5 * np.pi, travel), np.array([1e-5]))
    return SolvedBeams(path)


def test_the_upper_edge_of_a_cantilever_that_is_pushed_down_is_stretched(cantilever):
    root = 3 * 2e9 * 0.5e-3 * 1e-5 / 20e-3**2  # 3 E c u / L^2
    assert cantilever.evaluate_stress(np.array([[1e-9, 0.5e-3]]), 1e-5) == pytest.approx(root, rel=1e-3)
    assert cantilever.evaluate_stress(np.array([[5e-3, -0.5e-3]]), 1e-5) == pytest.approx(-0.75 * root, rel=1e-3)
    both = np.array([[5e-3, -0.5e-3], [4e-3, -0.5e-3]])  # ends on two sections: the more stressed one counts
    assert cantilever.evaluate_stress(both, 1e-5) == pytest.approx(-0.8 * root, rel=1e-3)


def test_below_a_tenth_of_the_largest_stress_there_is_no_nominal_one(cantilever):
    assert cantilever.evaluate_stress(np.array([[17.9e-3, 0.5e-3]]), 1e-5) > 0.0
    assert math.isnan(cantilever.evaluate_stress(np.array([[18.1e-3, 0.5e-3]]), 1e-5))


def test_of_two_mirror_images_that_counts_whose_stresses_have_the_signs_of_the_solid(buckled):
    assert len(buckled) == 2
    one, other = (reported((path,), fillet(0.02, 1.0), fillet(0.98, 1.0)) for path in buckled)
    assert (one * other < 0).any()  # the leaf bends into an S or its mirror image
    for stress in (one, other):
        rows = fillet(0.02, 1.0, 1.3 * stress[0]), fillet(0.98, 1.0, 1.2 * stress[1])
        assert reported(buckled, *rows).tolist() == stress.tolist()


def test_without_a_bifurcation_there_is_one_path_and_travels_of_both_signs_have_their_own():
    paths = lambda travel: tuple(both_images(leaf(), pushed, travel))  # noqa: E731
    assert len(paths(np.array([1e-4]))) == 1
    rows = (fillet(0.02, 1.0), fillet(0.02, 1.0))
    found = nominal_stresses(rows, np.array([1e-6, -1e-6]), paths, lambda points: points)
    assert found[0] == pytest.approx(-found[1], rel=0.01)


def test_a_fillet_off_its_beam_or_beyond_the_path_has_no_nominal_stress(buckled):
    assert np.isnan(reported(buckled, fillet(0.02, 1.0, off=0.1e-3))).all()
    assert np.isnan(reported(buckled, fillet(1.1, 1.0))).all()
    assert np.isnan(reported(buckled, fillet(0.02, 1.0), travel=3e-3)).all()
    assert np.isnan(reported(buckled, fillet(0.02, 1.0), travel=0.0)).all()


def test_a_ratio_without_nominal_stress_is_an_empty_cell_and_does_not_count_for_the_largest():
    rows = [
        FilletRow("a", fillet(0.1, 1.0).arc, -3e6, 1e-3),
        FilletRow("b", fillet(0.2, 1.0).arc, -3e6, 1e-3, None, -2e6),
    ]
    assert fillet_table(rows)["stress_concentration"].tolist() == pytest.approx([math.nan, 1.5], nan_ok=True)
    assert fillet_table(rows)["max_stress"].tolist() == [3.0, 3.0]
    assert largest_concentration(rows)["stress_concentration_max"].value == 1.5
    none = largest_concentration(rows[:1])["stress_concentration_max"]
    assert (none.value, none.reason) == (None, "beams have no stress at any fillet")


@pytest.mark.parametrize("config", ["beam_williams_toggle", "vcfm_u_shape", "slider_crank_strip"])
def test_of_beams_the_page_says_that_only_the_solid_has_a_stress_concentration(config):
    result = cfmkit.analyze(cfmkit.load(f"configs/{config}.yaml", ["analysis.points=21"]))
    found = result.values["stress_concentration_max"]
    assert (found.value, found.reason) == (None, "only the model of the part as a solid has it")


def test_travels_that_are_asked_for_are_each_solved_once_with_steps_from_rest_on():
    found = with_steps(np.array([-3e-3, -1e-3, -1e-3 * (1 + 1e-12), -3e-3]))
    assert (np.diff(found) < 0).all()
    assert found[-1] == -3e-3
    assert np.abs(found + 1e-3).min() < 1e-14
    assert 0.0 not in found
    assert len(found) == 41
