"""Do two versions of the program say the same? Every config and study, run by each and compared.

    python tools/compare_runs.py record OUT [--command .venv/bin/cfmkit] [--only cam] [--jobs 2]
    python tools/compare_runs.py compare BEFORE AFTER [--tolerance 0]

``record`` runs every file in ``configs/`` and ``configs/studies/``: ``analyze``, ``design`` where the file has a block
``design``, ``sweep`` or ``sensitivity`` where it has that block; seed 0, no figures. Each run gets a folder below OUT
with what was printed and the exit code. ``compare`` reads two such folders and reports three things apart:

names
    Files, columns, keys, lengths, exit codes and numbers that only one side has: a number that became an empty cell, a
    text, nan or null has gone, and one in place of these is new.
numbers
    The largest difference of a column, in parts of the column's largest absolute value; of a single number, in parts
    of itself. Differences up to the tolerance are not listed.
texts
    Everything else that was written or printed; what belongs to the run and not to the result (times, versions, hashes,
    folders) is left out.

The exit code of ``compare`` is 1 where names or numbers differ, 0 otherwise: texts may be meant to change.
"""

from __future__ import annotations

import argparse
import csv
import json
import math
import re
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator

ROOT = Path(__file__).resolve().parents[1]
PASSING = re.compile(r"\b\d+(\.\d+)? (ms|s|min)\b|\d+ points/s|cfm-out\S*|/\S+/")
"""What changes between two runs of one version: times taken, folders."""
OF_THE_RUN = {"manifest.json", "exit.txt", ".cfmkit-journal.sqlite", ".cfmkit-journal.jsonl"}
"""Of the run: times, versions and arguments; records in the order in which processes finished."""


def jobs(configs: Path, only: str) -> Iterator[tuple[str, list[str]]]:
    """Yield (name, arguments) of every run."""
    for path in sorted([*configs.glob("*.yaml"), *configs.glob("studies/*.yaml")]):
        if only not in path.name:
            continue
        blocks = set(re.findall(r"^([a-z_]+):", path.read_text(encoding="utf-8"), flags=re.MULTILINE))
        verbs = [verb for verb in ("design", "sweep", "sensitivity") if verb in blocks]
        for verb in ("analyze", *verbs):
            seed = [] if verb == "analyze" else ["--seed", "0"]
            yield f"{path.stem}-{verb}", [verb, str(path.relative_to(ROOT)), *seed, "--no-plots"]


def record(out: Path, command: str, only: str, workers: int) -> None:
    """Run everything; keep what is written and printed."""
    out.mkdir(parents=True, exist_ok=True)

    def run(job: tuple[str, list[str]]) -> None:
        name, arguments = job
        folder = out.resolve() / name
        done = subprocess.run(
            [command, *arguments, "--out", str(folder)], cwd=ROOT, capture_output=True, text=True, check=False
        )
        folder.mkdir(exist_ok=True)
        (folder / "printed.txt").write_text(done.stdout + done.stderr, encoding="utf-8")
        (folder / "exit.txt").write_text(f"{done.returncode}\n", encoding="utf-8")
        print(f"{done.returncode} {name}", flush=True)

    with ThreadPoolExecutor(workers) as pool:
        list(pool.map(run, jobs(ROOT / "configs", only)))


def number(text: str) -> float | None:
    """Return a cell as a number; None if it is none, or nan."""
    try:
        found = float(text)
    except ValueError:
        return None
    return None if math.isnan(found) else found


def is_number(value: object) -> bool:
    """Return whether a JSON leaf is a number."""
    return isinstance(value, float | int) and not isinstance(value, bool) and not math.isnan(value)


def columns(path: Path) -> dict[str, list[str]]:
    """Return the columns of a table; lines that begin with # are its head."""
    lines = [line for line in path.read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
    rows = list(csv.reader(lines))
    return (
        {name: [row[i] if i < len(row) else "" for row in rows[1:]] for i, name in enumerate(rows[0])} if rows else {}
    )


def leaves(value: object, place: str = "") -> Iterator[tuple[str, object]]:
    """Yield (place, leaf) of a JSON value."""
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from leaves(inner, f"{place}.{key}")
    elif isinstance(value, list):
        for i, inner in enumerate(value):
            yield from leaves(inner, f"{place}[{i}]")
    else:
        yield place, value


class Differences:
    """What was found, in three lists."""

    def __init__(self, tolerance: float) -> None:
        """Find nothing yet; smaller differences of numbers are none."""
        self.tolerance = tolerance
        self.names: list[str] = []
        self.numbers: list[str] = []
        self.texts: list[str] = []

    def column(self, place: str, before: list[str], after: list[str]) -> None:
        """Compare two columns of a table."""
        if len(before) != len(after):
            self.names.append(f"{place}: {len(before)} rows, now {len(after)}")
            return
        pairs = [(number(a), number(b)) for a, b in zip(before, after, strict=True)]
        scale = max((abs(a) for a, _ in pairs if a is not None and math.isfinite(a)), default=0.0)
        worst, gone = 0.0, []
        for row, ((a, b), old, new) in enumerate(zip(pairs, before, after, strict=True), 1):
            if a is not None and b is not None:
                if a != b:
                    worst = max(worst, abs(a - b) / scale if scale else math.inf)
            elif a is not None or b is not None:
                gone.append(f"row {row}: {old!r}, now {new!r}")
            elif old != new:
                self.texts.append(f"{place}: {old!r}, now {new!r}")
        if gone:
            self.names.append(f"{place}: {len(gone)} numbers on one side only, the first in {gone[0]}")
        if worst > self.tolerance:
            self.numbers.append(f"{place}: {worst:.2g} of the largest value")

    def table(self, place: str, before: Path, after: Path) -> None:
        """Compare two tables."""
        old, new = columns(before), columns(after)
        self.names += [f"{place}: column {name!r} on one side only" for name in old.keys() ^ new.keys()]
        for name in old.keys() & new.keys():
            self.column(f"{place}: {name}", old[name], new[name])

    def data(self, place: str, before: Path, after: Path) -> None:
        """Compare two JSON files."""
        old, new = (dict(leaves(json.loads(path.read_text(encoding="utf-8")))) for path in (before, after))
        self.names += [f"{place}: {name} on one side only" for name in old.keys() ^ new.keys()]
        for name in old.keys() & new.keys():
            a, b = old[name], new[name]
            if is_number(a) and is_number(b):
                if a != b and not abs(a - b) <= self.tolerance * max(abs(a), abs(b)):
                    self.numbers.append(f"{place}: {name}: {a!r}, now {b!r}")
            elif is_number(a) or is_number(b):
                self.names.append(f"{place}: {name}: a number on one side only: {a!r}, now {b!r}")
            elif str(a) != str(b):
                self.text(f"{place}: {name}", str(a), str(b))

    def text(self, place: str, before: str, after: str) -> None:
        """Compare two texts, line by line where they have as many lines."""
        old, new = (PASSING.sub("…", text).splitlines() for text in (before, after))
        if old != new:
            changed = [(a, b) for a, b in zip(old, new, strict=False) if a != b] or [("", "more or fewer lines")]
            self.texts += [f"{place}:\n    - {a}\n    + {b}" for a, b in changed]

    def run(self, name: str, before: Path, after: Path) -> None:
        """Compare the folders of one run."""
        codes = [(side / name / "exit.txt").read_text(encoding="utf-8").strip() for side in (before, after)]
        if codes[0] != codes[1]:
            self.names.append(f"{name}: exit code {codes[0]}, now {codes[1]}")
        files = [
            {p.relative_to(side / name) for p in (side / name).rglob("*") if p.is_file()} for side in (before, after)
        ]
        self.names += [f"{name}: {path} on one side only" for path in sorted(files[0] ^ files[1])]
        for path in sorted(files[0] & files[1]):
            if path.name in OF_THE_RUN:
                continue
            old, new, place = before / name / path, after / name / path, f"{name}/{path}"
            if path.suffix == ".csv":
                self.table(place, old, new)
            elif path.suffix == ".json":
                self.data(place, old, new)
            elif old.read_bytes() != new.read_bytes():
                self.text(place, *(p.read_text(encoding="utf-8", errors="replace") for p in (old, new)))


def compare(before: Path, after: Path, tolerance: float) -> int:
    """Print what differs; return 1 where names or numbers do."""
    found = Differences(tolerance)
    runs = [{path.parent.name for path in side.glob("*/exit.txt")} for side in (before, after)]
    found.names += [f"{name} on one side only" for name in sorted(runs[0] ^ runs[1])]
    for name in sorted(runs[0] & runs[1]):
        found.run(name, before, after)
    for title in ("names", "numbers", "texts"):
        lines = getattr(found, title)
        print(f"== {title}: {len(lines)} differences in {len(runs[0] & runs[1])} runs")
        print("\n".join(lines))
    return int(bool(found.names or found.numbers))


def main() -> int:
    """Record or compare."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    verbs = parser.add_subparsers(dest="verb", required=True)
    recording = verbs.add_parser("record", help="run everything with one version")
    recording.add_argument("out", type=Path)
    recording.add_argument("--command", default=str(ROOT / ".venv" / "bin" / "cfmkit"))
    recording.add_argument("--only", default="", help="files whose name contains this")
    recording.add_argument("--jobs", type=int, default=2)
    comparing = verbs.add_parser("compare", help="compare two records")
    comparing.add_argument("before", type=Path)
    comparing.add_argument("after", type=Path)
    comparing.add_argument("--tolerance", type=float, default=0.0, help="of a column's largest value; 0: bit for bit")
    options = parser.parse_args()
    if options.verb == "compare":
        return compare(options.before, options.after, options.tolerance)
    record(options.out, str(Path(options.command).absolute()), options.only, options.jobs)
    return 0


if __name__ == "__main__":
    sys.exit(main())
