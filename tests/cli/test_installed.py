"""The installed program, once per verb: it does what the same command does in the process of the tests.

So each command runs in a process that has just begun and in one that has run many, with other hashes of texts: neither
may change a byte.
"""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest

from cfmkit.cli.commands import names

CONFIGS = Path(__file__).parents[2] / "configs"
FRICTION = ("--fit", "mechanism.rolling_friction")
FEW = ("--samples", "10", "-j", "1")

COMMANDS = {
    "analyze": ("analyze", "cam.yaml", "-o", "out", "--no-plots"),
    "batch": ("batch", "cam.yaml", "-o", "out", "-j", "1", "--no-plots"),
    "calibrate": ("calibrate", "cam_as_built.yaml", "few.csv", *FRICTION, "-o", "out", "--no-plots"),
    "check": ("check", "cam.yaml"),
    "design": ("design", "cam.yaml", "-o", "out"),
    "doctor": ("doctor",),
    "examples": ("examples",),
    "export": ("export", "cam.yaml", "-o", "out"),
    "measure": ("measure", "synthetic/cam_loop.csv", "-o", "out", "--no-plots"),
    "new": ("new", "cam", "-o", "new.yaml"),
    "docs": ("docs", "--json"),
    "papers": ("papers", "cam", "--json"),
    "schema": ("schema",),
    "sensitivity": ("sensitivity", "studies/cam_tolerance.yaml", *FEW, "-o", "out", "--no-plots"),
    "show": ("show", "cam"),
    "sweep": ("sweep", "cam.yaml", "--vary", "mechanism.roller_radius=8 mm:16 mm:3", "-o", "out", "--no-plots"),
}

SECONDS = re.compile(r" +(\w+ )*[\d.]+ (ms|s|min|h)( \d+ s)?$|\d+ files, [\d.]+ MB", re.M)
"""What differs on the page between two runs: how long they took, and how much other tests have put into caches."""

OWN = ("manifest.json", ".cfmkit-journal.sqlite")
"""Files that hold the time, the first, and the hash of such a file, the second."""


ELSEWHERE = {"explore", "suggest", "correct"}
"""Listens until it is stopped (tests/runs/test_explorer.py, tests/browser); searches for seconds; needs a recording."""


def test_every_verb_is_tried():
    assert set(COMMANDS) | ELSEWHERE == set(names())


@pytest.mark.parametrize("command", COMMANDS.values(), ids=COMMANDS)
def test_the_program_says_and_writes_what_the_same_command_does_here(cli, command):
    configs = cli.folder / "configs"
    found = []
    for run in (cli, cli.program):
        shutil.copytree(CONFIGS, configs)
        *head, lines = (configs / "synthetic/cam_loop.csv").read_text().split("\n", 2)
        (configs / "few.csv").write_text("\n".join([*head, *lines.splitlines()[::20]]))
        cli.folder = configs
        done = run(*command)
        files = {str(path.relative_to(configs)): path for path in configs.rglob("*") if path.is_file()}
        written = {name: path.name in OWN or path.read_bytes() for name, path in files.items()}
        shutil.rmtree(configs)
        page = SECONDS.sub("", done.out)
        if command == ("doctor",):  # the size of a cache that other tests fill also sets how wide its column is
            page = re.sub(r" +", " ", page)
        found.append((done.code, page, done.err, written))
    assert found[0][0] in (0, 5)
    assert found[0] == found[1]
