"""The kit of optimised designs: programs of named rows, what is missed and what holds, bounds, starts and clocks."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from journal_support import NotesInMemory

from cfmkit import Run
from cfmkit.designing import objective_and_constraints
from cfmkit.designing.objective_and_constraints import DesignProgram, LimitRows, SeenPoint
from cfmkit.designing.rounded_and_reported_values import find_active_bounds, round_within_bounds
from cfmkit.designing.run_many_starts import UNLIMITED_CLOCK, Clock, OneStart, Stage, from_record, run_stage
from cfmkit.numerics import Effort, Optimum, SearchEnding, minimize
from cfmkit.results import Status
from cfmkit.studies import Lost


@dataclass
class Disc(DesignProgram):
    """The point nearest to (2, 1) on the unit disc, left of a line."""

    line: float = 10.0
    elastic: tuple[str, ...] = ()

    def evaluate(self, z: np.ndarray, sloped: bool) -> SeenPoint | None:
        x, y = z
        if x < -5.0:
            return None
        disc, line = np.array([1.0 - x * x - y * y]), np.array([self.line - x])
        return SeenPoint(
            (x - 2.0) ** 2 + (y - 1.0) ** 2,
            np.array([2.0 * (x - 2.0), 2.0 * (y - 1.0)]) if sloped else None,
            [
                LimitRows("disc", disc, np.array([[-2.0 * x, -2.0 * y]]) if sloped else None, lambda: ["rim"]),
                LimitRows("line", line, np.array([[-1.0]]) if sloped else None, lambda: ["edge"]),
            ],
        )


@pytest.mark.parametrize("elastic", [(), ("disc",), ("disc", "line")])
def test_slopes_of_a_program_are_those_of_its_values(elastic: tuple[str, ...]) -> None:
    """Central differences; rows with slopes by the first variables only count for nothing by the others."""
    source = Disc(0.2, elastic)
    z, step = np.array([0.3, -0.4, 0.7])[: 2 + bool(elastic)], 1e-6
    objective, rows = source.slopes(z)
    for k in range(len(z)):
        (up, above), (down, below) = (source.values(z + sign * step * np.eye(len(z))[k]) for sign in (1, -1))
        assert (up - down) / (2 * step) == pytest.approx(objective[k], abs=1e-8)
        np.testing.assert_allclose((above - below) / (2 * step), rows[:, k], atol=1e-8)


def test_a_program_without_rows_and_one_without_an_answer() -> None:
    class Free(Disc):
        def evaluate(self, z: np.ndarray, sloped: bool) -> SeenPoint | None:
            seen = super().evaluate(z, sloped)
            return None if seen is None else SeenPoint(seen.objective, seen.slope, [])

    assert Free().slopes(np.zeros(2))[1].shape == (0, 2)
    assert Free().values(np.array([-6.0, 0.0])) is None
    assert Free().slopes(np.array([-6.0, 0.0])) is None


def test_a_program_is_minimised_on_its_limits() -> None:
    """To the violation that counts as none, 1e-5."""
    found = minimize(Disc(), np.zeros(2), np.array([[-2.0, 2.0]] * 2), Effort(tolerance=1e-12))
    assert found.ending is SearchEnding.OPTIMUM
    np.testing.assert_allclose(found.z, np.array([2.0, 1.0]) / np.sqrt(5.0), atol=1e-5)


def test_limits_that_contradict_each_other_give_way_by_the_least_amount() -> None:
    """Left of x = -2 + s and in the disc of radius sqrt(1 + s): they meet where (2 - s)^2 = 1 + s."""
    source = Disc(-2.0, ("disc", "line"))
    found = minimize(source, np.array([0.5, 0.5, 9.0]), np.array([[-4.0, 4.0], [-4.0, 4.0], [0.0, 100.0]]))
    assert found.objective == pytest.approx(2.5 - np.sqrt(13.0) / 2.0, abs=1e-5)


def test_missed_limits_are_told_the_worst_first_each_with_its_worst_row() -> None:
    rows = [
        LimitRows("a", np.array([0.1, -0.2]), about=lambda: ["a0", "a1"]),
        LimitRows("b", np.array([-0.5]), about=lambda: ["b0"]),
        LimitRows("a", np.array([-0.3]), about=lambda: ["a2"]),
        LimitRows("c", np.array([-1e-6])),
        LimitRows("d", np.zeros(0)),
    ]
    assert [(one.name, one.about) for one in objective_and_constraints.list_missed_limits(rows, 1e-4)] == [
        ("b", "b0"),
        ("a", "a2"),
    ]
    assert objective_and_constraints.find_largest_violation(rows) == 0.5
    assert objective_and_constraints.find_largest_violation([]) == 0.0


def test_rows_near_zero_hold_a_design_unless_nothing_moves_them() -> None:
    rows = [
        LimitRows("a", np.array([1e-4, 1e-4, 0.5]), np.array([[1.0], [0.0], [1.0]]), lambda: ["moved", "fixed", "far"])
    ]
    assert list(objective_and_constraints.list_active_rows(rows, 1e-3)) == ["a: moved"]


def test_rounded_numbers_stay_within_their_bounds() -> None:
    bounds = np.array([[0.0, 0.00125]] * 2)
    np.testing.assert_array_equal(round_within_bounds(np.array([0.00125, 0.00034]), bounds, 3), [0.001, 0.0])
    np.testing.assert_allclose(
        round_within_bounds(np.array([0.51, 0.3]), np.array([[0.0, 1.0]] * 2), 0, 10.0), [0.5, 0.3]
    )
    np.testing.assert_array_equal(find_active_bounds(np.array([1e-3, 5e-4]), bounds, 0.0, 0.25), [1, 0])


# --- starts ---------------------------------------------------------------------------------------------------


def test_what_a_start_found_is_the_same_read_from_its_record() -> None:
    found = Optimum(np.array([0.1, 1 / 3]), np.inf, np.zeros(0), SearchEnding.STUCK, 7, 1e-5)
    record = json.loads(json.dumps(OneStart(lambda _: found, UNLIMITED_CLOCK)(3)))
    assert not record["late"]
    again = from_record(Optimum, record["found"])
    assert again.z.tolist() == found.z.tolist()
    assert (again.objective, again.ending, again.evaluations) == (np.inf, "STUCK", 7)
    assert again.constraints.shape == (0,)
    assert OneStart(lambda _: None, Clock(0.0))(0) == {"found": {}, "late": True}


def squared(number: int) -> dict[str, Any]:
    return {"found": number**2, "late": False}


def test_finished_starts_are_noted_and_not_done_again() -> None:
    notes, reported = NotesInMemory(), []
    means = Run(notes=notes)
    first = run_stage(
        Stage(squared, (0, 1), "x"), means, UNLIMITED_CLOCK, lambda records: reported.append(len(records))
    )
    again = run_stage(Stage(squared, (0, 1, 2), "x"), means, UNLIMITED_CLOCK, lambda _: None)
    other = run_stage(Stage(squared, (0, 1), "y"), means, UNLIMITED_CLOCK, lambda _: None)
    assert (first.reused, again.reused, other.reused) == (0, 2, 0)
    assert {job: record["found"] for job, record in again.records.items()} == {0: 0, 1: 1, 2: 4}
    assert reported == [0, 1, 2]


def test_late_no_start_is_begun_and_one_that_ran_out_of_time_is_not_noted() -> None:
    notes = NotesInMemory()
    means = Run(notes=notes)
    assert run_stage(Stage(squared, (0, 1), "x"), means, Clock(0.0), lambda _: None).records == {}
    late = run_stage(Stage(lambda _: {"found": {}, "late": True}, (0,), "x"), means, UNLIMITED_CLOCK, lambda _: None)
    assert list(late.records) == [0]
    assert notes.keys == {}


def test_processes_that_die_are_told_once_a_reason() -> None:
    def dying(_work: Any, jobs: Any, _stopping: Any) -> Any:
        yield from ((job, Lost(Status.CRASHED, "out of memory")) for job in jobs)

    outcome = run_stage(Stage(squared, (0, 1), "x"), Run(executor=dying), UNLIMITED_CLOCK, lambda _: None)
    assert (dict(outcome.records), outcome.lost) == ({}, ("out of memory",))


def test_the_shortest_budget_ends_the_time() -> None:
    assert Clock.from_budgets(None, None) == UNLIMITED_CLOCK
    assert not UNLIMITED_CLOCK.late()
    assert Clock.from_budgets(None, -1.0, 100.0).late()
    assert not Clock.from_budgets(50.0, 100.0).late()
