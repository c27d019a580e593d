"""Files of a batch: those that it writes, and those of an earlier one to compare with or to replace the results of."""

from __future__ import annotations

import os
import shlex
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cfmkit.documents import html
from cfmkit.documents.batch_document import document_of
from cfmkit.errors import ExitCode, UsageError, visible
from cfmkit.metrics.compare import COMPARISON_RTOL
from cfmkit.store import RunFolder
from cfmkit.studies.batch_sources_and_outcomes import message
from cfmkit.studies.earlier_batch import (
    BatchComparison,
    changes,
    changes_table,
    list_gone,
    read_earlier_batch,
)

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from cfmkit.studies.batch_sources_and_outcomes import Entry
    from cfmkit.studies.earlier_batch import Earlier


@dataclass(frozen=True)
class BatchReference:
    """Results of an earlier batch, to be compared with or replaced."""

    folder: str
    tolerance: float  # relative change up to which a metric counts as the same
    accept: bool  # whether it gets the results of the batch
    earlier: Mapping[str, Earlier] | None  # None if there are none yet

    @classmethod
    def read(
        cls, folder: str | os.PathLike[str] | None, tolerance: float | None, accept: bool, out: str
    ) -> BatchReference | None:
        """Return the reference that is named; None if none is.

        Raises UsageError if it is not the folder of a batch, or the options do not fit.
        """
        tolerance = COMPARISON_RTOL if tolerance is None else tolerance
        if not 0 <= tolerance < 1:
            meant = f"; did you mean '{tolerance:g} %'?" if 1 <= tolerance < 100 else ""
            raise UsageError(f"--compare-tolerance: {tolerance:g} is not allowed: must be >= 0 and < 1{meant}")
        name = "" if folder is None else os.fspath(folder)
        if accept and not name:
            raise UsageError("--accept replaces a reference: name its folder with --compare")
        if accept and os.path.realpath(name) == os.path.realpath(out):
            raise UsageError(f"--accept: {visible(name)} is the output folder itself, which has the current results")
        if folder is None:
            return None
        begins = accept and not os.path.lexists(name)
        return cls(name, tolerance, accept, None if begins else read_earlier_batch(name))

    def compare(self, entries: Sequence[Entry], out: str) -> BatchComparison | None:
        """Return the changes since the earlier batch; None if there was none."""
        if self.earlier is None:
            return None
        changed = changes(self.earlier, entries, out, self.tolerance)
        return BatchComparison(self.folder, self.tolerance, changed, list_gone(self.earlier, entries))

    def accept_results(self, out: str, entries: Sequence[Entry], arguments: Sequence[str]) -> bool:
        """Replace the earlier results by those of a batch if that is requested; return True if they were.

        Raises OutputError if the folder cannot be written, or has a file of those names that cfmkit did not write.
        """
        if not self.accept:
            return False
        named = ("metrics.json", *(f"{entry.folder}/metrics.json" for entry in entries if entry.written))
        with RunFolder(self.folder) as target:
            target.check(*named)
            for name in named:
                target.write(name, Path(out, name).read_bytes())
            target.commit({"command": "batch", "arguments": list(arguments), "status": "complete", "exit_code": 0})
        return True


def describe_batch(arguments: Sequence[str], seed: int, named: Sequence[str], code: ExitCode) -> dict[str, Any]:
    """Return what the manifest says about the batch."""
    return {
        "command": "batch",
        "arguments": list(arguments),
        "seed": seed,
        "spec": {"source": list(named)},
        "status": code.name.lower(),
        "exit_code": int(code),
    }


def write(
    folder: RunFolder,
    entries: Sequence[Entry],
    about: dict[str, Any],
    with_page: bool,
    compared: BatchComparison | None = None,
) -> tuple[str, ...]:
    """Write what a batch found out, and return the names of the files."""
    from cfmkit.studies.batch_sources_and_outcomes import requirements_table, results_table
    from cfmkit.tables import to_csv
    from cfmkit.tables.csv_and_json import json_bytes

    folder.write("results.csv", to_csv(results_table(entries)))
    folder.write("requirements.csv", to_csv(requirements_table(entries)))
    folder.write("metrics.json", json_bytes(data(entries, ExitCode(about["exit_code"]), compared)))
    if compared is not None:
        folder.write("changes.csv", to_csv(changes_table(compared.changes)))
    if with_page:
        command = shlex.join(["cfmkit", *about["arguments"]])
        subject = f"a batch of {len(entries)} specifications"
        document = document_of(entries, ExitCode(about["exit_code"]), compared=compared)
        folder.write(html.REPORT_NAME, html.page(document, subject=subject, command=command))
    return (*folder.commit(about).files, "manifest.json")


def data(entries: Sequence[Entry], code: ExitCode, compared: BatchComparison | None = None) -> dict[str, Any]:
    """Return what metrics.json says."""
    required = [{"spec": entry.spec, **requirement} for entry in entries for requirement in entry.requirements]
    return {
        "status": "complete" if code is ExitCode.OK else code.name.lower(),
        "message": message(entries),
        "metrics": {},
        "requirements": required,
        "warnings": [{"spec": entry.spec, **item} for entry in entries for item in entry.warnings],
        "specs": [entry.as_json() for entry in entries],
        **({"compared": compared.as_json()} if compared is not None else {}),
    }
