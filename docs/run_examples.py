"""Run every example in Markdown files: ``console`` blocks as shell commands, ``python`` blocks as programs.

A console block's lines that begin with ``$ `` are run in one scratch folder per file,
one after the other, with the environment's `cfmkit` first on the path. A comment ``# exit N`` after a command
states the exit code that is expected; without one it is 0. Blocks in other languages
(``text``, ``yaml``) are not run.

A command that is ``cfmkit`` alone, without a pipe or the like, runs in a copy (a fork) of a process in which the
program is imported already: the same entry, arguments, folder and exit code, without the half a second that imports
take.
"""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
from concurrent.futures import ProcessPoolExecutor
from importlib import import_module
from multiprocessing import get_context
from pathlib import Path

BLOCK = re.compile(r"^```(console|python)\n(.*?)^```", re.M | re.S)
ROOT = Path(__file__).resolve().parent.parent


def run_file(path: Path) -> tuple[int, list[str]]:
    """Run the examples of one file; return how many failed, and what is to be told of them."""
    failures, reported = 0, [str(path)]
    with tempfile.TemporaryDirectory() as folder:
        shutil.copytree(ROOT / "configs", Path(folder, "configs"))
        for language, body in BLOCK.findall(path.read_text(encoding="utf-8")):
            commands = _console(body) if language == "console" else [([sys.executable, "-c", body], body, 0)]
            for command, shown, expected in commands:
                good, lines = _run(command, shown, expected, folder)
                failures += not good
                reported += lines
    return failures, reported


def _console(body: str) -> list[tuple[list[str], str, int]]:
    found = []
    for line in body.splitlines():
        if not line.startswith("$ "):
            continue
        exit_note = re.search(r"#\s*exit (\d+)", line)
        found.append((["bash", "-c", line[2:]], line[2:], int(exit_note.group(1)) if exit_note else 0))
    return found


def _run(command: list[str], shown: str, expected: int, folder: str) -> tuple[bool, list[str]]:
    arguments = _of_cfmkit(shown) if command[0] == "bash" and hasattr(os, "fork") else None
    with tempfile.TemporaryFile("w+", encoding="utf-8", errors="replace") as output:
        if arguments is not None:
            code = _in_a_copy(arguments, folder, output.fileno())
        else:
            path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
            code = subprocess.run(
                command, cwd=folder, env=os.environ | {"PATH": path}, stdout=output, stderr=output, check=False
            ).returncode
        output.seek(0)
        said = output.read()
    good = code == expected
    reported = [f"  {'ok  ' if good else 'FAIL'} {shown.strip().splitlines()[0]}"]
    if not good:
        reported.append(f"       exit {code}, expected {expected}\n{said[-3000:]}")
    return good, reported


OF_A_SHELL = re.compile(r"[|&;<>$`*?~(){}\\]|\[")
"""What only a shell understands, outside of quotes."""


def _of_cfmkit(line: str) -> list[str] | None:
    """Return the arguments of a command that is ``cfmkit`` alone; None if a shell has to read it."""
    bare = re.sub(r"'[^']*'|\"[^\"$`\\]*\"", "", line.partition(" #")[0])
    words = shlex.split(line, comments=True)
    return words[1:] if words[0] == "cfmkit" and not OF_A_SHELL.search(bare) else None


def _in_a_copy(arguments: list[str], folder: str, output: int) -> int:
    """Run the program in a copy of this process; return its exit code."""
    from cfmkit.cli.main import entry

    child = os.fork()
    if child:
        return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    code = 70
    try:
        os.chdir(folder)
        for number in (1, 2):
            os.dup2(output, number)
        os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
        sys.argv = ["cfmkit", *arguments]
        code = entry()
    finally:
        os._exit(code)


AHEAD = ("cfmkit.api", "cfmkit.cli.main", "cfmkit.plots.style", "ezdxf", "scipy.optimize", "shapely")
"""The program, and the libraries that take longest to import."""


def _import_ahead() -> None:
    for name in AHEAD:
        import_module(name)
    for name in import_module("cfmkit.families").names():
        import_module("cfmkit.families").family(name)


SEARCH = 10
"""A search over all families takes as long as so many other commands: tens of seconds."""


def _work(path: Path) -> int:
    """Return about how long the examples of a file take, in commands."""
    text = path.read_text(encoding="utf-8")
    return text.count("\n$ ") + (SEARCH - 1) * text.count("\n$ cfmkit suggest")


def main() -> int:
    """Run the examples of the files named on the command line, as many files at once as there are processors."""
    failures = 0
    longest_first = sorted(map(Path, sys.argv[1:]), key=_work, reverse=True)
    # before any process imports numpy
    os.environ.update(import_module("cfmkit.studies.serial_and_cluster_executors").ONE_THREAD)
    with ProcessPoolExecutor(os.cpu_count(), get_context("spawn"), _import_ahead) as pool:
        for failed, reported in pool.map(run_file, longest_first):
            failures += failed
            print(*reported, sep="\n", flush=True)
    print(f"{failures} example(s) failed")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
