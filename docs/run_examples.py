"""Run every example in Markdown files: ``console`` blocks as shell commands, ``python`` blocks as programs.

A console block's lines that begin with ``$ `` are run in one scratch folder per file,
one after the other, with the environment's `cfmkit` first on the path. A comment ``# exit N`` after a command
states the exit code that is expected; without one it is 0. Blocks in other languages
(``text``, ``yaml``) are not run.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

BLOCK = re.compile(r"^```(console|python)\n(.*?)^```", re.M | re.S)
ROOT = Path(__file__).resolve().parent.parent


def run_file(path: Path) -> tuple[int, list[str]]:
    """Run the examples of one file; return how many failed, and what is to be told of them."""
    failures, told = 0, [str(path)]
    with tempfile.TemporaryDirectory() as folder:
        shutil.copytree(ROOT / "configs", Path(folder, "configs"))
        for language, body in BLOCK.findall(path.read_text(encoding="utf-8")):
            commands = _console(body) if language == "console" else [([sys.executable, "-c", body], body, 0)]
            for command, shown, expected in commands:
                good, lines = _run(command, shown, expected, folder)
                failures += not good
                told += lines
    return failures, told


def _console(body: str) -> list[tuple[list[str], str, int]]:
    found = []
    for line in body.splitlines():
        if not line.startswith("$ "):
            continue
        exit_note = re.search(r"#\s*exit (\d+)", line)
        found.append((["bash", "-c", line[2:]], line[2:], int(exit_note.group(1)) if exit_note else 0))
    return found


def _run(command: list[str], shown: str, expected: int, folder: str) -> tuple[bool, list[str]]:
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    done = subprocess.run(
        command, cwd=folder, env=os.environ | {"PATH": path}, capture_output=True, text=True, check=False
    )
    good = done.returncode == expected
    first = shown.strip().splitlines()[0]
    told = [f"  {'ok  ' if good else 'FAIL'} {first}"]
    if not good:
        told.append(f"       exit {done.returncode}, expected {expected}\n{done.stdout[-1500:]}{done.stderr[-1500:]}")
    return good, told


def main() -> int:
    """Run the examples of the files named on the command line, as many files at once as there are processors."""
    failures = 0
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        for failed, told in pool.map(run_file, map(Path, sys.argv[1:])):
            failures += failed
            print(*told, sep="\n", flush=True)
    print(f"{failures} example(s) failed")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
