"""Options about measured data that several verbs take, and reading what they name."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

from cfmkit.cli.options import Common, option

if TYPE_CHECKING:
    from cfmkit.experiment.evaluation import MeasuredCurves


@dataclass(frozen=True, kw_only=True)
class Measuring(Common):
    """What a verb takes that reads a measurement."""

    units: Annotated[
        str | None,
        option(
            "--units",
            metavar="s=mm,F=N",
            text="Units by column name or number, if the header states none; also selects columns.",
        ),
    ] = None
    tare: Annotated[
        str | None,
        option(
            "--tare",
            metavar="FORCE",
            text="Reading of the force sensor without load, to subtract, e.g. '0.4 N'; 'start': the first one.",
        ),
    ] = None
    zero: Annotated[
        str | None,
        option(
            "--zero",
            metavar="LENGTH",
            text="Reading of the displacement sensor at the mechanism's zero, to subtract; 'start': the first one.",
        ),
    ] = None
    flip: Annotated[
        str | None,
        option(
            "--flip",
            metavar="NAMES",
            text="Recorded with the opposite sign: force, displacement (or torque, angle), or both, with a comma.",
        ),
    ] = None

    @property
    def flips(self) -> tuple[str, ...]:
        """What ``--flip`` names."""
        return tuple(word.strip() for word in self.flip.split(",")) if self.flip else ()


def data_record(name: str) -> dict[str, Any]:
    """Return what a manifest says about a data file: where it was, and the hash of its content."""
    from pathlib import Path

    from cfmkit.store import file_hash

    return {"data": {"source": name, "sha256": file_hash(Path(name).resolve())}}


def read_measured(name: str, options: Measuring) -> MeasuredCurves:
    """Return the measurement in a file, raw."""
    from cfmkit.experiment.evaluation import read_measured as read

    return read(name, options.units, options.tare, options.zero, options.flips)


def refuse_without_data(options: Measuring) -> None:
    """Refuse options about a measurement where none is named.

    Raises
    ------
    cfmkit.errors.UsageError
        Naming the first of them.
    """
    from cfmkit.errors import UsageError

    for name in ("units", "tare", "zero", "flip"):
        if getattr(options, name) is not None:
            raise UsageError(f"--{name} is for a measurement: name it with --data")
