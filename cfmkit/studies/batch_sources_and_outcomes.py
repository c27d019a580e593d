"""Many specifications at once: which files, where each writes, and what became of them as tables."""

from __future__ import annotations

import glob
import os
import re
from collections import Counter, deque
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cfmkit.errors import ExitCode, UsageError
from cfmkit.results import Status
from cfmkit.studies.row_blocks_for_journal import WARNINGS_JOINT
from cfmkit.tables import Table, TableColumn, text_column

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence


OUTPUT_FOLDER = "cfm-out"  # folders of this name hold results: a search for specifications does not look into them
SPEC_SUFFIXES = (".yaml", ".yml")
TAKEN_NAMES = ("results.csv", "requirements.csv", "metrics.json", "manifest.json", "report.html", "changes.csv")
"""Names in the output folder that no specification's folder may have."""
SKIPPED_STATUS, SKIPPED_MESSAGE = "skipped", "not run: an earlier specification failed"


@dataclass(frozen=True)
class Entry:
    """Outcome of one specification."""

    spec: str  # the file, as it was named or found
    folder: str  # where its files are, below the output folder
    verb: str = ""  # ``design`` or ``analyze``; empty if it came to neither
    # family, name: as the specification says
    family: str = ""
    name: str = ""
    status: str = SKIPPED_STATUS  # as in metrics.json; ``skipped`` if it was not run
    code: ExitCode = ExitCode.OK  # what a run of it alone would have returned
    message: str = ""  # what is wrong, in one line; empty if nothing is
    # requirements, warnings: as in metrics.json
    requirements: tuple[Mapping[str, Any], ...] = ()
    warnings: tuple[Mapping[str, Any], ...] = ()
    errors: tuple[str, ...] = ()  # every fault, with its place in the file
    seconds: float = field(default=0.0, compare=False)  # how long it took
    bug: str = field(default="", compare=False)  # the traceback, if a bug ended it
    # the data files that the specification names, and the hashes of their content
    data: tuple[tuple[str, str | None], ...] = field(default=(), compare=False)
    # written, reused: whether its folder holds its run, and whether that was done by an earlier batch
    written: bool = field(default=False, compare=False)
    reused: bool = field(default=False, compare=False)

    @property
    def skipped(self) -> bool:
        """Whether it was not run."""
        return self.status == SKIPPED_STATUS

    @property
    def missed(self) -> tuple[Mapping[str, Any], ...]:
        """The requirements that are not met."""
        return tuple(requirement for requirement in self.requirements if not requirement["ok"])

    @property
    def warned(self) -> str | None:
        """The names of the warnings, as tables say them."""
        return WARNINGS_JOINT.join(sorted({warning["name"] for warning in self.warnings})) or None

    def as_json(self) -> dict[str, Any]:
        """Return its part of metrics.json: nothing that differs from run to run."""
        return {
            "spec": self.spec,
            "folder": self.folder,
            "verb": self.verb or None,
            "family": self.family or None,
            "name": self.name or None,
            "status": self.status,
            "exit_code": int(self.code),
            "message": self.message,
            "requirements": list(self.requirements),
            "warnings": list(self.warnings),
            "errors": list(self.errors),
        }


def sources(
    # a folder stands for all YAML files in it and below; ``*``, ``?``, ``[...]`` and ``**`` are patterns unless there
    # is a file of that very name
    named: Iterable[str],
    out: str,  # the output folder, which is not searched
) -> tuple[str, ...]:
    """Return the files that names stand for: files, folders and patterns, each file once, in order.

    Raises UsageError if a name stands for no file.
    """
    paths: dict[str, str] = {}
    for name in named:
        for path in _find_files(name, out):
            paths.setdefault(os.path.realpath(path), path)
    return tuple(paths.values())


def _find_files(name: str, out: str) -> list[str]:
    if not name or name == "-" or "\0" in name:
        raise UsageError(
            f"{name!r} is not a file: a batch reads files, folders and patterns such as 'configs/**/*.yaml'"
        )
    if os.path.isdir(name):
        return files_below(name, out)
    if os.path.exists(name):
        return [name]
    if not glob.has_magic(name):
        raise UsageError(f"{name}: there is no such file")
    paths = _search(name, out)
    if not paths:
        raise UsageError(f"{name}: no file matches this pattern")
    return paths


def files_below(
    folder: str,  # where to look
    out: str = OUTPUT_FOLDER,  # an output folder, which is not searched
) -> list[str]:
    """Return the YAML files in a folder and below, those in folders of results left out.

    Raises UsageError if there is none.
    """
    paths = [
        os.path.join(folder, path) for path in _search("**/*", out, folder) if path.lower().endswith(SPEC_SUFFIXES)
    ]
    if not paths:
        raise UsageError(f"{folder}: there is no YAML file in this folder or below")
    return paths


def _search(pattern: str, out: str, root: str | None = None) -> list[str]:
    """Return the files that match a pattern, but those that a run wrote."""
    inside = os.path.realpath(out) + os.sep
    paths = []
    for path in sorted(_paths(pattern, root or "")):
        whole = os.path.join(root, path) if root else path
        ours = OUTPUT_FOLDER in Path(path).parts[:-1] or os.path.realpath(whole).startswith(inside)
        if os.path.isfile(whole) and not ours:
            paths.append(path)
    return paths


def _paths(pattern: str, root: str) -> set[str]:
    """Return the paths that match a pattern; `glob` itself would follow links that lead upwards again and again."""
    start, *rest = _ANY_DEPTH.split(pattern, maxsplit=1)
    if not rest:
        return set(glob.glob(pattern, root_dir=root or None))
    tops = glob.glob(start, root_dir=root or None) if start else [""]
    folders = (folder for top in tops for folder in _folders_below(top, root))
    return {path for folder in folders for path in _paths(glob.escape(folder) + (rest[0] or "*"), root)}


_PATH_SEPARATORS = re.escape(os.sep + (os.altsep or ""))
_ANY_DEPTH = re.compile(rf"(?:^|(?<=[{_PATH_SEPARATORS}]))\*\*(?:[{_PATH_SEPARATORS}]|$)")
"""The part of a pattern that stands for any number of folders."""


def _folders_below(top: str, root: str) -> Iterator[str]:
    """Yield a folder and those below it, with a separator at the end, but hidden ones and those of results.

    Links are followed, after all real folders; each folder is visited once, so that links may lead in circles.
    """
    seen: set[tuple[int, int]] = set()
    waiting = deque([top])
    while waiting:
        folder = waiting.popleft()
        try:
            about = os.stat(os.path.join(root, folder) or os.curdir)
            if (about.st_dev, about.st_ino) in seen:
                continue
            seen.add((about.st_dev, about.st_ino))
            entries = sorted(os.scandir(os.path.join(root, folder) or os.curdir), key=lambda entry: entry.name)
        except OSError:  # as `glob` does: what cannot be read holds nothing
            continue
        yield folder
        kept = (entry for entry in entries if not entry.name.startswith(".") and entry.name != OUTPUT_FOLDER)
        below = [entry for entry in kept if os.path.isdir(entry)]  # one.is_dir() fails where a link leads to itself
        waiting.extendleft(os.path.join(folder, entry.name, "") for entry in reversed(below) if not entry.is_symlink())
        waiting.extend(os.path.join(folder, entry.name, "") for entry in below if entry.is_symlink())


def folders(files: Sequence[str]) -> tuple[str, ...]:
    """Return a name for the output folder of each file: its stem, with folders in front where stems are equal.

    Examples
    --------
    >>> folders(["cam.yaml", "a/beam.yaml", "b/beam.yaml"])
    ('cam', 'a-beam', 'b-beam')
    """
    paths = [Path(os.path.abspath(file)).with_suffix("") for file in files]
    depths = dict.fromkeys(paths, 1)
    while twice := _find_repeated(depths):
        depths |= {path: depths[path] + 1 for path in twice}
    return tuple(_make_folder_names(_join_last_folders(path, depths[path]) for path in paths))


def _join_last_folders(path: Path, depth: int) -> str:
    return "-".join(path.parts[1:][-depth:]) or "spec"


def _find_repeated(depths: Mapping[Path, int]) -> list[Path]:
    """Return different paths whose tails are the same, capitals apart, and could be longer."""
    counts = Counter(_join_last_folders(path, depth).lower() for path, depth in depths.items())
    return [
        path
        for path, depth in depths.items()
        if counts[_join_last_folders(path, depth).lower()] > 1 and depth < len(path.parts)
    ]


def _make_folder_names(names: Iterable[str]) -> Iterator[str]:
    """Yield each name as a folder may have it; "-2", "-3", ... follow those that are taken, as by a batch's files."""
    taken = set(TAKEN_NAMES)
    for name in names:
        plain = "".join(char if char.isprintable() and char not in '\\/:*?"<>|' else "_" for char in name)
        plain = plain if plain.strip(". ") and not plain.lower().startswith(".cfmkit") else f"spec{plain}"
        free, count = plain, 1
        while free.lower() in taken:
            count += 1
            free = f"{plain}-{count}"
        taken.add(free.lower())
        yield free


def results_table(entries: Sequence[Entry]) -> Table:
    """Return results.csv: one row per specification."""
    return Table(
        (
            text_column("spec", (entry.spec for entry in entries)),
            text_column("folder", (entry.folder for entry in entries)),
            text_column("verb", (entry.verb for entry in entries)),
            text_column("family", (entry.family for entry in entries)),
            text_column("name", (entry.name for entry in entries)),
            text_column("status", (entry.status for entry in entries)),
            TableColumn("exit_code", tuple(None if entry.skipped else int(entry.code) for entry in entries)),
            TableColumn("requirements", tuple(len(entry.requirements) for entry in entries)),
            TableColumn("missed", tuple(len(entry.missed) for entry in entries)),
            text_column("warnings", (entry.warned for entry in entries)),
            text_column("message", (entry.message for entry in entries)),
        )
    )


def requirements_table(entries: Sequence[Entry]) -> Table:
    """Return requirements.csv: one row per requirement."""
    rows = [(entry, requirement) for entry in entries for requirement in entry.requirements]

    def column(key: str) -> TableColumn:
        return TableColumn(key, tuple(requirement[key] for _, requirement in rows))

    over = [requirement["over"] or (None, None) for _, requirement in rows]
    return Table(
        (
            text_column("spec", (entry.spec for entry, _ in rows)),
            text_column("metric", (requirement["metric"] for _, requirement in rows)),
            *(column(key) for key in ("value", "min", "max")),
            text_column("unit", (requirement["unit"] for _, requirement in rows)),
            TableColumn("over_from", tuple(ends[0] for ends in over)),
            TableColumn("over_to", tuple(ends[1] for ends in over)),
            column("over_unit"),
            column("ok"),
        )
    )


def message(entries: Sequence[Entry]) -> str:
    """Return how the specifications ended, in one line.

    Examples
    --------
    >>> message([Entry("a.yaml", "a", status="complete"), Entry("b.yaml", "b")])
    '2 specs: 1 ok, 1 skipped'
    """
    counts = Counter(outcome(entry) for entry in entries)
    reported = ", ".join(
        f"{counts[word]} {word}" for word in (*OUTCOME_WORDS.values(), TIMED_OUT, SKIPPED_STATUS) if counts[word]
    )
    return f"{len(entries)} spec{'s' * (len(entries) != 1)}: {reported}"


OUTCOME_WORDS = {
    ExitCode.OK: "ok",
    ExitCode.REQUIREMENT_MISSED: "missed",
    ExitCode.PARTIAL: "partial",
    ExitCode.NO_SOLUTION: "no solution",
    ExitCode.INVALID: "invalid",
    ExitCode.USAGE: "unreadable",
    ExitCode.IO: "not written",
    ExitCode.IN_USE: "folder in use",
    ExitCode.BUG: "bug",
}
"""What an exit code is called in a summary."""
TIMED_OUT = "timed out"


def outcome(entry: Entry) -> str:
    """Return in a word how a specification ended."""
    if entry.status == Status.TIMEOUT.key:
        return TIMED_OUT
    return SKIPPED_STATUS if entry.skipped else OUTCOME_WORDS.get(entry.code, "failed")
