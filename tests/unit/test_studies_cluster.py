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
from cfmkit.studies.cluster import Cluster
from cfmkit.studies.columns import metrics_of
from cfmkit.studies.engine import Work, run
from cfmkit.studies.plan import grid
from cfmkit.studies.study import Study
from cfmkit.studies.variation import axes, wish

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

    class Killer:
        count = 0

        def total(self, points): ...

        def done(self, points, failed, reused):
            self.count += points
            if self.count == 30:
                os.kill(workers[0].pid, signal.SIGKILL)

        def stopping(self):
            return False

    records = run(many, Cluster(address), monitor=Killer())
    assert workers[0].poll() == -signal.SIGKILL
    assert np.array_equal(values(records), values(run(many)))


def test_a_local_cluster_gives_the_same_rows():
    many = work(20)
    assert np.array_equal(values(run(many, Cluster("local", 2))), values(run(many)))


def test_a_scheduler_that_is_not_there_is_told(monkeypatch):
    monkeypatch.setattr("cfmkit.studies.cluster.CONNECT_WITHIN", 1)
    with pytest.raises(UsageError, match="no Dask scheduler answers"):
        run(work(2), Cluster("tcp://127.0.0.1:9"))


def test_without_dask_the_cure_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(UsageError, match=r"pip install 'cfmkit\[cluster\]'"):
        run(work(2), Cluster("local"))


def until(condition, seconds=60):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "it did not happen in time"
        time.sleep(0.05)
