"""The closed forms on the leaves of Ding, Li and Li (2022), Table I, in mm, N and MPa.

Where the paper's own equations are wrong the right number is asserted, beside what the paper's equation gives. Exact
values: geometrically exact shooting, agreeing with finite elements to 1e-6.
"""

from __future__ import annotations

import numpy as np
import pytest
from vcfm_support import leaf, side

import cfmkit.elastica as el
from cfmkit.families.vcfm import leaves


def printed_diamond_stiffness(strip):
    """Eq. 15 as printed, without the F_1 inside its bracket: one chain, with half of the shear term."""
    bent = 2.0 * strip.reach**3 / (12.0 * strip.bending)
    shear = 12.0 * (1.0 + strip.poisson_ratio) * strip.reach / (5.0 * strip.axial)
    return 1.0 / (bent + shear)


def printed_negative_stiffness(strip):
    """Eq. 17, of one leaf."""
    return 33.0 * strip.bending / strip.length**3


def test_diamond_is_twice_as_stiff_as_the_paper_counts():
    """Eq. 15 as printed gives 1.622122, eq. 19 gives 1.631369, one chain has 1.601138 and the whole diamond 3.2023."""
    assert printed_diamond_stiffness(side()) == pytest.approx(1.622122, abs=5e-7)
    assert leaves.TrussDiamond(side(), 0.5).stiffness == pytest.approx(1.631369, abs=5e-7)
    assert leaves.Diamond(side(), 0.5).stiffness == pytest.approx(1.601138, abs=5e-7)
    assert leaves.Diamond(side()).stiffness == pytest.approx(3.202276, abs=5e-7)


@pytest.mark.parametrize(
    ("size", "chain"),
    [
        ({"length": 26.1525}, 1.4),
        ({"thickness": 1.43390}, 1.4),
    ],
)
def test_what_one_chain_would_need_for_the_papers_positive_stiffness(size, chain):
    assert leaves.Diamond(side(**size), 0.5).stiffness == pytest.approx(chain, rel=1e-5)


def test_diamond_stress_per_compression():
    assert leaves.Diamond(side()).stress(1.0) == pytest.approx(5.2776, abs=5e-5)
    assert leaves.Diamond(side()).stress(11.5) == pytest.approx(60.7, abs=0.05)


@pytest.mark.parametrize(
    ("thickness", "negative", "exact"),
    [(0.6, 0.147679, 0.147642), (0.8, 0.349494, 0.349284), (1.0, 0.681202, 0.680490), (1.2, 1.174151, 1.172321)],
)
def test_negative_stiffness_of_one_leaf(thickness, negative, exact):
    """The exact slopes between 2 and 4 mm are met to 0.16 %; eq. 17 (33 E I/L^3) is 17 % low."""
    found = leaves.negative_stiffness(leaf(thickness))
    assert found == pytest.approx(negative, abs=6e-7)
    assert found == pytest.approx(exact, rel=2e-3)
    assert printed_negative_stiffness(leaf(thickness)) / found == pytest.approx(0.834, abs=0.01)


def test_eq_17_and_the_euler_load():
    strip = leaf()
    assert printed_negative_stiffness(strip) == pytest.approx(0.568408, abs=5e-7)
    assert 4 * np.pi**2 * strip.bending / strip.length**2 == pytest.approx(23.799846, abs=5e-7)
    assert strip.rise == pytest.approx(4.265427, abs=5e-7)


def test_onset_and_exit_of_the_linear_region():
    assert leaves.onset_and_exit(leaf()) == pytest.approx((0.92017, 4.76707), abs=6e-6)
    assert leaves.VBeam(leaf()).linear_range == pytest.approx((0.9096, 4.7705), abs=3e-4)


@pytest.mark.parametrize(("thickness", "first", "last"), [(0.6, 0.291898, 5.383347), (0.8, 0.543216, 5.126420)])
def test_onset_and_exit_are_near_those_of_exact_leaves(thickness, first, last):
    assert leaves.VBeam(leaf(thickness)).linear_range == pytest.approx((first, last), rel=3e-3)


EXACT = {
    0.25: 0.893304, 0.5: 1.588791, 0.75: 2.076449, 1.0: 2.215245, 1.5: 1.879536, 2.0: 1.542101, 2.5: 1.203244,
    3.0: 0.863273, 3.5: 0.522502, 4.0: 0.181246, 4.5: -0.160179, 5.0: -0.364942, 6.0: -0.071857,
}  # fmt: skip


def test_force_of_a_leaf_against_the_exact_curve():
    """Within 0.0022 N where it is buckled, 0.004 N before and 0.0091 N after, up to 6 mm; the peak is 2.27 N."""
    travel, exact = np.array(list(EXACT)), np.array(list(EXACT.values()))
    error = np.abs(leaves.VBeam(leaf()).force(travel) - exact)
    buckled = leaves.VBeam(leaf()).is_buckled(travel)
    assert error[buckled].max() <= 0.0022
    assert error[travel < 0.9].max() <= 0.004
    assert error.max() <= 0.0092


def test_force_of_a_leaf_in_tension():
    force = leaves.VBeam(leaf()).force(-np.array([0.1, 0.2, 0.5, 1.0]))
    assert force == pytest.approx([-0.411976, -0.855246, -2.374869, -5.559783], rel=1e-3)


def test_stress_of_a_buckled_leaf():
    """The exact values (17.584, 20.888, 22.138, 22.19 MPa) are up to 0.5 % lower."""
    strip = leaf()
    found = leaves.VBeam(strip).stress(np.array([2.0, 3.0, 4.0, strip.rise]))
    assert found == pytest.approx([17.66, 20.97, 22.23, 22.28], abs=6e-3)
    assert found == pytest.approx([17.584, 20.888, 22.138, 22.19], rel=5e-3)
    assert strip.youngs_modulus / strip.length**2 * leaves.buckled_stress(
        strip.rise, strip.thickness, 1.0
    ) == pytest.approx(22.2225, abs=5e-5)


def test_truss_law_of_a_leaf_and_its_error():
    """The bar's peak is 36 % above that of the leaf, at twice the travel; its steepest slope is 2.76 times as steep."""
    bar, travel = leaves.TrussLeaf(leaf()), np.linspace(0, 4.3, 430001)
    force = bar.force(travel)
    assert bar.force(1.80) == pytest.approx(3.086970, abs=6e-7)
    assert travel[force.argmax()] == pytest.approx(1.80, abs=5e-3)
    assert force.max() / 2.273927 - 1 == pytest.approx(0.36, abs=5e-3)
    assert bar.force(3.0) / 0.863273 - 1 == pytest.approx(1.51, abs=5e-3)
    assert bar.negative_stiffness == pytest.approx(1.880, abs=5e-4)
    assert 2 * bar.first_stiffness == pytest.approx(7.521, abs=5e-4)


@pytest.mark.parametrize(("radius", "stiffness"), [(2.5, 0.622156), (5.0, 0.441058)])
def test_u_shape_is_softer_than_the_diamond(radius, stiffness):
    strip = side(1.0, degrees=0.0)
    found = leaves.UShape(strip, radius).stiffness
    assert found == pytest.approx(stiffness, abs=5e-7)
    assert found < leaves.Diamond(side(1.0)).stiffness == pytest.approx(0.954742, abs=5e-7)


def test_folded_beams():
    assert leaves.Folded(side(1.0, degrees=0.0)).stiffness == pytest.approx(1.881169, abs=5e-7)


def test_straight_beam_stiffens_as_it_bends():
    """Finite elements; the usual sum of bending and cubic stretching is 31 % high at 5 mm."""
    travel = np.array([0.01, 0.25, 0.5, 1, 1.5, 2, 3, 4, 5])
    exact = [0.018813, 0.491389, 1.10849, 3.199559, 7.157727, 13.749862, 37.524081, 79.510073, 144.221255]
    strip = side(1.0, degrees=0.0)
    force = leaves.StraightSpring(strip).force(travel)
    assert force == pytest.approx(exact, rel=0.012)
    usual = leaves.StraightSpring(strip).stiffness * travel + np.pi**4 / 8 * strip.axial * travel**3 / 50.0**3
    assert usual[-1] / exact[-1] == pytest.approx(1.31, abs=0.01)


def test_a_straight_beam_has_the_stress_of_a_beam_in_large_deflection_between_clamps():
    """Bending and tension of one leaf, its far end guided across: the same units in both, whatever they are."""
    strip, travel = side(1.0, degrees=0.0), np.array([0.5, 2.0, 5.0])
    nodes = {
        "wall": el.Node(0, 0, el.CLAMPED_SUPPORT),
        "middle": el.Node(strip.length, 0, el.slider_support(np.pi / 2)),
    }
    section = el.Section(strip.youngs_modulus, strip.width, strip.thickness)
    half = el.Network(nodes, {"leaf": el.Beam("wall", "middle", section)})
    path = el.trace(half, el.Displacement("middle", np.pi / 2, travel))
    exact = path.beam_stresses()[0][0][path.at_requested]
    assert leaves.StraightSpring(strip).stress(travel) == pytest.approx(exact, rel=0.02)


def test_cosine_arch_against_finite_elements():
    """Pair of leaves: force at 1, 2, 3, 4 and 6 mm, slope and stiffness as made."""
    arch = leaves.CosineLeaf(leaf())
    assert 2 * arch.force(np.array([1.0, 2, 3, 4, 6])) == pytest.approx(
        [5.59261, 4.988087, 3.643617, 2.28771, -0.432483], abs=0.03
    )
    assert 2 * arch.negative_stiffness == pytest.approx(1.35073, rel=6e-3)
    assert 2 * arch.first_stiffness == pytest.approx(8.257, rel=0.02)


@pytest.mark.parametrize(
    ("law", "balance", "tolerance"),
    [(leaves.CosineLeaf, 4.0 / 3.0, 2e-3), (leaves.VBeam, 1.0, 2e-3)],
    ids=["cosine", "v"],
)
def test_shallow_leaves_follow_the_normalised_lines(law, balance, tolerance):
    """f = F (2X)^3/(E I h) of a pair is 64 pi^2 (4/3 - D) for the cosine and 64 pi^2 (1 - D) for the V, D = d/h."""
    strip = leaves.LeafStrip(100.0, np.arctan(1 / 50), 0.2, 10.0, 1000.0, 0.3)
    place = np.array([0.5, 0.7, 0.9])
    force = 2 * law(strip).force(place * strip.rise) * (2 * strip.reach) ** 3 / (strip.bending * strip.rise)
    assert force == pytest.approx(64 * np.pi**2 * (balance - place), rel=tolerance)


@pytest.mark.parametrize(
    ("flexure", "forces", "top", "bottom"),
    [(5.0, [10.867, 12.074, 7.185, -0.139], None, None), (7.0, None, 9.848, -6.155), (10.0, None, 7.177, -4.281)],
)
def test_hybrid_leaf_as_pseudo_rigid_bodies(flexure, forces, top, bottom):
    found = leaves.HybridLeaf(leaf(), flexure)
    if forces:
        assert 2 * found.force(np.arange(1.0, 5.0)) == pytest.approx(forces, abs=6e-4)
    else:
        curve = 2 * found.force(np.linspace(0, 6, 6001))
        assert (curve.max(), curve.min()) == pytest.approx((top, bottom), abs=6e-4)


def test_table_ii_follows_from_the_stated_stiffnesses():
    """Printed truncated: K_p dr and K_p dr/(K_p + K_b1) with 1.4 and 5.9 N/mm."""
    preload = np.array([2.5, 5.0, 7.5])
    assert leaves.force_change(1.4, preload) == pytest.approx([3.5, 7.0, 10.5])
    shift = leaves.rest_shift(1.4, 5.9, preload)
    assert (np.floor(100 * shift) / 100).tolist() == [0.47, 0.95, 1.43]


def test_the_measured_set_contradicts_itself():
    """At d = h the leaves carry nothing: 1.4 N/mm gives 5.97 N, and 11.15 N would need 2.61 N/mm."""
    assert 1.4 * leaf().rise == pytest.approx(5.97, abs=5e-3)
    assert leaves.measured_stiffness_for(11.15, leaf().rise) == pytest.approx(2.614, abs=5e-4)


def steepest(slenderness: float) -> float:
    strip = leaves.LeafStrip(100.0, np.radians(2), 100.0 * np.sin(np.radians(2)) / slenderness, 10.0, 1000.0, 0.3)
    places = np.linspace(0.2, 1.2, 501) * strip.rise
    return float(np.gradient(leaves.VBeam(strip).s_force(places), places).min() / leaves.first_stiffness(strip))


def test_negative_stiffness_appears_at_a_slenderness_of_1_4246():
    assert steepest(leaves.NEGATIVE_ABOVE * 0.998) > 0 > steepest(leaves.NEGATIVE_ABOVE * 1.002)


@pytest.mark.parametrize(("slenderness", "sign"), [(3.15, 1), (3.25, -1)])
def test_a_bare_v_beam_is_bistable_above_a_slenderness_of_3_195(slenderness, sign):
    strip = leaves.LeafStrip(100.0, np.radians(2), 100.0 * np.sin(np.radians(2)) / slenderness, 10.0, 1000.0, 0.3)
    force = leaves.VBeam(strip).force(np.linspace(0.5, 1.5, 2001) * strip.rise)
    assert np.sign(force.min()) == sign


def test_a_leaf_is_still_buckled_when_flat_above_a_slenderness_of_3_6276():
    assert pytest.approx(3.6276, abs=5e-5) == leaves.FLAT_BUCKLED_ABOVE
    for slenderness, buckled in ((3.58, False), (3.68, True)):
        strip = leaves.LeafStrip(100.0, np.radians(2), 100.0 * np.sin(np.radians(2)) / slenderness, 10.0, 1000.0, 0.3)
        assert bool(leaves.VBeam(strip).is_buckled(strip.rise)) is buckled
