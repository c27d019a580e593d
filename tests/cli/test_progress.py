"""How far a study is: what the lines on standard error say of the time that is left."""

import re
from types import SimpleNamespace

import pytest

from cfmkit.cli import output, progress
from cfmkit.cli.output import Terminal
from cfmkit.cli.progress import StudyProgress


@pytest.fixture
def told(monkeypatch):
    """Run a study by a list of (seconds, points) and return what each line says: (seconds, seconds left or None)."""

    def run(events, total, reused=0):
        clock, lines = SimpleNamespace(now=0.0), []
        monkeypatch.setattr(progress, "time", SimpleNamespace(monotonic=lambda: clock.now))
        monkeypatch.setattr(progress.output, "write_error", lines.append)
        monitor = StudyProgress(SimpleNamespace(json=False, quiet=False))
        monitor.total(total)
        if reused:
            monitor.add_finished(reused, 0, True)
        found = []
        for when, points in events:
            clock.now = when
            monitor.add_finished(points, 0, False)
            if lines:
                found.append((when, left(lines.pop())))
        return found

    monkeypatch.setattr(progress.sys, "stderr", None)
    return run


def left(line):
    found = re.search(r"([0-9.]+) (s|min|h) left", line)
    return None if found is None else float(found[1]) * {"s": 1.0, "min": 60.0, "h": 3600.0}[found[2]]


@pytest.mark.parametrize(
    ("workers", "start", "each"), [(1, 25.0, 0.05), (2, 25.0, 0.05), (8, 12.0, 3.0), (1, 0.0, 1.5)]
)
def test_the_time_left_is_that_of_the_points_without_start_and_compilation(told, workers, start, each):
    """1000 points whose first one also compiles: the first line used to promise 1000 times that."""
    spread = 0.02 * each
    events = [
        (start + each * (1 + n // workers) + spread * (n % workers), 1) for n in range(1000)
    ]  # fmt: skip
    lines = told(events, 1000)
    assert len(lines) > 2
    end = events[-1][0]
    for when, promised in lines:
        assert promised is None or promised == pytest.approx(end - when, rel=0.6, abs=each + 2.0)
    assert [promised for _, promised in lines].count(None) <= 1


def test_points_of_an_earlier_run_do_not_count_as_quick_ones(told):
    lines = told([(10.0 + n, 1) for n in range(60)], 1000, reused=900)
    assert all(promised is None or promised == pytest.approx(109.0 - when, rel=0.3) for when, promised in lines)


def test_points_that_get_slower_are_followed(told):
    events = [(0.1 * n, 1) for n in range(1, 1000)] + [(100.0 + 2.0 * n, 1) for n in range(100)]
    lines = told(events, 1100)
    assert lines[-1][1] == pytest.approx(298.0 - lines[-1][0], abs=5.0)


def test_the_end_of_a_time_budget_is_the_end_of_the_work(monkeypatch):
    clock, lines = SimpleNamespace(now=0.0), []
    monkeypatch.setattr(output, "time", SimpleNamespace(monotonic=lambda: clock.now))
    monkeypatch.setattr(output, "write_error", lines.append)
    monkeypatch.setattr(output.sys, "stderr", SimpleNamespace(isatty=lambda: False))
    with Terminal().progress(180.0) as report:
        clock.now = 90.0
        report(0.13, "1 proposal")
        clock.now = 300.0
        report(0.2, "1 proposal")
    assert lines == ["50 %, 90 s left: 1 proposal\n", "99 %, 3 s left: 1 proposal\n"]
