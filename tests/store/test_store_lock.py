"""One live run per folder; the lock dies with it and with nothing else."""

import errno
import multiprocessing
import os
import platform
import signal
import subprocess
import sys
import threading
from types import SimpleNamespace

import pytest
from store_support import INFO, enter_and_leave, listing, one_line, run

from cfmkit.errors import FolderInUse, OutputError
from cfmkit.store import RunFolder, lock, run_folder, safe_disk_changes

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
    code = "import filelock, sys; f = open(sys.argv[1], 'w'); filelock.lock_descriptor(f.fileno())"
    code += "; print(1, flush=True); input()"
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
            if str(path).endswith(lock.LOCK_NAME) and not opened:
                os.unlink(path)
            opened.append(path)
            return descriptor

    monkeypatch.setattr(safe_disk_changes, "system", Racing())
    with RunFolder(tmp_path):
        assert [path.name for path in opened] == [lock.LOCK_NAME, lock.LOCK_NAME]
        assert (tmp_path / lock.LOCK_NAME).read_text().split()[0] == str(os.getpid())


def test_a_lock_file_that_is_removed_during_the_run_stops_the_commit(tmp_path):
    run(tmp_path, a_csv=b"old")
    with RunFolder(tmp_path) as folder:
        folder.write("a.csv", b"new")
        (tmp_path / lock.LOCK_NAME).unlink()
        with pytest.raises(OutputError, match="was removed during the run"):
            folder.commit(INFO)
    assert (tmp_path / "a.csv").read_bytes() == b"old"


def test_the_end_of_a_run_does_not_remove_the_lock_of_another(tmp_path):
    with RunFolder(tmp_path):
        (tmp_path / lock.LOCK_NAME).unlink()
        (tmp_path / lock.LOCK_NAME).write_bytes(b"of another run")
    assert (tmp_path / lock.LOCK_NAME).read_bytes() == b"of another run"


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


# ---- file systems without locks


ENTER = "import sys; from cfmkit.store import RunFolder\nwith RunFolder(sys.argv[1]) as folder: folder.commit({})"
WITHOUT = {
    "no flock": "import errno, fcntl\ndef no(*_): raise OSError(errno.{code}, 'no')\nfcntl.flock = fcntl.lockf = no",
    "no fcntl": "import sys\nsys.modules['fcntl'] = None",
}


@pytest.fixture(params=["ENOSYS", "ENOLCK", "EOPNOTSUPP", "no fcntl"])
def program(request, tmp_path):
    """A program that has no locks: Lustre without `flock`, NFS without its lock service, a system without `fcntl`."""
    kind = "no fcntl" if request.param == "no fcntl" else "no flock"
    (tmp_path / "sitecustomize.py").write_text(WITHOUT[kind].format(code=request.param))

    def start(code, *arguments):
        return subprocess.Popen(
            [sys.executable, "-c", code, str(tmp_path / "out"), *arguments],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
            env=os.environ | {"PYTHONPATH": str(tmp_path)},
        )  # fmt: skip

    return start


def test_without_file_locks_a_file_marks_the_live_run_and_a_message_says_so(tmp_path, program):
    with program(HOLDER) as first:
        assert first.stdout.readline() == "locked\n"
        second = program(ENTER).communicate()[1]
        assert "FolderInUse" in second
        assert f"in use by a live run (process {first.pid}); if no run is there any more, remove" in second
        told = first.communicate("\n")[1]
    assert first.returncode == 0
    assert told.splitlines() == [
        f"warning  no file locks in {tmp_path}: the file .cfmkit.softlock marks a live run (--no-lock: none)"
    ]
    assert listing(tmp_path / "out") == ["a.csv", "manifest.json"]


def test_without_file_locks_the_mark_of_a_run_that_was_killed_is_taken_over(tmp_path, program):
    with program(HOLDER) as first:
        assert first.stdout.readline() == "locked\n"
        first.kill()
    assert lock.SOFT_LOCK in listing(tmp_path / "out")
    with program(ENTER) as second:
        second.communicate()
    assert second.returncode == 0
    assert listing(tmp_path / "out") == ["manifest.json"]


def test_without_file_locks_a_forked_worker_neither_drops_nor_keeps_the_mark(tmp_path, program):
    (tmp_path / "out").mkdir()
    with program(FORKER) as forker:
        shown = forker.communicate()[0]
    assert shown.splitlines() == ["FolderInUse", "CfmError", "['.cfmkit.softlock']"]
    with program(ENTER) as second:
        second.communicate()
    assert second.returncode == 0


@pytest.fixture
def no_locks(monkeypatch):
    monkeypatch.setattr(lock, "_try_to_lock", lambda _: None)


def test_without_file_locks_the_run_of_another_computer_is_believed_and_named(tmp_path, no_locks):
    (tmp_path / lock.SOFT_LOCK).write_text("4711\nelsewhere\n")
    with pytest.raises(FolderInUse, match=r"process 4711 on elsewhere\); if .* remove .*softlock or add --no-lock"):
        run(tmp_path, a_csv=b"1")
    (tmp_path / lock.SOFT_LOCK).unlink()
    run(tmp_path, a_csv=b"1")


def test_without_file_locks_two_runs_in_one_process_conflict(tmp_path, no_locks):
    with RunFolder(tmp_path) as folder:
        with pytest.raises(FolderInUse, match=f"process {os.getpid()}"), RunFolder(tmp_path):
            pass
        (tmp_path / lock.SOFT_LOCK).unlink()
        with pytest.raises(OutputError, match="was removed during the run"):
            folder.commit(INFO)


def test_no_lock_locks_nothing(tmp_path, monkeypatch):
    with RunFolder(tmp_path / "out"), lock.disable_locks():
        run(tmp_path / "out", a_csv=b"1")
        assert (tmp_path / "out" / lock.LOCK_NAME).exists()
    assert lock.NO_LOCK not in os.environ
    monkeypatch.setenv(lock.NO_LOCK, "1")
    with RunFolder(tmp_path / "out") as folder:
        assert not [*(tmp_path / "out").glob(".cfmkit*lock")]
        assert listing(tmp_path / "out") == ["a.csv", "manifest.json"]
        folder.commit(INFO)
    assert listing(tmp_path / "out") == ["manifest.json"]


# ---- Windows, as far as Linux can stand in for it


def test_a_lock_file_can_be_read_without_its_first_byte(tmp_path):
    """Windows lets no other process read the byte that is locked."""
    with RunFolder(tmp_path):
        text = (tmp_path / lock.LOCK_NAME).read_bytes()
    assert text[1:] == f"{os.getpid()} {platform.node()}\n".encode()


def test_a_system_that_opens_no_folders_and_has_no_pread_writes_a_run(tmp_path, monkeypatch):
    real_open = os.open

    def opened(path, *rest, **more):
        if os.path.isdir(path):
            raise PermissionError(errno.EACCES, "folders cannot be opened", path)
        return real_open(path, *rest, **more)

    for name in ("O_DIRECTORY", "O_NOFOLLOW", "pread", "pwrite"):
        monkeypatch.delattr(os, name)
    monkeypatch.delattr(signal, "pthread_sigmask")
    monkeypatch.setattr(os, "open", opened)
    run(tmp_path, a_csv=b"1", figures__x_png=b"2")
    run(tmp_path, a_csv=b"3")
    assert listing(tmp_path) == ["a.csv", "manifest.json"]


def test_no_process_is_asked_by_a_signal_whether_it_lives_where_that_would_reach_it(monkeypatch):
    """On Windows 0 is the number of Ctrl-C."""
    monkeypatch.setattr(os, "kill", lambda *_: pytest.fail("a signal was sent"))
    monkeypatch.setattr(run_folder.os, "name", "nt")
    assert not run_folder._is_alive(os.getpid())
