"""Options about measured data that several verbs take, and reading what they name."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from cfmkit.experiment.measured import Measured

Units = Annotated[
    str | None,
    typer.Option(
        "--units",
        metavar="s=mm,F=N",
        show_default=False,
        help="Units by column name or number, where the header names none; also picks columns.",
    ),
]


@dataclass(frozen=True, kw_only=True)
class Measuring:
    """What a verb takes that reads a measurement beside a spec."""

    units: Units = None


def data_record(name: str) -> dict[str, Any]:
    """Return what a manifest says about a data file: where it was, and the hash of its content."""
    from pathlib import Path

    from cfmkit.store import file_hash

    return {"data": {"source": name, "sha256": file_hash(Path(name).resolve())}}


def read_measured(name: str, units: str | None) -> Measured:
    """Return the measurement in a file, raw."""
    from cfmkit.experiment.measured import measured
    from cfmkit.experiment.reading import read_recording

    return measured(read_recording(name, units), None)
