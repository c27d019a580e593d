"""A run that is killed or refused by the disk leaves the old set of files or the new one.

Every change to the disk goes through `cfmkit.store.safe_disk_changes.system`. Here it is
replaced by one that counts the changes and, at a chosen one, fails or kills the
process. As a program (``python test_store_faults.py FOLDER [double]``) this file
does the killing, in forked children of a process without threads.
"""

import errno
import itertools
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from cfmkit.errors import CfmError, OutputError
from cfmkit.store import Manifest, RunFolder, atomic_write, safe_disk_changes

CHANGES = ("open", "write", "ftruncate", "fsync", "close", "replace", "link", "unlink", "mkdir", "rmdir")

FOREIGN = {"notes.txt": b"mine", "figures/mine.png": b"mine"}
BEFORE = {
    "a.csv": b"old a",
    "design.yaml": b"old design",
    "figures/loop.png": b"old loop",
    "gone.csv": b"old, not written again",
    "only/old/x.csv": b"old, not written again",
}
EDITED = {"design.yaml": b"edited by the user"}
AFTER = {
    "a.csv": b"new a" * 1000,
    "design.yaml": b"new design",
    "figures/loop.png": b"new loop",
    "figures/force.png": b"new",
    "geometry/cut/cam.dxf": b"new",
}
OLD = FOREIGN | BEFORE | EDITED
NEW = FOREIGN | AFTER | {"design.edited.yaml": EDITED["design.yaml"]}


class System:
    """The `os` module, of which some calls go wrong; `wrong(count)` says at which change."""

    def __init__(self, wrong, action):
        self.count = 0
        self.wrong, self.action = wrong, action

    def __getattr__(self, name):
        function = getattr(os, name)
        return function if name not in CHANGES else lambda *arguments: self.change(name, function, arguments)

    def change(self, name, function, arguments):
        self.count += 1
        if self.wrong(self.count):
            self.last = name
            if name == "close":
                function(*arguments)
            if name == "write":
                function(arguments[0], arguments[1][: len(arguments[1]) // 2])
            self.action()
        return function(*arguments)


def failing(code):
    def fail():
        raise OSError(code, os.strerror(code))

    return fail


def die():
    os.kill(os.getpid(), signal.SIGKILL)


def prepare(path):
    """Leave the folder as the run before and the user did."""
    shutil.rmtree(path, ignore_errors=True)
    with RunFolder(path) as folder:
        for name, data in BEFORE.items():
            folder.write(name, data)
        folder.commit({"label": "old"})
    for name, data in (EDITED | FOREIGN).items():
        (path / name).parent.mkdir(exist_ok=True)
        (path / name).write_bytes(data)


def new_run(path):
    with RunFolder(path) as folder:
        folder.check(*AFTER)
        for name, data in AFTER.items():
            folder.write(name, [data[:2], data[2:]])
        folder.commit({"label": "new"})


def files(path):
    """Return every file that a user sees, without the manifest."""
    found = {str(item.relative_to(path)): item for item in path.rglob("*") if item.is_file()}
    return {name: item.read_bytes() for name, item in found.items() if not name.startswith((".cfmkit", "manifest."))}


def assert_whole_files(path):
    """Every file is the old one or the new one, or not there where one of the sets has none."""
    found = files(path)
    for name, data in found.items():
        assert data in (OLD.get(name), NEW.get(name)), f"{name} is torn: {data!r}"
    assert found.keys() >= OLD.keys() & NEW.keys()
    json.loads((path / "manifest.json").read_bytes())


def which_set(path):
    """Return which complete set is in the folder; files and manifest must agree."""
    manifest = Manifest.read(path)
    label = manifest.data["label"]
    assert files(path) == {"old": OLD, "new": NEW}[label]
    assert manifest.files.keys() == {"old": BEFORE, "new": AFTER}[label].keys()
    assert manifest.mismatches(path) == (("design.yaml",) if label == "old" else ())
    return label


def recovered_set(path, *, tidy=True):
    """Return which set is there after another run has looked, and check that no litter is left.

    Where a folder could not be removed, an empty one may be.
    """
    with RunFolder(path):
        pass
    assert [item.name for item in path.rglob(".cfmkit*")] == []
    empty = [item for item in path.rglob("*") if item.is_dir() and not any(item.iterdir())]
    assert empty == [] or not tidy
    return which_set(path)


def no_sync(_descriptor):
    """Stand in for `os.fsync`: a killed process loses nothing that it handed to the system."""


@pytest.fixture(autouse=True)
def quick_disk(monkeypatch):
    """Spend the time on many faults, not on waiting for the disk; the calls are still counted."""
    monkeypatch.setattr(os, "fsync", no_sync)


@pytest.fixture
def out(tmp_path):
    path = tmp_path / "out"
    prepare(path)
    return path


def attempt(path, monkeypatch, wrong, action):
    """Run with faults; return the system and the error, if there was one."""
    system = System(wrong, action)
    with monkeypatch.context() as patch:
        patch.setattr(safe_disk_changes, "system", system)
        try:
            new_run(path)
        except CfmError as error:
            return system, error
    return system, None


def steps(path, monkeypatch):
    """Return how many changes a run makes."""
    system, error = attempt(path, monkeypatch, lambda _count: False, None)
    assert error is None
    assert which_set(path) == "new"
    return system.count


def test_a_run_without_faults_goes_from_the_old_set_to_the_new(out, monkeypatch):
    assert which_set(out) == "old"
    assert steps(out, monkeypatch) > 80
    assert recovered_set(out) == "new"


# ---- errors of the disk


@pytest.mark.parametrize("code", [errno.ENOSPC, errno.EIO, errno.EROFS])
def test_an_error_at_any_single_change_is_an_output_error_and_the_old_files_are_intact(out, monkeypatch, code):
    outcomes = set()
    for step in range(1, steps(out, monkeypatch) + 1):
        prepare(out)
        system, error = attempt(out, monkeypatch, lambda count, step=step: count == step, failing(code))
        # Without an error the run was over but for its hidden leftovers: a success, and a whole one.
        label = which_set(out)
        assert label == ("new" if error is None else "old"), f"step {step}"
        if error is not None:
            assert isinstance(error, OutputError)
            assert "\n" not in str(error)
            assert safe_disk_changes._ERROR_REASONS[code] in str(error)
            assert str(out) in str(error)
        assert recovered_set(out, tidy=system.last != "rmdir") == label
        outcomes.add(label)
    assert outcomes == {"old", "new"}


@pytest.mark.parametrize("code", [errno.ENOSPC, errno.EIO, errno.EROFS])
def test_a_disk_that_fails_from_some_change_on_leaves_whole_files_and_one_set_for_the_next_run(out, monkeypatch, code):
    half_way = 0
    for step in range(1, steps(out, monkeypatch) + 1):
        prepare(out)
        _, error = attempt(out, monkeypatch, lambda count, step=step: count >= step, failing(code))
        assert_whole_files(out)
        if error is None:
            assert which_set(out) == "new"
        else:
            assert isinstance(error, OutputError)
            half_way += "the next run into it repairs it" in str(error)
        label = recovered_set(out, tidy=False)
        assert label == "new" if error is None else label in ("old", "new")
    assert half_way > 0


def test_a_full_disk_where_renaming_still_works_always_leaves_the_old_files(out, monkeypatch):
    """What ENOSPC really looks like: nothing grows any more, but names can still change."""
    growing = ("open", "write", "mkdir", "link", "fsync")
    for step in range(1, steps(out, monkeypatch) + 1):
        prepare(out)
        system = System(lambda _count: False, failing(errno.ENOSPC))
        real = system.change

        def change(name, function, arguments, *, real=real, system=system, step=step):
            system.wrong = lambda count: count >= step and name in growing
            return real(name, function, arguments)

        system.change = change
        with monkeypatch.context() as patch:
            patch.setattr(safe_disk_changes, "system", system)
            try:
                new_run(out)
            except OutputError:
                expected = "old"
            else:
                expected = "new"
        assert which_set(out) == expected, f"step {step}"
        assert recovered_set(out) == expected


def test_two_errors_leave_one_set_for_the_next_run(out, monkeypatch):
    """The second error hits the clearing up after the first."""
    count = steps(out, monkeypatch)
    for first, distance in itertools.product(range(1, count + 1, 5), (1, 2, 3, 5, 8, 13, 21)):
        prepare(out)
        wrong = {first, first + distance}
        _, error = attempt(out, monkeypatch, lambda count, wrong=wrong: count in wrong, failing(errno.EIO))
        assert error is None or isinstance(error, OutputError)
        assert_whole_files(out)
        label = recovered_set(out, tidy=False)
        assert label == "new" if error is None else label in ("old", "new")


def test_an_error_while_repairing_is_an_output_error_and_the_next_run_repairs(out, monkeypatch):
    count = steps(out, monkeypatch)
    repairs = 0
    for first in range(count // 2, count + 1, 6):
        for second in range(1, 40):
            prepare(out)
            attempt(out, monkeypatch, lambda count, first=first: count >= first, failing(errno.EROFS))
            if not any((out / ".cfmkit-run" / name).exists() for name in ("plan.json", "undo.json")):
                break
            system, error = attempt(out, monkeypatch, lambda count, second=second: count == second, failing(errno.EIO))
            assert error is None or isinstance(error, OutputError)
            assert recovered_set(out, tidy=False) in ("old", "new")
            repairs += system.count >= second
    assert repairs > 50


def test_a_file_system_without_links_gets_copies(out, monkeypatch):
    class NoLinks(System):
        def change(self, name, function, arguments):
            if name == "link":
                raise OSError(errno.EPERM, "no links here")
            return super().change(name, function, arguments)

    for step in (*range(30, 120, 7), 10_000):
        prepare(out)
        with monkeypatch.context() as patch:
            patch.setattr(
                safe_disk_changes, "system", NoLinks(lambda count, step=step: count == step, failing(errno.EIO))
            )
            try:
                new_run(out)
            except OutputError:
                assert which_set(out) == "old"
            else:
                assert which_set(out) == "new"
    assert recovered_set(out) == "new"


def test_a_user_who_edits_between_kill_and_repair_loses_nothing(out, monkeypatch):
    """The half-done commit is not finished over a file that nobody knows."""
    names = []
    for step in range(1, steps(out, monkeypatch) + 1):
        prepare(out)
        attempt(out, monkeypatch, lambda count, step=step: count >= step, failing(errno.EROFS))
        if not (out / ".cfmkit-run" / "plan.json").exists() or (out / "a.csv").read_bytes() != BEFORE["a.csv"]:
            continue
        (out / "a.csv").unlink()
        (out / "a.csv").write_bytes(b"precious")
        with (
            pytest.raises(OutputError, match=r"a\.csv was changed while a run was replacing it; move it away"),
            RunFolder(out),
        ):
            pass
        assert (out / "a.csv").read_bytes() == b"precious"
        (out / "a.csv").rename(out.parent / "moved")
        assert recovered_set(out) == "new"
        names.append(step)
    assert names


def test_everything_is_on_the_disk_before_the_commit_and_before_the_plan_goes(out, monkeypatch):
    """A power cut keeps what was synced: files, then the names of files, then what depends on them."""
    opened, events = {}, []

    class Recording(System):
        def change(self, name, function, arguments):
            result = super().change(name, function, arguments)
            if name == "open":
                opened[result] = Path(arguments[0])
            subject = arguments[name in ("replace", "link")]
            events.append((name, opened[subject] if isinstance(subject, int) else Path(subject)))
            return result

    with monkeypatch.context() as patch:
        patch.setattr(safe_disk_changes, "system", Recording(lambda _count: False, None))
        new_run(out)
    working = out.resolve() / ".cfmkit-run"
    commit = events.index(("replace", working / "plan.json"))
    finished = events.index(("unlink", working / "plan.json"))
    synced = {path for name, path in events[:commit] if name == "fsync"}
    staged = {working / "new" / name for name in (*AFTER, "manifest.json")}
    assert staged <= synced
    assert {folder for path in staged for folder in path.parents if working in folder.parents} <= synced
    assert {out, working, working / "new", working / "old"} <= synced
    assert events.index(("fsync", working), commit) < events.index(("replace", out / "a.csv"))
    placed = [path for name, path in events[commit:finished] if name == "replace"]
    assert placed[-1] == out / "manifest.json"
    last = {path: index for index, (name, path) in enumerate(events) if name == "replace"}
    for folder in {path.parent for path in placed[1:]}:
        syncs = [index for index, event in enumerate(events) if event == ("fsync", folder)]
        newest = max(index for path, index in last.items() if path.parent == folder)
        assert any(newest < index < finished for index in syncs)


# ---- kills


def kill_everywhere(path, double):
    """Kill a run before each of its changes, and if `double` the repair as well; print what was seen."""
    os.fsync = no_sync
    seen = {"old": 0, "new": 0, "kills": 0}
    for first in itertools.count(1, 7 if double else 1):
        for second in itertools.count(1) if double else (None,):
            prepare(path)
            if not killed(path, new_run, first):
                print(json.dumps(seen))
                return
            assert_whole_files(path)
            if second is not None:
                if not killed(path, recovered_set, second):
                    break
                assert_whole_files(path)
            seen[recovered_set(path)] += 1
            seen["kills"] += 1


def killed(path, work, step):
    """Work in a child that dies before the given change; return whether it came so far."""
    child = os.fork()
    if child == 0:
        safe_disk_changes.system = System(lambda count: count == step, die)
        try:
            work(path)
        except BaseException:
            os._exit(1)
        os._exit(0)
    _, status = os.waitpid(child, 0)
    assert os.WIFSIGNALED(status) or os.waitstatus_to_exitcode(status) == 0
    return os.WIFSIGNALED(status)


@pytest.mark.parametrize("double", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_a_run_killed_before_any_change_leaves_one_whole_set(tmp_path, double):
    command = [sys.executable, __file__, str(tmp_path / "out"), *(["double"] if double else [])]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    seen = json.loads(done.stdout)
    assert seen["kills"] > (400 if double else 80)
    assert seen["old"] > 40
    assert seen["new"] > 20


ENDLESS = """
import itertools, random, sys
from cfmkit.store import RunFolder
choose = random.Random(int(sys.argv[2]))
for count in itertools.count():
    with RunFolder(sys.argv[1]) as folder:
        for name in ("a.csv", "b.csv", "figures/c.png", "d/e/f.dxf"):
            if choose.random() < 0.7:
                folder.write(name, f"{count} {name}".encode() * 5000)
        folder.commit({"count": count})
    print(count, flush=True)
"""


def test_a_run_killed_at_any_time_leaves_one_whole_set(tmp_path):
    choose = random.Random(0)
    out = tmp_path / "out"
    out.mkdir()
    (out / "mine.txt").write_bytes(b"mine")
    for seed in range(25):
        with subprocess.Popen([sys.executable, "-c", ENDLESS, str(out), str(seed)], stdout=subprocess.PIPE) as process:
            process.stdout.readline()
            time.sleep(choose.uniform(0, 0.05))
            process.kill()
        with RunFolder(out) as folder:
            manifest = folder.previous
        assert manifest.mismatches(out) == ()
        expected = {name: f"{manifest.data['count']} {name}".encode() * 5000 for name in manifest.files}
        assert files(out) == expected | {"mine.txt": b"mine"}


def test_a_file_whose_writer_is_killed_at_any_change_is_the_old_or_the_new_one(tmp_path):
    path = tmp_path / "a"
    code = (
        "import sys; sys.path.insert(0, sys.argv[2]); from test_store_faults import *\n"
        "for step in itertools.count(1):\n"
        "    Path(sys.argv[1]).write_bytes(b'old')\n"
        "    if not killed(Path(sys.argv[1]), lambda path: atomic_write(path, b'new'), step): break\n"
        "    print(Path(sys.argv[1]).read_bytes().decode())\n"
    )
    command = [sys.executable, "-c", code, str(path), str(Path(__file__).parent)]
    shown = subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()
    assert shown == ["old"] * shown.count("old") + ["new"] * shown.count("new")
    assert shown.count("old") >= 5
    assert shown.count("new") >= 1
    atomic_write(path, b"again")
    assert path.read_bytes() == b"again"


# ---- a disk that really is full


@pytest.fixture
def small_disk(tmp_path):
    """A file system of 512 kB of its own."""
    if not hasattr(os, "geteuid") or os.geteuid() != 0 or shutil.which("mount") is None:
        pytest.skip("only root may mount a small file system")
    path = tmp_path / "disk"
    path.mkdir()
    done = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=512k", "tmpfs", str(path)], capture_output=True, text=True, check=False
    )
    if done.returncode:
        pytest.skip(f"no small file system can be mounted here: {done.stderr.strip()}")
    yield path
    subprocess.run(["umount", str(path)], check=True)


def test_a_full_disk_is_an_output_error_and_the_old_files_are_intact(small_disk):
    outcomes = []
    for free in range(0, 60_000, 4096):
        out = small_disk / "out"
        prepare(out)
        spare = os.statvfs(small_disk)
        with (small_disk / "filler").open("wb") as filler:
            filler.write(b"\0" * max(0, spare.f_bavail * spare.f_bsize - free))
        try:
            new_run(out)
        except OutputError as error:
            outcomes.append("old" if "the disk is full" in str(error) else str(error))
        else:
            outcomes.append("new")
        assert which_set(out) == outcomes[-1]
        (small_disk / "filler").unlink()
        assert recovered_set(out) == outcomes[-1]
    assert outcomes == sorted(outcomes, reverse=True)
    assert set(outcomes) == {"old", "new"}


def test_a_folder_on_a_read_only_disk_is_an_output_error(small_disk):
    prepare(small_disk / "out")
    subprocess.run(["mount", "-o", "remount,ro", str(small_disk)], check=True)
    for path in (small_disk / "out", small_disk / "another"):
        with pytest.raises(OutputError, match="the file system is read-only"):
            new_run(path)
    assert which_set(small_disk / "out") == "old"


if __name__ == "__main__":
    kill_everywhere(Path(sys.argv[1]), double="double" in sys.argv)
