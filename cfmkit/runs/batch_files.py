"""The files of a batch: its tables, its numbers, its page."""

from __future__ import annotations

import shlex
from typing import TYPE_CHECKING, Any

from cfmkit.errors import ExitCode
from cfmkit.studies.metric_changes import changes_table

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cfmkit.store import RunFolder
    from cfmkit.studies.batch_entries import Entry
    from cfmkit.studies.metric_changes import BatchComparison


def about(arguments: Sequence[str], seed: int, named: Sequence[str], code: ExitCode) -> dict[str, Any]:
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
    page: bool,
    compared: BatchComparison | None = None,
) -> tuple[str, ...]:
    """Write what a batch found out, and return the names of the files."""
    from cfmkit.studies.batch_entries import message, requirements_table, results_table
    from cfmkit.tables import to_csv
    from cfmkit.tables.jsontext import json_bytes

    folder.write("results.csv", to_csv(results_table(entries)))
    folder.write("requirements.csv", to_csv(requirements_table(entries)))
    folder.write("metrics.json", json_bytes(data(entries, ExitCode(about["exit_code"]), compared)))
    if compared is not None:
        folder.write("changes.csv", to_csv(changes_table(compared.changes)))
    if page:
        from cfmkit.runs import batch_page

        command = shlex.join(["cfmkit", *about["arguments"]])
        folder.write(batch_page.NAME, batch_page.page(entries, message(entries), command))
    return (*folder.commit(about).files, "manifest.json")


def data(entries: Sequence[Entry], code: ExitCode, compared: BatchComparison | None = None) -> dict[str, Any]:
    """Return what metrics.json says."""
    from cfmkit.studies.batch_entries import message

    required = [{"spec": one.spec, **requirement} for one in entries for requirement in one.requirements]
    return {
        "status": "complete" if code is ExitCode.OK else code.name.lower(),
        "message": message(entries),
        "metrics": {},
        "requirements": required,
        "warnings": [{"spec": one.spec, **item} for one in entries for item in one.warnings],
        "specs": [one.as_json() for one in entries],
        **({"compared": compared.as_json()} if compared is not None else {}),
    }
