"""Constrained minimisation on problems with known answers: where it ends, why, and which points it asks for."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cfmkit.numerics.sqp import Effort, SearchEnding, minimize

if TYPE_CHECKING:
    from collections.abc import Callable

FREE = np.array([[-10.0, 10.0], [-10.0, 10.0]])


@dataclass
class Known:
    """A program made of plain functions; `answers` says where the model has an answer."""

    objective: Callable
    slope: Callable
    constraints: Callable = lambda z: np.zeros(0)
    constraint_slopes: Callable = lambda z: np.zeros((0, len(z)))
    answers: Callable = lambda z: True
    asked: list = field(default_factory=list)

    def values(self, z):
        self.asked.append(z.copy())
        return (float(self.objective(z)), self.constraints(z)) if self.answers(z) else None

    def slopes(self, z):
        return (self.slope(z), self.constraint_slopes(z)) if self.answers(z) else None


def on_a_disc() -> Known:
    """The sum of two numbers on a disc of radius sqrt(2): least at (-1, -1)."""
    return Known(
        lambda z: z.sum(),
        lambda z: np.ones(2),
        lambda z: np.array([2.0 - z @ z]),
        lambda z: -2.0 * z[None, :],
    )


def rosenbrock() -> Known:
    """The curved valley, least at (1, 1)."""
    return Known(
        lambda z: 100 * (z[1] - z[0] ** 2) ** 2 + (1 - z[0]) ** 2,
        lambda z: np.array([-400 * z[0] * (z[1] - z[0] ** 2) - 2 * (1 - z[0]), 200 * (z[1] - z[0] ** 2)]),
    )


def near(point: float, weight: float = 1.0) -> Known:
    """The square of the distance of one number from a point."""
    return Known(lambda z: weight * (z[0] - point) ** 2, lambda z: 2.0 * weight * (z - point))


def test_a_constrained_optimum_is_found():
    """The objective is flat along the rim: an error of 1e-10 in it leaves one of 1e-5 in the place."""
    found = minimize(on_a_disc(), np.array([1.0, 0.0]), FREE, Effort(tolerance=1e-10, violation=1e-9))
    np.testing.assert_allclose(found.z, [-1.0, -1.0], atol=5e-5)
    assert found.ending is SearchEnding.OPTIMUM
    assert found.objective == pytest.approx(-2.0, abs=1e-8)
    assert found.feasible


def test_a_curved_valley_is_followed_to_its_end():
    found = minimize(rosenbrock(), np.array([-1.2, 1.0]), FREE, Effort(steps=200, tolerance=1e-14))
    assert found.ending is SearchEnding.OPTIMUM
    np.testing.assert_allclose(found.z, [1.0, 1.0], atol=1e-4)


@settings(deadline=None, max_examples=50)
@given(st.lists(st.tuples(st.floats(-5, 5), st.floats(-5, 5)), min_size=1, max_size=5))
def test_the_nearest_point_of_a_box_is_the_clipped_one_and_the_box_is_never_left(pairs):
    wanted, start = np.array(pairs).T
    bounds = np.tile([-1.0, 2.0], (len(pairs), 1))
    program = Known(lambda z: ((z - wanted) ** 2).sum(), lambda z: 2.0 * (z - wanted))
    found = minimize(program, start, bounds, Effort(tolerance=1e-12))
    np.testing.assert_allclose(found.z, np.clip(wanted, -1.0, 2.0), atol=1e-5)
    asked = np.array(program.asked)
    assert (asked >= -1.0).all()
    assert (asked <= 2.0).all()
    np.testing.assert_array_equal(asked[0], np.clip(start, -1.0, 2.0))


def test_a_step_to_where_the_model_has_no_answer_is_shortened():
    program = near(1.4, 50.0)
    program.answers = lambda z: z[0] < 1.5
    found = minimize(program, np.zeros(1), np.array([[-10.0, 10.0]]), Effort(tolerance=1e-12))
    assert any(z[0] >= 1.5 for z in program.asked)
    assert found.ending is SearchEnding.OPTIMUM
    assert found.z[0] == pytest.approx(1.4, abs=1e-5)


def test_a_start_without_an_answer_is_told():
    program = near(0.0)
    program.answers = lambda z: False
    found = minimize(program, np.ones(1), np.array([[-1.0, 1.0]]))
    assert found.ending is SearchEnding.NO_ANSWER
    assert (found.objective, found.violation, found.evaluations) == (np.inf, np.inf, 1)
    assert not found.feasible


def test_a_start_without_slopes_is_where_it_stops():
    program = near(0.0)
    program.slopes = lambda z: None
    found = minimize(program, np.ones(1), np.array([[-1.0, 1.0]]))
    assert found.ending is SearchEnding.STUCK
    assert (found.z[0], found.objective) == (1.0, 1.0)


def test_constraints_that_contradict_each_other_have_no_optimum():
    """The solver may call the point stuck: with a slack for each step it finds no contradiction, but no way on."""
    program = near(0.0)
    program.constraints = lambda z: np.array([z[0] - 1.0, -1.0 - z[0]])
    program.constraint_slopes = lambda z: np.array([[1.0], [-1.0]])
    found = minimize(program, np.array([0.5]), np.array([[-10.0, 10.0]]))
    assert found.ending in (SearchEnding.INCOMPATIBLE, SearchEnding.STUCK)
    assert found.violation >= 1.0
    assert not found.feasible


@pytest.mark.parametrize(("steps", "seen"), [(3, None), (None, 1), (None, 5)])
def test_steps_and_time_allowed_are_kept_and_the_best_point_seen_is_returned(steps, seen):
    program = rosenbrock()
    effort = Effort(steps=steps) if steps else Effort(stop=lambda: len(program.asked) >= seen)
    found = minimize(program, np.array([-1.2, 1.0]), FREE, effort)
    assert found.ending is (SearchEnding.STEPS if steps else SearchEnding.OUT_OF_TIME)
    assert found.evaluations == len(program.asked) == (seen or found.evaluations)
    assert found.objective == min(program.objective(z) for z in program.asked)


def test_without_any_time_there_is_no_answer():
    program = rosenbrock()
    found = minimize(program, np.array([-1.2, 1.0]), FREE, Effort(stop=lambda: True))
    assert (found.ending, found.objective, program.asked) == (SearchEnding.OUT_OF_TIME, np.inf, [])


def test_a_point_that_is_good_enough_ends_the_search():
    program = rosenbrock()
    found = minimize(program, np.array([-1.2, 1.0]), FREE, Effort(enough=4.15))
    assert found.ending is SearchEnding.OPTIMUM
    assert found.objective <= 4.15
    np.testing.assert_array_equal(found.z, program.asked[-1])
    assert all(program.objective(z) > 4.15 for z in program.asked[:-1])


def test_a_point_that_violates_a_constraint_is_never_good_enough():
    found = minimize(on_a_disc(), np.array([-3.0, -3.0]), FREE, Effort(enough=-2.0 - 1e-3, tolerance=1e-10))
    np.testing.assert_allclose(found.z, [-1.0, -1.0], atol=1e-4)


def test_the_last_point_violates_less_than_the_best_of_those_whose_violation_counts_as_none():
    start, lax = np.array([1.0, 0.0]), 0.5
    best = minimize(on_a_disc(), start, FREE, Effort(tolerance=1e-10, violation=lax))
    last = minimize(on_a_disc(), start, FREE, Effort(tolerance=1e-10, violation=lax, last=True))
    assert best.feasible
    assert last.feasible
    assert best.objective < last.objective
    assert last.violation < 1e-6 < best.violation <= lax
    np.testing.assert_allclose(last.z, [-1.0, -1.0], atol=1e-5)


def band_around(wanted: float) -> Known:
    """Five forces between 1 and 9 N that are to be within 1 % of another one, over as long a travel as can be."""

    def off(z):
        return 100.0 * (
            ((1.0 + z[0] + 0.1 * z[1]) ** 3 + 0.1 * np.sin(3.0 * z[2] + np.arange(5) * z[0])) / wanted - 1.0
        )

    def by(z):
        sides = [(off(z + step) - off(z - step)) / 2e-6 for step in 1e-6 * np.eye(3)]
        return np.column_stack(sides)

    return Known(
        lambda z: -z[2],
        lambda z: np.array([0.0, 0.0, -1.0]),
        lambda z: np.concatenate([1.0 - off(z), 1.0 + off(z)]),
        lambda z: np.concatenate([-by(z), by(z)]),
    )


@pytest.mark.parametrize(("wanted", "reached"), [(1e-6, False), (0.1, False), (1.0, True), (2.0, True)])
def test_a_search_with_patience_ends_where_the_constraints_cannot_be_met_and_only_there(wanted, reached):
    bounds, start = np.array([[0.0, 1.0], [0.0, 1.0], [0.2, 3.0]]), np.full(3, 0.5)
    hasty, patient = band_around(wanted), band_around(wanted)
    found = minimize(hasty, start, bounds, Effort(100, violation=5e-3, last=True, patience=10))
    usual = minimize(patient, start, bounds, Effort(100, violation=5e-3, last=True))
    assert (found.feasible, usual.feasible) == (reached, reached)
    assert found.violation == pytest.approx(usual.violation, rel=1e-6, abs=5e-3)
    if reached:
        np.testing.assert_array_equal(hasty.asked, patient.asked)
    else:
        assert found.ending is SearchEnding.STUCK
        assert len(hasty.asked) < 20 < 30 < len(patient.asked)


def test_a_search_ends_where_no_point_is_better_for_long_and_only_there():
    rises = Known(lambda z: 1.0 + 1e-9 * z.sum(), lambda z: -np.ones(2))
    found = minimize(rises, np.array([3.0, 2.0]), FREE, Effort(idle=5))
    assert (found.ending, found.evaluations) == (SearchEnding.STUCK, 6)
    falls, usual = rosenbrock(), rosenbrock()
    at = minimize(falls, np.array([-1.2, 1.0]), FREE, Effort(idle=20)).z
    np.testing.assert_array_equal(at, minimize(usual, np.array([-1.2, 1.0]), FREE).z)
    np.testing.assert_array_equal(falls.asked, usual.asked)
