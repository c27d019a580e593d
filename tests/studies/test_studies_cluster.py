"""A real Dask scheduler with real workers on this machine."""

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import cfmkit
from cfmkit.errors import UsageError
from cfmkit.studies import serial_and_cluster_executors as executors
from cfmkit.studies.engine import Work, run
from cfmkit.studies.plan import grid
from cfmkit.studies.point_evaluation import Study, metrics_of
from cfmkit.studies.pool import Pool
from cfmkit.studies.serial_and_cluster_executors import Cluster, stamp_of
from cfmkit.studies.sweep_request_and_files import outputs, summary_of
from cfmkit.studies.variations import axes, parse_variation

distributed = pytest.importorskip("distributed", reason="Dask is not installed: pip install distributed")
pytestmark = pytest.mark.filterwarnings("ignore")

SPEC = cfmkit.load("configs/cam.yaml").replace({"analysis.points": 2001})


def work(count):
    plan = grid(axes(SPEC, [parse_variation(f"mechanism.profile.friction=0:0.002:{count}")]))
    return Work(Study(SPEC, plan.paths, metrics_of(SPEC, ("force_mean", "force_ripple"))), plan)


def values(records):
    return np.concatenate([rows.values for _, rows in records.batches()])


class Place:
    """A scheduler in a process of its own, and workers in others."""

    def __init__(self, folder):
        self.folder, self.file, self.workers = folder, folder / "scheduler.json", []
        options = ["--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--scheduler-file", str(self.file)]
        self.boss = self._start("dask_scheduler", *options)
        until(self.file.exists)
        self.address = json.loads(self.file.read_text())["address"]

    def _start(self, program, *options, **environment):
        command = [sys.executable, "-P", "-W", "ignore", "-m", f"distributed.cli.{program}", *options]
        nowhere = subprocess.DEVNULL
        return subprocess.Popen(
            command, stdout=nowhere, stderr=nowhere, env=os.environ | environment, cwd=self.folder
        )  # fmt: skip

    def add_worker(self, **environment):
        options = ["--scheduler-file", str(self.file), "--nthreads", "1", "--no-dashboard", "--host", "127.0.0.1"]
        options += ["--no-nanny", "--local-directory", str(self.folder)]
        self.workers.append(self._start("dask_worker", *options, **environment))

    def wait_for(self, count):
        with distributed.Client(self.address, timeout=30, set_as_default=False) as client:
            client.wait_for_workers(count, timeout=60)


@pytest.fixture
def place(tmp_path):
    place = Place(tmp_path)
    yield place
    for process in (*place.workers, place.boss):
        process.kill()
        process.wait()


@pytest.fixture
def scheduler(place):
    """Start a scheduler and two workers in processes of their own; yield its address and the workers."""
    place.add_worker()
    place.add_worker()
    place.wait_for(2)
    return place.address, place.workers


def test_a_cluster_gives_the_rows_of_one_process_though_a_worker_is_killed(scheduler):
    address, workers = scheduler
    many = work(300)

    records = run(many, Cluster(address), monitor=Killer(lambda: [workers[0].pid], 30))
    assert workers[0].poll() == -signal.SIGKILL
    assert np.array_equal(values(records), values(run(many)))


def written(records):
    """Return every file of the sweep but its pictures."""
    files = outputs(records, summary_of(records), curves=True)
    return {name: data if isinstance(data, bytes) else b"".join(data) for name, data in files}


@pytest.mark.parametrize("block", [False, True])
def test_a_local_cluster_gives_the_same_bytes_though_a_worker_of_it_is_killed(block):
    """Points one by one with failures, a choice and curves among them; or whole blocks of the vectorised model."""
    if block:
        spec = SPEC.replace({"analysis.points": 101, "mechanism.roller_radius": "8 mm"})
        asked = ("mechanism.springs.stiffness=0.4 N/mm:1 N/mm:60", "mechanism.brace_length=180 mm:240 mm:100")
    else:
        spec = SPEC
        asked = ("mechanism.brace_length=[60 mm, 200 mm, -1 mm]", "mechanism.rolling_friction=0:0.01:20")
        asked = (*asked, "analysis.gravity=[true, false]")
    names = ("force_mean", "force_ripple", "theoretical_force")
    plan = grid(axes(spec, [parse_variation(option) for option in asked]))
    many = Work(Study(spec, plan.paths, metrics_of(spec, names), curves=not block), plan)
    assert many.vectorised is block
    killer = Killer(workers_of_this_process, len(plan) // 10)
    assert written(run(many, Cluster("local", 2), monitor=killer)) == written(run(many)) == written(run(many, Pool(2)))
    assert killer.killed


def workers_of_this_process():
    """Return the processes of a local cluster's workers: the helpers that multiprocessing keeps are not among them."""
    import psutil

    below = psutil.Process().children(recursive=True)
    return [one.pid for one in below if "spawn_main" in " ".join(one.cmdline())]


class Killer:
    """A monitor that kills the first worker once so many points are done."""

    def __init__(self, workers, after, kill=True):
        self.workers, self.after, self.kill, self.count, self.killed = workers, after, kill, 0, 0

    def total(self, points): ...

    def add_finished(self, points, failed, reused):
        self.count += points
        if self.count >= self.after and not self.killed:
            self.killed = self.workers()[0] or True
            if self.kill:
                os.kill(self.killed, signal.SIGKILL)

    def stopping(self):
        return False


# ---- whose numbers


@pytest.fixture
def other_code(tmp_path):
    """A copy of the package in which one number is another one."""
    shutil.copytree(
        Path(cfmkit.__file__).parent, tmp_path / "copy/cfmkit", ignore=shutil.ignore_patterns("__pycache__")
    )
    with (tmp_path / "copy/cfmkit/families/cam/statics.py").open("a") as file:
        file.write("\nCHANGED = 1\n")
    return str(tmp_path / "copy")


def test_a_worker_with_other_code_is_refused_by_name_before_anything_is_computed(place, other_code):
    place.add_worker()
    place.add_worker(PYTHONPATH=other_code)
    place.wait_for(2)
    watch = Killer(lambda: pytest.fail("a point was computed"), 1)
    with pytest.raises(
        UsageError, match=r"the worker tcp://127\.0\.0\.1:\d+ has other code: content \w+ inst"
    ) as caught:
        run(work(20), Cluster(place.address), monitor=watch)
    assert caught.value.exit_code == 2
    assert len(str(caught.value).splitlines()) == 1


def test_a_worker_with_other_code_that_joins_later_computes_nothing(place, other_code):
    place.add_worker()
    place.wait_for(1)
    rows = Killer(lambda: [place.add_worker(PYTHONPATH=other_code)], 3, kill=False)
    with pytest.raises(UsageError, match=r"the worker tcp://127\.0\.0\.1:\d+ on \S+ has other code: content"):
        run(work(100_000), Cluster(place.address), monitor=rows)
    assert rows.count >= 3


def test_other_libraries_are_other_code(monkeypatch):
    monkeypatch.setattr(executors, "_worker_name", lambda: "w")
    executors._stamp_of_worker.cache_clear()
    theirs = dict(stamp_of("cam")) | {"numpy": "1.0"}
    outcome = executors.do_parcel(theirs, "cam", b"not even read")
    assert (outcome.worker, outcome.stamp) == ("w", stamp_of("cam"))
    assert set(theirs) >= {"cfmkit", "content", "python", "numpy", "scipy"}


# ---- who is not there


def test_no_workers_for_a_stated_time_end_a_study(place, monkeypatch):
    monkeypatch.setattr(executors, "WORKERS_WITHIN", 1)
    with pytest.raises(UsageError, match=rf"{place.address}: no worker for 1 s; start some with 'dask worker tcp"):
        run(work(2), Cluster(place.address))


def test_workers_that_all_leave_end_a_study(place, monkeypatch):
    place.add_worker()
    place.wait_for(1)
    monkeypatch.setattr(executors, "WORKERS_WITHIN", 2)
    with pytest.raises(UsageError, match=r"no worker for 2 s; .*; what is finished is kept"):
        run(work(100_000), Cluster(place.address), monitor=Killer(lambda: [place.workers[0].pid], 3))


def test_a_scheduler_that_dies_ends_a_study_in_one_line(place, capfd):
    place.add_worker()
    place.wait_for(1)
    with pytest.raises(UsageError, match=r"the Dask scheduler has gone; what is finished is kept") as caught:
        run(work(100_000), Cluster(place.address), monitor=Killer(lambda: [place.boss.pid], 3))
    assert len(str(caught.value).splitlines()) == 1
    assert capfd.readouterr() == ("", "")


def test_a_scheduler_that_is_not_there_is_told(monkeypatch):
    monkeypatch.setattr("cfmkit.studies.serial_and_cluster_executors.CONNECT_WITHIN", 1)
    with pytest.raises(UsageError, match="no Dask scheduler answers"):
        run(work(2), Cluster("tcp://127.0.0.1:9"))


@pytest.mark.parametrize("address", ["nonsense", "tcp://", "tcp://host", "", "local:", "a b:1"])
def test_what_is_no_address_is_refused_before_dask_tries(address, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(UsageError, match=r"is not an address; write e\.g\. tcp://host:8786, or local"):
        run(work(2), Cluster(address))


def test_without_dask_the_cure_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(UsageError, match=r"pip install distributed"):
        run(work(2), Cluster("local"))


def until(condition, seconds=60):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "it did not happen in time"
        time.sleep(0.05)
