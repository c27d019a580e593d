"""Options about measured data that several verbs take, and reading what they name."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

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


def read_measured(name: str, units: str | None) -> Measured:
    """Return the measurement in a file, raw."""
    from cfmkit.experiment.measured import measured
    from cfmkit.experiment.reading import read_recording

    return measured(read_recording(name, units), None)
