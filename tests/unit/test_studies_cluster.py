"""A real Dask scheduler with real workers on this machine."""

import json
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

import cfmkit
from cfmkit.errors import UsageError
from cfmkit.studies.choose_metrics_to_note import metrics_of
from cfmkit.studies.engine import Work, run
from cfmkit.studies.plan import grid
from cfmkit.studies.point_evaluation import Study
from cfmkit.studies.pool import Pool
from cfmkit.studies.serial_and_cluster_executors import Cluster
from cfmkit.studies.sweep_request_and_files import outputs, summary_of
from cfmkit.studies.varied_axes import axes, wish

distributed = pytest.importorskip("distributed", reason="Dask is not installed: pip install 'cfmkit[cluster]'")
pytestmark = pytest.mark.filterwarnings("ignore")

SPEC = cfmkit.load("configs/cam.yaml").replace({"analysis.points": 2001})


def work(count):
    plan = grid(axes(SPEC, [wish(f"mechanism.profile.friction=0:0.002:{count}")]))
    return Work(Study(SPEC, plan.paths, metrics_of(SPEC, ("force_mean", "force_ripple"))), plan)


def values(records):
    return np.concatenate([rows.values for _, rows in records.batches()])


@pytest.fixture
def scheduler(tmp_path):
    """Start a scheduler and two workers in processes of their own; yield its address and the workers."""
    place = tmp_path / "scheduler.json"
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    module = [sys.executable, "-W", "ignore", "-m"]
    options = ["--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--scheduler-file", str(place)]
    boss = subprocess.Popen([*module, "distributed.cli.dask_scheduler", *options], **quiet)
    serve = ["--scheduler-file", str(place), "--nthreads", "1", "--no-dashboard", "--host", "127.0.0.1"]
    serve += ["--no-nanny", "--local-directory", str(tmp_path)]
    workers = [subprocess.Popen([*module, "distributed.cli.dask_worker", *serve], **quiet) for _ in range(2)]
    try:
        until(place.exists)
        address = json.loads(place.read_text())["address"]
        with distributed.Client(address, timeout=30, set_as_default=False) as client:
            client.wait_for_workers(2, timeout=60)
        yield address, workers
    finally:
        for process in (*workers, boss):
            process.kill()
            process.wait()


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
    plan = grid(axes(spec, [wish(option) for option in asked]))
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

    def __init__(self, workers, after):
        self.workers, self.after, self.count, self.killed = workers, after, 0, 0

    def total(self, points): ...

    def done(self, points, failed, reused):
        self.count += points
        if self.count >= self.after and not self.killed:
            self.killed = self.workers()[0]
            os.kill(self.killed, signal.SIGKILL)

    def stopping(self):
        return False


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
    with pytest.raises(UsageError, match=r"pip install 'cfmkit\[cluster\]'"):
        run(work(2), Cluster("local"))


def until(condition, seconds=60):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "it did not happen in time"
        time.sleep(0.05)
