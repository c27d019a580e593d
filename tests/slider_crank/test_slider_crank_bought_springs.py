"""Springs of a list at the pins of a linkage: which ones a design takes."""

from __future__ import annotations

import itertools
import math
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import cfmkit
from cfmkit import Run
from cfmkit.errors import SpecError
from cfmkit.families import family
from cfmkit.families.slider_crank.springs.bought_springs import _why_not as why_not
from cfmkit.families.slider_crank.springs.bought_springs import best_sets
from cfmkit.families.slider_crank.springs.fit_nonnegative_rates import RateGoal
from cfmkit.families.slider_crank.springs.sprung_linkage import assemble
from cfmkit.stock.springs import HelicalTorsionSpring

CONFIGS = Path(__file__).parents[2] / "configs"


LIST = (
    {"name": "T-30", "kind": "torsion", "rate": "30 N*mm/rad", "counts": (1, 2)},
    {"name": "T-35", "kind": "torsion", "rate": "35 N*mm/rad", "counts": (1,)},
    {"name": "T-7", "kind": "torsion", "rate": "7 N*mm/rad", "counts": (1, 2, 3)},
    {"name": "weak", "kind": "torsion", "rate": "33 N*mm/rad", "max_angle": "20 deg", "counts": (1,)},
)


def cranked(**changes):
    given = cfmkit.load(CONFIGS / "slider_crank_bought.yaml")
    spec = given.replace({f"design.{key}": value for key, value in ({"catalogue": LIST} | changes).items()})
    return spec, family("slider-crank").design.make(spec, Run())


def test_of_a_list_the_programme_takes_what_trying_all_of_it_takes():
    """Every joint: nothing, or one of the five combinations of spring and number that are not overwound."""
    spec, found = cranked(tolerance="20 %")
    rates = sorted({0.0, *(float(f"{n * r:.9g}") for r, ns in ((30, (1, 2)), (35, (1,)), (7, (1, 2, 3))) for n in ns)})
    motion = np.linspace(0.001, 0.035, 1001)
    unit = assemble(spec).units(motion).effort[:3] * 1e-3
    deviations = {
        trial: np.abs(np.array(trial) @ unit / 1.5 - 1.0).max() for trial in itertools.product(rates, repeat=3)
    }
    best = min(deviations.values())
    springs = found.spec.mechanism.springs
    got = deviations[tuple(float(f"{1e3 * rate:.9g}") for rate in springs.rates[:3])]
    assert got == pytest.approx(best, rel=1e-9)
    assert {one.name for one in springs.bought} <= {"T-30", "T-35", "T-7"}
    for one in springs.bought:
        rate = {"T-30": 30.0, "T-35": 35.0, "T-7": 7.0}[one.name] * one.count
        assert getattr(springs, one.at) == pytest.approx(rate * 1e-3)


def tried(count, offered, seed, row=None):
    """Return random unit curves as a goal, and the smallest deviations of all sets of what is offered."""
    random, place = np.random.default_rng(seed), np.linspace(0.0, 1.0, 101)
    columns = [
        1 / (0.3 + place),
        np.exp(-random.uniform(0.1, 2) * place),
        -(place ** random.uniform(0.3, 2)),
        place + 1,
    ]
    least = None if row is None else (row, 0.4)
    goal = RateGoal(np.array(columns[:count]).T, np.ones(101), np.full(count, np.inf), least=least)
    sets = np.array(list(itertools.product(*offered)))
    sets = sets if row is None else sets[sets @ row >= 0.4]
    return goal, np.sort(np.abs(sets @ goal.matrix.T - 1.0).max(axis=1))


@pytest.mark.parametrize("seed", range(12))
def test_the_best_sets_of_springs_are_those_of_trying_all_of_them(seed):
    random = np.random.default_rng(100 + seed)
    offered = [np.unique(np.append(0.0, random.uniform(0, 1, random.integers(1, 7)))) for _ in range(4)]
    row = np.array([1.0, 0.5, -0.2, 0.3]) if seed % 3 == 0 else None
    goal, deviations = tried(4, offered, seed, row)
    assert [off for off, _ in best_sets(goal, offered, 3)] == pytest.approx(list(deviations[:3]), rel=1e-12)
    assert best_sets(goal, offered)[0][0] == pytest.approx(deviations[0], rel=1e-12)


def test_of_two_rates_that_are_nearly_equal_the_better_is_taken():
    """20 and 20.004 N mm/rad are the same to three digits."""
    rates = [20.0, 20.004, 20.008, 35.0, 35.01, 45.0, 45.02, 70.0, 70.03, 70.06]
    listed = tuple(
        {"name": f"T-{k}", "kind": "torsion", "rate": f"{rate} N*mm/rad", "counts": (1,)}
        for k, rate in enumerate(rates)
    )
    spec, found = cranked(catalogue=listed, tolerance="30 %")
    unit = assemble(spec).units(np.linspace(0.001, 0.035, 1001)).effort[:3] * 1e-3 / 1.5
    sets = np.array(list(itertools.product([0.0, *rates], repeat=3)))
    best = sets[np.argmin(np.abs(sets @ unit - 1.0).max(axis=1))]
    assert [1e3 * rate for rate in found.spec.mechanism.springs.rates[:3]] == pytest.approx(list(best), rel=1e-9)


EXTENSION = {"name": "E", "kind": "extension", "stiffness": "0.02 N/mm", "max_elongation": "50 mm", "counts": (1, 2)}


def test_springs_that_are_picked_let_the_force_be_trimmed():
    """A trim by the anchor needs a slider spring of at least its share of the force; it was left out of the choice."""
    asked = {"springs": ["pivot", "crank_pin", "slider_pin", "slider"], "adjustment": "0.2 N", "anchor_travel": "5 mm"}
    _, found = cranked(catalogue=(*LIST, EXTENSION), tolerance="60 %", **asked)
    assert found.spec.mechanism.springs.slider == pytest.approx(40.0)
    _, soft = cranked(catalogue=(*LIST, EXTENSION | {"counts": (1,)}), tolerance="60 %", **asked)
    assert soft.spec is None
    assert "stiff enough for 'design.adjustment' within 'design.anchor_travel'" in soft.message


def test_a_slider_spring_that_is_longer_than_its_place_is_not_picked():
    asked = {"springs": ["pivot", "crank_pin", "slider_pin", "slider"], "tolerance": "60 %", "adjustment": "0.1 N"}
    asked |= {"anchor_travel": "5 mm", "spring_room": "40 mm"}
    long, short = (EXTENSION | {"name": name, "free_length": free} for name, free in (("L", "41 mm"), ("S", "39 mm")))
    _, found = cranked(catalogue=(*LIST, long, short), **asked)
    assert [one.name for one in found.spec.mechanism.springs.bought if one.at == "slider"] == ["S"]
    _, none = cranked(catalogue=(*LIST, long), **asked)
    assert "L at the slider: too long, 41 mm relaxed ('design.spring_room' 40 mm)" in none.message


def deviation(spec):
    """Return the largest deviation from 1.5 N over the window."""
    unit = assemble(spec).units(np.linspace(0.001, 0.035, 1001)).effort
    return np.abs(spec.mechanism.springs.rates @ unit / 1.5 - 1.0).max()


def test_free_lengths_are_chosen_for_the_springs_that_can_be_had():
    """With rates of any value another crank is best."""
    ends = {"crank_length": ["50 mm", "58 mm"], "tolerance": "30 %"}
    spec, found = cranked(**ends)
    any_rate = family("slider-crank").design.make(spec.replace({"design.catalogue": None}), Run())
    crank = any_rate.spec.mechanism.crank_length
    other = spec.replace({"mechanism.crank_length": crank, "design.crank_length": None})
    off = [deviation(one.spec) for one in (found, family("slider-crank").design.make(other, Run()))]
    assert off[0] < off[1]


@pytest.mark.parametrize(
    ("changes", "reported"),
    [
        ({"travel": None}, "are picked for a window"),
        ({"objective": "least-squares"}, "remove 'objective'"),
        ({"slack": "1 %"}, "'slack' needs freely chosen rates"),
        ({"catalogue": None, "spring_room": "40 mm"}, "'spring_room' applies only to springs picked"),
    ],
)
def test_what_a_catalogue_does_not_go_with_is_refused(changes, reported):
    with pytest.raises(SpecError, match=reported):
        cranked(**changes)


def test_a_spring_that_the_window_overwinds_is_not_taken_however_well_it_would_fit():
    only = ({"name": "weak", "kind": "torsion", "rate": "33 N*mm/rad", "max_angle": "20 deg", "counts": (1,)},)
    _, found = cranked(catalogue=only)
    assert found.spec is None
    assert found.status.exit_code == 4
    assert "it allows 20 deg" in found.message


def test_where_no_set_keeps_the_tolerance_the_nearest_three_are_told():
    _, found = cranked(tolerance="0.01 %")
    assert found.spec is None
    assert found.message.count("off by") == 3
    shares = [float(text.split("%")[0]) for text in found.message.split("off by ")[1:]]
    assert shares == sorted(shares)


def test_a_pair_needs_every_spring_twice():
    spec, _ = cranked()
    pair = spec.replace({"mechanism.copies": "mirrored"})
    tables = [family("slider-crank").analyze(one, Run()).tables["parts"]() for one in (spec, pair)]
    columns = [{column.name: column.cells() for column in table.columns} for table in tables]
    counts = [
        [count for count, data in zip(one["count"], one["data"], strict=True) if "torsion" in data] for one in columns
    ]
    assert counts == [[2, 2, 2], [4, 4, 4]]


FATIGUE = {"coefficient": "2000 MPa", "exponent": -0.1, "ultimate_strength": "2000 MPa"}


def test_a_spring_that_does_not_last_its_reversals_is_not_chosen():
    """Its life in a design is that between both ends of its motion, as in the analysis."""
    offer = {"name": "T", "kind": "torsion", "wire": "0.8 mm", "coil": "4.8 mm", "turns": 5, "fatigue": FATIGUE}
    spec, _ = cranked(catalogue=(offer | {"max_angle": "120 deg"},), tolerance="60 %")
    (offer,) = (one.offer for one in spec.design.catalogue)
    wanted = SimpleNamespace(spring_room=None, spring_safety=None, spring_life=1000.0)
    turned = math.radians(55.0)
    assert why_not(offer, (0.0, turned), wanted) is None
    share, reported = why_not(offer, (-turned, turned), wanted)
    wound = HelicalTorsionSpring(0.8e-3, 4.8e-3, 5.0)
    cycles = 0.5 * (wound.stress(wound.rate * turned) / 2000e6) ** -10.0  # a load that reverses has no mean
    assert share == pytest.approx(1 - cycles / 1000, rel=1e-3)
    assert "cycles" in reported
