"""A run that is told to stop says so, and leaves the folder as it found it."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time

import pytest

from cfmkit.cli.failures import Stopped
from cfmkit.cli.verbs.design import long_run
from cfmkit.families.run_control import Run
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


@pytest.mark.parametrize("finished", [True, False])
def test_a_search_that_is_ended_says_that_it_goes_on_if_it_does(tmp_path, finished):
    """It does where a start is noted; a design that keeps nothing begins anew, and says so."""
    reported = []
    with RunFolder(tmp_path / "out") as folder:
        try:
            with long_run(1, False, folder, Run()) as run:
                if finished:
                    run.notes.add("0" * 32, {"found": {}})
                raise Stopped(signal.SIGTERM)
        except Stopped as stop:
            reported.append(stop.reported)
    more = "what is finished is kept: run the same command again to continue"
    anew = "nothing that could be reused is finished yet: the same command starts from the beginning"
    assert reported == [f"terminated; {more if finished else anew}"]


EARLY = """
import signal, sys
from cfmkit.cli import main, run_spec_and_print_page
from cfmkit.runs import batch, read_wish

def ended(*_, **__):
    signal.raise_signal(signal.SIGTERM)

run_spec_and_print_page.folder_of = run_spec_and_print_page.execute = batch.batch = read_wish.wish_of = ended
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


LOST = """
import signal, time
from cfmkit.cli import main
from cfmkit.cli.failures import Stopped

class Compiler:
    def __del__(self):
        signal.raise_signal(signal.SIGTERM)

main._listen()
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
