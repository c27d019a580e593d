"""A run that is told to stop says so, and leaves the folder as it found it."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time

import pytest

from cfmkit.cli.failures import Stopped
from cfmkit.cli.run_study_in_folder import open_journal
from cfmkit.store import RunFolder

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="POSIX signals")

LONG = ("analyze", "cam.yaml", "-o", "out", "--no-plots", "--set", "analysis.points=1000000")


def started(cli, *extra: str) -> subprocess.Popen[bytes]:
    """Start a run of many seconds and wait until it has its folder."""
    process = cli.start(*LONG, *extra)
    end = time.monotonic() + 60
    while not (cli.folder / "out/.cfmkit.lock").exists():
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < end
        time.sleep(0.01)
    return process


@pytest.mark.parametrize(
    ("number", "code", "reported"),
    [(signal.SIGINT, 130, b"error    interrupted\n"), (signal.SIGTERM, 143, b"error    terminated\n")],
)
def test_a_signal_ends_the_run_with_its_exit_code_and_no_trace(cli, cam, number, code, reported):
    process = started(cli)
    process.send_signal(number)
    out, err = process.communicate(timeout=60)
    assert (process.returncode, out, err) == (code, b"", reported)
    assert sorted(os.listdir(cli.folder)) == ["cam.yaml"]


def test_a_signal_leaves_the_files_of_the_run_before(cli, cam):
    assert cli(*LONG[:5]).code == 0
    before = {path.name: path.read_bytes() for path in (cli.folder / "out").iterdir()}
    process = started(cli)
    time.sleep(0.3)
    process.send_signal(signal.SIGTERM)
    process.communicate(timeout=60)
    assert process.returncode == 143
    assert {path.name: path.read_bytes() for path in (cli.folder / "out").iterdir()} == before


def test_a_killed_run_is_cleared_away_by_the_next(cli, cam):
    assert cli(*LONG[:5]).code == 0
    before = {path.name: path.read_bytes() for path in (cli.folder / "out").iterdir() if path.name != "manifest.json"}
    process = started(cli)
    time.sleep(0.3)
    process.kill()
    process.communicate(timeout=60)
    assert cli(*LONG[:5]).code == 0
    after = {path.name: path.read_bytes() for path in (cli.folder / "out").iterdir() if path.name != "manifest.json"}
    assert after == before


def test_an_interrupted_run_is_a_json_document_too(cli, cam):
    process = started(cli, "--json")
    process.send_signal(signal.SIGINT)
    out, _ = process.communicate(timeout=60)
    assert process.returncode == 130
    assert b'"status": "interrupted"' in out
    assert b'"exit_code": 130' in out


AT_LINE = """
import signal, sys
from pathlib import Path
from cfmkit.cli import main
from cfmkit.cli.failures import Stopped
from cfmkit.store import RunFolder

number, first, stride, root = int(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]), Path(sys.argv[4])
place = root / "out"

def write(version):
    with RunFolder(place) as folder:
        for name in ("a.csv", "sub/b.csv"):
            folder.write(name, f"{name} {version}".encode())
        folder.commit({})

def listed():
    return {path.relative_to(place).as_posix() for path in place.rglob("*") if path.is_file()}

def interrupted(count, version):
    # a signal at the count-th line of the store; -1 if there are fewer
    left = count
    def trace(frame, event, _argument):
        nonlocal left
        if "/cfmkit/store/" not in frame.f_code.co_filename:
            return None
        left -= event in ("call", "line")
        if left == 0:
            sys.settrace(None)
            where.append(f"{frame.f_code.co_name} {event} {frame.f_lineno - frame.f_code.co_firstlineno}")
            signal.raise_signal(number)
        return trace
    where = []
    main._catch_signals()
    sys.settrace(trace)
    try:
        write(version)
    except Stopped:
        pass
    finally:
        sys.settrace(None)
    return where[0] if where else None

write(0)
content = "a.csv 0"
count, version = first, 0
while True:
    version += 1
    where = interrupted(count, version)
    if where is None:
        break
    if where in ("__exit__ call 0", "__exit__ line 4"):  # before its first statement: see the next test
        import atexit
        atexit._run_exitfuncs()
    assert listed() == {"a.csv", "sub/b.csv", "manifest.json"}, (where, count, listed())
    found = [(place / name).read_text().rpartition(" ")[2] for name in ("a.csv", "sub/b.csv")]
    assert len(set(found)) == 1, (where, count, found)
    count += stride
print(count)
"""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize(
    ("first", "stride"), [(1, 17), *(pytest.param(k, 8, marks=pytest.mark.slow) for k in range(1, 9))]
)
def test_a_signal_at_any_line_of_the_store_leaves_all_files_of_one_run_and_nothing_else(
    tmp_path, number, first, stride
):
    """Two seconds: every 17th of some thousand lines; every line in the slow tests."""
    command = [sys.executable, "-c", AT_LINE, str(int(number)), str(first), str(stride), str(tmp_path)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=600, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert int(done.stdout) > 500


AT_EXIT = """
import signal, sys
from cfmkit.store import RunFolder

def trace(frame, event, _argument):
    if frame.f_code.co_name == "__exit__" and frame.f_code.co_filename.endswith("run_folder.py"):
        sys.settrace(None)
        signal.raise_signal(signal.SIGTERM)

from cfmkit.cli import main
sys.settrace(trace)
sys.exit(main.main(sys.argv[1:]))
"""


def test_a_signal_between_commit_and_the_end_leaves_no_lock(cli, cam):
    command = [sys.executable, "-c", AT_EXIT, *LONG[:5]]
    done = subprocess.run(command, capture_output=True, text=True, timeout=100, check=False, cwd=cli.folder)
    assert (done.returncode, done.stderr) == (143, "error    terminated\n")
    assert (cli.folder / "out/manifest.json").exists()
    assert not [name for name in os.listdir(cli.folder / "out") if name.startswith(".cfmkit")]


@pytest.mark.slow  # 40 runs
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_at_any_time_of_a_run_shows_no_traceback_and_leaves_nothing_half_written(cli, cam, number):
    """From its first line on; when Python takes itself down at the end, the system ends it by the signal."""
    begin = "import os, sys; from cfmkit.__main__ import entry; os.write(1, b'.'); sys.exit(entry())"
    command = [sys.executable, "-c", begin, *LONG[:5]]
    began = time.monotonic()
    subprocess.run(command, capture_output=True, check=True, cwd=cli.folder)
    whole = time.monotonic() - began
    names = set(os.listdir(cli.folder / "out"))
    for share in range(20):
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=cli.folder)
        assert process.stdout is not None
        assert process.stdout.read(1) == "."
        time.sleep(whole * share / 18)
        process.send_signal(number)
        out, err = process.communicate(timeout=60)
        assert "Traceback" not in out + err
        assert process.returncode in (0, 128 + number, -number)
        assert set(os.listdir(cli.folder / "out")) == names


EARLY = """
import signal, sys
from cfmkit.cli import main, run_spec_and_print_page
from cfmkit.runs import batch, run, suggest

def ended(*_, **__):
    signal.raise_signal(signal.SIGTERM)

run_spec_and_print_page.execute = run.read = batch.batch = ended
suggest.read_request = ended
print(main.main(sys.argv[1:]))
"""


@pytest.mark.parametrize("verb", ["sweep", "sensitivity", "batch", "design", "suggest"])
@pytest.mark.parametrize("fresh", [(), ("--fresh",)])
def test_a_signal_before_anything_is_computed_says_that_nothing_is(tmp_path, verb, fresh):
    """With --fresh, too: what an earlier run has kept is not cleared away yet, and is not what was asked for."""
    command = [sys.executable, "-c", EARLY, verb, "cam.yaml", *fresh]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False, cwd=tmp_path)
    reported = "error    terminated; nothing was computed yet: run the same command again\n"
    assert (done.stdout, done.stderr) == ("143\n", reported)


REWRITTEN = """
import signal, sys
from cfmkit.cli import main

def run(*_):
    try:
        signal.raise_signal(signal.SIGTERM)
    except BaseException as error:
        raise ValueError("SchemaError: Stopped: terminated") from None

main._run_command = run
print(main.main(["show"]))
"""


def test_a_signal_of_which_a_library_makes_another_exception_is_no_bug():
    """As the one does that builds the models of specifications."""
    done = subprocess.run([sys.executable, "-c", REWRITTEN], capture_output=True, text=True, timeout=60, check=False)
    assert (done.stdout, done.stderr) == ("143\n", "error    terminated\n")


def test_a_signal_while_the_program_is_loaded_ends_it_in_one_line():
    code = "import signal\nimport cfmkit.__main__ as program\nimport builtins\nusual = builtins.__import__\n"
    code += "def late(name, *rest):\n    if name == 'typer':\n        signal.raise_signal(signal.SIGINT)\n"
    code += "    return usual(name, *rest)\nbuiltins.__import__ = late\nprogram.entry()\n"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "error    interrupted\n")


LOST = """
import signal, time
from cfmkit.cli import main
from cfmkit.cli.failures import Stopped

class Compiler:
    def __del__(self):
        signal.raise_signal(signal.SIGTERM)

main._catch_signals()
try:
    Compiler()
    print("went on", flush=True)
    time.sleep(20.0)
except Stopped as stop:
    print(stop.reported)
"""


def test_a_signal_in_code_that_lets_no_exception_out_still_ends_the_run():
    """As in a compiler's callbacks: nothing is printed of them, and the signal comes again when they are over."""
    done = subprocess.run([sys.executable, "-c", LOST], capture_output=True, text=True, timeout=60, check=False)
    assert (done.stdout, done.stderr) == ("went on\nterminated\n", "")


@pytest.mark.parametrize("finished", [True, False])
def test_a_search_that_is_ended_says_that_it_goes_on_if_it_does(tmp_path, finished):
    """It does where a start is noted; a design that keeps nothing begins anew, and says so."""
    reported = []
    with RunFolder(tmp_path / "out") as folder:
        try:
            with open_journal(folder, fresh=False) as journal:
                if finished:
                    journal.add("0" * 32, {"found": {}})
                raise Stopped(signal.SIGTERM)
        except Stopped as stop:
            reported.append(stop.reported)
    more = "what is finished is kept: run the same command again to continue"
    anew = "nothing that could be reused is finished yet: the same command starts from the beginning"
    assert reported == [f"terminated; {more if finished else anew}"]
