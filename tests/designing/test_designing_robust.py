"""Margins from tolerances: problems whose best design and yield are known in closed form."""

from __future__ import annotations

from dataclasses import replace
from statistics import NormalDist

import numpy as np
import pytest

from cfmkit.designing.robust_design import (
    NoPart,
    PartSlopes,
    RobustProblem,
    costliest,
    linear,
    optimise_on_samples,
    with_margins,
)

PHI = NormalDist().cdf


UNWATCHED = (lambda: False, lambda _share, _steps: None, lambda _x, _errors: None)
"""All the time, no report of progress, no exact derivatives."""


def problem(seen, errors, matrix, constant, bounds, share=0.9):
    """Return a problem with unit errors; every row is a limit of its own."""
    matrix, constant = np.asarray(matrix, dtype=float), np.asarray(constant, dtype=float)
    deviations = np.ones(errors.shape[1])
    about = np.arange(len(constant))
    return RobustProblem(
        seen, np.array(bounds, dtype=float), errors, deviations, matrix, constant, about, share, *UNWATCHED
    )


def normal(count, size):
    return np.random.default_rng(1).standard_normal((count, size))


def test_a_part_between_two_limits_goes_to_their_middle_and_has_the_yield_of_the_normal_law():
    # 0 <= x + e <= 4 with e of N(0, 1): best at 2, where P = 2 Phi(2) - 1
    one = problem(lambda x, e: x + e, normal(4000, 1), [[1.0], [-1.0]], [0.0, 4.0], [[-5.0, 5.0]], share=0.99)
    found = with_margins(one, np.array([0.1]))
    assert found.x[0] == pytest.approx(2.0, abs=0.15)  # of the tail of 192 parts
    assert found.share == pytest.approx(2 * PHI(2) - 1, abs=0.01)
    assert found.began == pytest.approx(PHI(0.1), abs=0.03)
    assert not found.reached


def test_no_more_is_moved_than_the_share_asks_for():
    one = problem(lambda x, e: x + e, normal(4000, 1), [[1.0]], [0.0], [[0.0, 100.0]], share=0.9)
    found = with_margins(one, np.array([0.5]))
    assert found.reached
    assert PHI(found.x[0]) > 0.9
    assert found.x[0] < 15


def test_the_margin_of_a_limit_grows_with_what_the_tolerances_move_it():
    # a curve x^2: its error is 2 x e, so the spread of the limit grows with the value that is moved
    one = problem(lambda x, e: (x + 0.1 * e) ** 2, normal(4000, 1), [[1.0]], [-1.0], [[0.5, 3.0]])
    at = linear(one, np.array([1.5]), one.seen)
    assert at.spread(one.deviations)[0] == pytest.approx(2 * 1.5 * 0.1, rel=1e-6)
    found = with_margins(one, np.array([1.0]))
    assert found.reached
    assert (found.x[0] - 1.0) / 0.1 > 1.28


def test_drawn_parts_see_what_first_order_does_not():
    # e^2 moves the limit and its first derivative is nothing: only parts that are solved show it
    def seen(x, e):
        return np.array([x[0] - e[0] ** 2, -x[0]])

    one = problem(seen, normal(2000, 1), np.eye(2), [0.0, 5.0], [[0.0, 6.0]], share=0.9)
    first = with_margins(one, np.array([0.1]))
    found = optimise_on_samples(one, replace(first, x=np.array([0.1])), 24)
    assert first.x[0] < found.x[0] <= 5.0
    good = (one.errors[:, 0] ** 2 <= found.x[0]).mean()
    assert good > (one.errors[:, 0] ** 2 <= first.x[0]).mean()


def test_the_tolerance_that_costs_most_is_the_one_with_the_largest_share_of_the_spread():
    one = problem(lambda x, e: x + np.array([e[0] + 3 * e[1]]), normal(2000, 2), [[1.0]], [0.0], [[0.0, 1.0]], 0.99)
    found = with_margins(one, np.array([0.5]))
    assert costliest(found, one, [(0,), (1,)]) == 1


def test_where_no_tolerance_alone_makes_parts_good_the_one_that_costs_most_is_the_larger_error():
    """Both alone leave no good part: the first had been named whichever it was."""
    for first, worst in ((20.0, 1), (60.0, 0)):

        def seen(x, e, first=first):
            return x + np.array([first * e[0] + (80.0 - first) * e[1]])

        one = problem(seen, normal(500, 2), [[1.0], [-1.0]], [0.0, 1e-6], [[0.0, 1e-6]], share=0.9)
        found = with_margins(one, np.array([5e-7]))
        assert found.linear.share(one.errors) == 0.0
        assert costliest(found, one, [(0,), (1,)]) == worst


def test_a_design_without_numbers_is_refused():
    with pytest.raises(NoPart):
        with_margins(problem(lambda x, e: None, normal(10, 1), [[1.0]], [0.0], [[0, 1]]), np.array([0.5]))


def test_an_error_to_one_side_is_never_looked_at_on_the_other():
    """As a waviness, which is never negative: a part with a negative one has no numbers."""
    rng = np.random.default_rng(3)

    def seen(x, errors):
        return None if errors[0] < 0 else np.array([x[0] - 2.0 * errors[0]])

    problem = RobustProblem(
        seen,
        np.array([[0.0, 5.0]]),
        rng.uniform(0.0, 1.0, (400, 1)),
        np.array([12.0**-0.5]),
        np.ones((1, 1)),
        np.zeros(1),
        np.zeros(1, dtype=int),
        0.9,
        *UNWATCHED,
    )
    found = with_margins(problem, np.array([0.5]))
    assert found.linear.by_error[0, 0] == pytest.approx(-2.0)
    assert found.reached
    assert found.x[0] >= 1.8


def test_a_step_sees_the_limit_that_is_missed_among_many_steeper_ones_that_are_not():
    # forty limits keep y between -0.2 and 0.2, where it is; the one that parts miss wants x above 3
    def seen(x, e):
        return np.array([x[0] + e[0], x[1]])

    steep = [[0.0, 5.0 * sign] for sign in (1.0, -1.0) for _ in range(20)]
    one = problem(seen, normal(2000, 1), [[1.0, 0.0], *steep], [-3.0, *[1.0] * 40], [[0.0, 10.0], [-5.0, 5.0]])
    found = with_margins(one, np.zeros(2))
    assert found.reached
    assert found.x[0] > 3.0 + 1.2
    assert abs(found.x[1]) <= 0.2


def test_derivatives_that_are_known_need_no_other_part_and_the_rest_is_found_by_steps():
    def seen(x, e):
        return np.array([np.exp(x[0] + 0.1 * e[0]), x[0] * x[1] + e[1]])

    def slopes(x, e):
        known = np.exp(x[0] + 0.1 * e[0])
        unknown = [np.nan, np.nan]
        return PartSlopes(np.array([[known, x[1]], unknown]).T, np.array([[0.1 * known, 0.0], unknown]).T)

    plain = problem(seen, normal(500, 2), np.eye(2), [-1.5, 0.0], [[0.0, 2.0], [1.0, 2.0]])
    exact = replace(plain, slopes=slopes)
    counted = []
    found = linear(exact, np.array([0.5, 1.5]), lambda x, e: counted.append(1) or seen(x, e))
    assert len(counted) == 1 + 2 + 2  # itself, and the unknown value and error to both sides
    steps = linear(plain, np.array([0.5, 1.5]), seen)
    assert found.by_x[0, 0] == np.exp(0.5)
    assert found.by_x == pytest.approx(steps.by_x, rel=1e-6, abs=1e-9)
    assert found.by_error == pytest.approx(steps.by_error, rel=1e-3, abs=1e-9)
    ends = [with_margins(one, np.array([0.5, 1.5])) for one in (exact, plain)]
    assert ends[0].x == pytest.approx(ends[1].x, abs=0.02)
    assert ends[0].seen < ends[1].seen
