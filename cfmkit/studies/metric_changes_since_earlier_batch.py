"""Comparison of a batch with an earlier one, for `cfmkit batch --compare`: changed metrics and statuses."""

from __future__ import annotations

import json
import os
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

from cfmkit.errors import ExitCode, UsageError, visible
from cfmkit.metrics import flat_metrics
from cfmkit.metrics.compare import COMPARISON_RTOL, Compared, MetricChange, compare
from cfmkit.results import Status
from cfmkit.tables import Table, TableColumn, text_column

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from cfmkit.studies.batch_sources_and_outcomes import Entry

    Known = Mapping[str, "Earlier"]


@dataclass(frozen=True)
class Earlier:
    """Status and metrics of one specification in an earlier batch, as metrics.json has them."""

    status: str
    exit_code: int
    metrics: Mapping[str, Mapping[str, Any]]


@dataclass(frozen=True)
class BatchComparison:
    """A batch beside an earlier one."""

    folder: str  # of the earlier batch
    tolerance: float  # relative change up to which a metric counts as the same
    changes: tuple[MetricChange, ...]  # everything that is not as it was
    gone: tuple[str, ...]  # folders of specifications that are not there any more

    @property
    def changes_beyond_tolerance(self) -> tuple[MetricChange, ...]:
        """The changes that are larger than the tolerance."""
        return tuple(change for change in self.changes if change.beyond)

    def as_json(self) -> dict[str, Any]:
        """Return what metrics.json says about it."""
        changes = [asdict(change) for change in self.changes]
        return {"with": self.folder, "tolerance": self.tolerance, "changes": changes, "gone": list(self.gone)}


def read_earlier_batch(folder: str) -> Known:
    """Return the results of an earlier batch by folder of the specification; one that wrote nothing has no metrics.

    Raises UsageError if the folder is not one of a batch.
    """
    whole = _read_json(os.path.join(folder, "metrics.json"))
    if whole is None or not isinstance(listed := whole.get("specs"), list):
        raise UsageError(f"--compare: {visible(folder)} is not the folder of a batch: it has no metrics.json of one")
    folders = {}
    for entry in listed:
        if isinstance(entry, dict) and isinstance(name := entry.get("folder"), str):
            own = _read_json(os.path.join(folder, name, "metrics.json")) or {}
            metrics = flat_metrics(own.get("metrics", {}))
            folders[name] = Earlier(str(entry.get("status", "")), int(entry.get("exit_code", 0)), metrics)
    return folders


def _read_json(path: str) -> dict[str, Any] | None:
    try:
        with open(path, encoding="utf-8") as file:
            content = json.load(file)
    except (OSError, ValueError):
        return None
    return content if isinstance(content, dict) else None


def changes(
    earlier: Known,  # the earlier results, from `read_earlier_batch`
    entries: Sequence[Entry],  # what was found now; those that the earlier batch did not have are new, and no change
    folder: str,  # where they have their folders
    tolerance: float = COMPARISON_RTOL,  # relative change of a metric up to which it counts as the same
) -> tuple[MetricChange, ...]:
    """Return what is not as it was, in the order of the specifications and their metrics."""
    changes: list[MetricChange] = []
    for entry in entries:
        before = earlier.get(entry.folder)
        if before is None or entry.skipped:
            continue
        if (before.status, before.exit_code) != (entry.status, int(entry.code)):
            ends = _outcome_text(before.status, before.exit_code), _outcome_text(entry.status, int(entry.code))
            changes.append(MetricChange(entry.spec, "status", *ends, "", None, True))
        if entry.written:
            own = _read_json(os.path.join(folder, entry.folder, "metrics.json")) or {}
            now = flat_metrics(own.get("metrics", {}))
            sides = Compared("the earlier batch", metrics=before.metrics), Compared(entry.spec, metrics=now)
            changes += compare(*sides, tolerance=tolerance).changes
    return tuple(changes)


def _outcome_text(status: str, code: int) -> str:
    """Return the outcome of a specification in words: a curve may be complete and miss a requirement."""
    missed = code == ExitCode.REQUIREMENT_MISSED and status == Status.COMPLETE.key
    return "requirement missed" if missed else status


def list_gone(earlier: Known, entries: Sequence[Entry]) -> tuple[str, ...]:
    """Return the folders of specifications that the earlier batch had and this one has not."""
    folders = {entry.folder for entry in entries}
    return tuple(name for name in earlier if name not in folders)


def changes_table(changes: Sequence[MetricChange]) -> Table:
    """Return changes.csv: one row per value that is not as it was."""
    return Table(
        (
            text_column("spec", (change.spec for change in changes)),
            text_column("metric", (change.name for change in changes)),
            text_column("before", (_cell(change.before) for change in changes)),
            text_column("after", (_cell(change.after) for change in changes)),
            text_column("unit", (change.unit for change in changes)),
            TableColumn("relative_change", tuple(change.relative for change in changes)),
            TableColumn("beyond_tolerance", tuple(change.beyond for change in changes)),
        )
    )


def _cell(value: float | str | None) -> str:
    """Return a value as text: words and numbers stand in one column."""
    return "" if value is None else value if isinstance(value, str) else repr(float(value))
