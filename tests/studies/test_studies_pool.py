"""A pool of processes: what a death costs, what a timeout costs, and that nothing hangs."""

import contextlib
import gc
import math
import os
import random
import signal
import subprocess
import sys
import threading
import time
import weakref
from pathlib import Path

import pytest
from pace import wait_until

from cfmkit.errors import CfmError
from cfmkit.results import Status
from cfmkit.studies import pool as pools
from cfmkit.studies import serial_and_cluster_executors as executors
from cfmkit.studies.pool import Pool
from cfmkit.studies.serial_and_cluster_executors import Lost, never, serial

SUPPORT = Path(__file__).parents[1] / "support"


@pytest.fixture
def doer(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(str(SUPPORT))
    import study_work

    return study_work.Doer(str(tmp_path))


def jobs(count, deed="square"):
    return ((number, deed) for number in range(count))


def test_every_job_is_done_once_by_every_executor(doer):
    for executor in (serial, Pool(1), Pool(3)):
        done = sorted((job[0], outcome) for job, outcome in executor(doer, jobs(200), never))
        assert done == [(n, n * n) for n in range(200)]


class Ring:
    def __init__(self):
        self.ring = self


def test_memory_that_finished_jobs_have_left_is_freed_while_a_study_runs(monkeypatch):
    """Objects that refer to each other, few and large: Python alone would not look for them before the end."""
    monkeypatch.setattr(executors, "COLLECTION_SHARE", math.inf)
    seen, alive_at_once, frozen = [], [], gc.get_freeze_count()

    def leaving(job):
        seen.append(weakref.ref(Ring()))
        alive_at_once.append(sum(one() is not None for one in seen))
        return job

    gc.disable()
    try:
        assert [job for job, _ in serial(leaving, iter(range(20)))] == list(range(20))
    finally:
        gc.enable()
    assert max(alive_at_once) < 5
    assert gc.get_freeze_count() == frozen


def test_no_jobs_start_no_process(doer, monkeypatch):
    monkeypatch.setattr(pools, "_start_worker", lambda: pytest.fail("a process was started"))
    assert list(Pool(2)(doer, iter(()))) == []


def test_what_runs_when_the_time_of_all_is_up_is_given_up(doer):
    begun = time.monotonic()
    done = list(Pool(2, deadline=time.time() + 0.6)(doer, iter([(1, "square"), (2, "hang"), (3, "hang"), (4, "hang")])))
    assert time.monotonic() - begun < 5.0
    assert {outcome for job, outcome in done if job[0] == 1 and not isinstance(outcome, Lost)} <= {1}
    lost = [outcome for _, outcome in done if isinstance(outcome, Lost)]  # on a busy machine the first one, too
    assert 1 <= len(lost) <= 2
    assert all(one.status is Status.TIMEOUT for one in lost)


def test_jobs_are_pulled_as_they_are_needed(doer):
    pulled = []

    def source():
        for number in range(1000):
            pulled.append(number)
            yield number, "ten_ms"

    outcomes = Pool(2)(doer, source())
    for _ in range(10):
        next(outcomes)
    outcomes.close()
    assert len(pulled) < 40


def test_a_death_costs_a_second_try_and_nothing_else(doer):
    mixed = [(n, "die_once" if n % 10 == 0 else "square") for n in range(50)]
    done = dict(Pool(2)(doer, iter(mixed)))
    assert done == {(n, deed): n if deed == "die_once" else n * n for n, deed in mixed}


@pytest.mark.parametrize(("deed", "cause"), [("die", "SIGKILL"), ("leave", "exit code 3")])
def test_a_job_that_kills_its_worker_twice_is_given_up_alone(doer, deed, cause):
    mixed = [(n, deed if n == 7 else "square") for n in range(40)]
    done = dict(Pool(2)(doer, iter(mixed)))
    lost = done.pop((7, deed))
    assert isinstance(lost, Lost)
    assert lost.status is Status.CRASHED
    assert cause in lost.message
    assert done == {(n, "square"): n * n for n in range(40) if n != 7}


def test_a_job_that_takes_too_long_is_given_up_alone(doer):
    mixed = [(n, "hang" if n in (3, 20) else "square") for n in range(40)]
    done = dict(Pool(2, timeout=0.5)(doer, iter(mixed)))
    assert {job[0] for job, outcome in done.items() if isinstance(outcome, Lost)} == {3, 20}
    assert done[3, "hang"].status is Status.TIMEOUT
    assert done[3, "hang"].message == "not finished within 0.5 s"


def test_an_exception_comes_back_with_its_traceback(doer):
    ((_, lost),) = list(Pool(1)(doer, jobs(1, "fail")))
    assert lost.status is Status.CRASHED
    assert "RuntimeError: number 0" in lost.message
    assert "in fail" in lost.bug


def test_what_a_worker_prints_does_not_reach_standard_output(doer, capfd):
    assert dict(Pool(1)(doer, jobs(3, "talk"))) == {(n, "talk"): n for n in range(3)}
    assert capfd.readouterr().out == ""


def test_outcomes_larger_than_a_pipe_get_through(doer):
    done = [outcome for _, outcome in Pool(2)(doer, jobs(40, "bulky"))]
    assert sorted(one[-1] for one in done) == list(range(40))


def test_workers_keep_their_libraries_to_one_thread(doer):
    assert {outcome for _, outcome in Pool(1)(doer, jobs(1, "threads"))} == {"1"}


def test_stopping_finishes_what_runs_and_starts_nothing_more(doer):
    done = []
    for job, _ in Pool(2)(doer, jobs(1000, "ten_ms"), lambda: len(done) >= 20):
        done.append(job[0])
    assert 20 <= len(done) < 40
    assert sorted(done) == list(range(len(done)))


def test_workers_that_cannot_begin_are_an_error_not_a_loop(doer, monkeypatch):
    monkeypatch.setattr(pools.worker_process, "WORKER_PROGRAM", "raise SystemExit(9)")
    with pytest.raises(CfmError, match=r"end before they begin \(exit code 9\)"):
        list(Pool(2)(doer, jobs(5)))


def test_no_process_and_no_pipe_is_left(doer):
    before, others = set(os.listdir("/dev/fd")), children()
    list(Pool(3)(doer, jobs(30)))
    assert set(os.listdir("/dev/fd")) == before
    assert children() <= others


def test_workers_end_when_their_parent_is_killed(doer, tmp_path):
    code = (
        f"import sys; sys.path.insert(0, {str(SUPPORT)!r})\n"
        "from study_work import Doer; from cfmkit.studies.pool import Pool\n"
        f"list(Pool(2)(Doer({str(tmp_path)!r}), ((n, 'sleep_after_mark') for n in range(2))))\n"
    )
    parent = subprocess.Popen([sys.executable, "-c", code])
    wait_until(lambda: len(list(tmp_path.iterdir())) == 2, 20)
    workers = [int(mark.name) for mark in tmp_path.iterdir()]
    parent.kill()
    parent.wait()
    wait_until(lambda: not any(alive(pid) for pid in workers), 5)
    assert not any(alive(pid) for pid in workers)


@pytest.mark.parametrize("kills", [25, pytest.param(300, marks=pytest.mark.slow)])
def test_random_kills_neither_hang_the_pool_nor_lose_a_job(doer, kills):
    """Every job has an outcome; only jobs struck twice are given up."""
    struck = 0
    finished = threading.Event()

    def strike():
        nonlocal struck
        chance = random.Random(kills)
        while struck < kills and not finished.is_set():
            time.sleep(chance.uniform(0.0, 0.3))
            if victims := sorted(children()):
                with contextlib.suppress(ProcessLookupError):  # one that has just ended
                    os.kill(chance.choice(victims), signal.SIGKILL)
                    struck += 1

    def source():
        number = 0
        while struck < kills and hunter.is_alive():
            yield number, "ten_ms"
            number += 1

    hunter = threading.Thread(target=strike)
    hunter.start()
    try:
        done = list(Pool(2)(doer, source()))
    finally:
        finished.set()
        hunter.join()
    assert struck == kills
    numbers = sorted(job[0] for job, _ in done)
    assert numbers == list(range(len(numbers)))
    given_up = [job for job, outcome in done if isinstance(outcome, Lost)]
    assert len(given_up) <= kills / 2
    assert all(outcome == job[0] for job, outcome in done if not isinstance(outcome, Lost))


def children():
    """Return the process ids of this process's workers."""
    found = set()
    for status in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = status.read_text().rpartition(")")[2].split()
        except OSError:
            continue
        if int(fields[1]) == os.getpid() and fields[0] != "Z":
            found.add(int(status.parent.name))
    return found


def alive(pid):
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False
