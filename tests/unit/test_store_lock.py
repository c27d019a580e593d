"""One live run per folder; the lock dies with it and with nothing else."""

import multiprocessing
import os
import subprocess
import sys
import threading
from types import SimpleNamespace

import pytest
from store_support import INFO, enter_and_leave, listing, one_line, run

from cfmkit.errors import FolderInUse, OutputError
from cfmkit.store import RunFolder, lock, safe_disk_changes

# ---- the lock


HOLDER = """
import sys, time
from cfmkit.store import RunFolder
with RunFolder(sys.argv[1]) as folder:
    folder.write("a.csv", b"from the other process")
    print("locked", flush=True)
    sys.stdin.readline()
    folder.commit({})
"""


@pytest.fixture
def holder(tmp_path):
    """Another process that has the folder, and commits when it gets a line."""
    command = [sys.executable, "-c", HOLDER, str(tmp_path / "out")]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        assert process.stdout.readline() == b"locked\n"
        yield process
        process.kill()


@pytest.fixture
def waits(monkeypatch):
    """How long the lock sleeps each time [s], by a clock that only its sleep moves."""
    found = []
    clock = SimpleNamespace(monotonic=lambda: sum(found), sleep=found.append)
    monkeypatch.setattr(lock, "time", clock)
    return found


def test_a_folder_that_another_run_has_is_refused_at_once_with_its_process(tmp_path, holder, waits):
    patience = threading.Timer(60, holder.kill)  # a run that waits for the other one gets the folder, and no refusal
    patience.start()
    with pytest.raises(FolderInUse, match=rf"out is in use by a live run \(process {holder.pid}\)") as caught:
        run(tmp_path / "out", a_csv=b"x")
    patience.cancel()
    assert waits == []
    assert caught.value.exit_code == 8
    assert one_line(caught)
    holder.communicate(b"\n")
    assert holder.returncode == 0
    assert (tmp_path / "out" / "a.csv").read_bytes() == b"from the other process"


def test_the_lock_dies_with_its_owner(tmp_path, holder):
    holder.kill()
    holder.wait()
    assert (tmp_path / "out" / ".cfmkit.lock").exists()
    run(tmp_path / "out", b_csv=b"1")
    assert listing(tmp_path / "out") == ["b.csv", "manifest.json"]


def test_two_runs_in_one_process_conflict_and_the_first_keeps_its_lock(tmp_path):
    with RunFolder(tmp_path / "out"):
        (tmp_path / "alias").symlink_to("out")
        for path in ("out", "alias"):
            with pytest.raises(FolderInUse, match=f"process {os.getpid()}"), RunFolder(tmp_path / path):
                pass
        command = [sys.executable, "-c", HOLDER, str(tmp_path / "out")]
        other = subprocess.run(command, input=b"\n", capture_output=True, check=False)
        assert b"FolderInUse" in other.stderr
        assert f"process {os.getpid()}".encode() in other.stderr
    run(tmp_path / "out", a_csv=b"1")


def test_other_folders_are_free(tmp_path):
    with RunFolder(tmp_path / "a"):
        run(tmp_path / "b", x_csv=b"1")
    assert (tmp_path / "b" / "x.csv").exists()


FORKER = """
import os, sys
from cfmkit.store import RunFolder
with RunFolder(sys.argv[1]) as folder:
    child = os.fork()
    if child == 0:
        try:
            with RunFolder(sys.argv[1]): print("child got in")
        except BaseException as error: print(type(error).__name__, flush=True)
        try:
            folder.write("x", b"")
        except BaseException as error: print(type(error).__name__, flush=True)
        sys.exit()   # leaves the with block in the child
    os.waitpid(child, 0)
    print(sorted(os.listdir(sys.argv[1])), flush=True)
    if os.fork() == 0:
        import time
        os.close(1); os.close(2)
        time.sleep(20)
        os._exit(0)
    os._exit(0)      # the owner dies, its second child lives on
"""


def test_a_forked_worker_neither_drops_nor_keeps_the_lock(tmp_path):
    shown = subprocess.run([sys.executable, "-c", FORKER, str(tmp_path)], capture_output=True, text=True, check=True)
    assert shown.stdout.splitlines() == ["FolderInUse", "CfmError", "['.cfmkit.lock']"]
    run(tmp_path, a_csv=b"1")
    assert listing(tmp_path) == ["a.csv", "manifest.json"]


def test_a_lock_file_without_a_signature_is_still_a_lock(tmp_path, waits):
    code = "import fcntl, sys; f = open(sys.argv[1], 'w'); fcntl.lockf(f, fcntl.LOCK_EX); print(1, flush=True); input()"
    command = [sys.executable, "-c", code, str(tmp_path / ".cfmkit.lock")]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        process.stdout.readline()
        patience = threading.Timer(60, process.kill)
        patience.start()
        with pytest.raises(FolderInUse, match="another process"), RunFolder(tmp_path):
            pass
        patience.cancel()
        assert 0 < sum(waits) < 1  # the owner may be about to sign
        process.communicate(b"\n")


def test_a_lock_file_that_loses_its_name_before_it_is_locked_is_not_a_lock(tmp_path, monkeypatch):
    """The end of another run removes the file between our opening and locking it."""
    real_open, opened = os.open, []

    class Racing:
        def __getattr__(self, name):
            return getattr(os, name)

        def open(self, path, *rest):
            descriptor = real_open(path, *rest)
            if str(path).endswith(lock.LOCK) and not opened:
                os.unlink(path)
            opened.append(path)
            return descriptor

    monkeypatch.setattr(safe_disk_changes, "system", Racing())
    with RunFolder(tmp_path):
        assert [path.name for path in opened] == [lock.LOCK, lock.LOCK]
        assert (tmp_path / lock.LOCK).read_text().split()[0] == str(os.getpid())


def test_a_lock_file_that_is_removed_during_the_run_stops_the_commit(tmp_path):
    run(tmp_path, a_csv=b"old")
    with RunFolder(tmp_path) as folder:
        folder.write("a.csv", b"new")
        (tmp_path / lock.LOCK).unlink()
        with pytest.raises(OutputError, match="was removed during the run"):
            folder.commit(INFO)
    assert (tmp_path / "a.csv").read_bytes() == b"old"


def test_the_end_of_a_run_does_not_remove_the_lock_of_another(tmp_path):
    with RunFolder(tmp_path):
        (tmp_path / lock.LOCK).unlink()
        (tmp_path / lock.LOCK).write_bytes(b"of another run")
    assert (tmp_path / lock.LOCK).read_bytes() == b"of another run"


def test_runs_that_come_and_go_never_trip_over_each_other(tmp_path):
    context = multiprocessing.get_context("spawn")
    entered = context.Value("i", 0)
    workers = [context.Process(target=enter_and_leave, args=(tmp_path / "a" / "out", 150, entered)) for _ in range(3)]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()
    assert [worker.exitcode for worker in workers] == [0, 0, 0]
    assert entered.value > 0
    # A run that did not create the folder leaves it, so it may be there; but it is empty.
    assert listing(tmp_path) in ([], ["a"], ["a", "a/out"])
