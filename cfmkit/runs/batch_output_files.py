"""The files of a batch: tables, numbers and the page."""

from __future__ import annotations

import shlex
from typing import TYPE_CHECKING, Any

from cfmkit.documents import html
from cfmkit.documents.batch_document import document_of
from cfmkit.errors import ExitCode
from cfmkit.studies.batch_sources_and_outcomes import message
from cfmkit.studies.metric_changes_since_earlier_batch import changes_table

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cfmkit.store import RunFolder
    from cfmkit.studies.batch_sources_and_outcomes import Entry
    from cfmkit.studies.metric_changes_since_earlier_batch import BatchComparison


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
    from cfmkit.tables.json_writing import json_bytes

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
