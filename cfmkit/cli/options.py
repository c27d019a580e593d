"""Options that mean the same in every verb, and the dataclasses that gather them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import typer

from cfmkit.cli import completion

SpecFile = Annotated[
    str,
    typer.Argument(
        metavar="SPEC",
        help="YAML file of one mechanism; - reads standard input.",
        show_default=False,
        autocompletion=completion.specs,
    ),
]
OutFolder = Annotated[
    str | None,
    typer.Option("-o", "--out", metavar="DIR", help="Output folder; default: cfm-out/SPEC-VERB/.", show_default=False),
]
Changes = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="A.B=VALUE",
        help="Replace a value of the spec, with its unit, e.g. --set mechanism.roller_radius='10 mm'. A key that has "
        """dots itself stands in quotes: 'sensitivity.parameters."mechanism.width"=[1 mm, 2 mm]'. Of many specs """
        "those of one family only: --set cam:mechanism.roller_radius='10 mm'. Repeatable.",
        show_default=False,
    ),
]
Fidelity = Annotated[
    str | None,
    typer.Option("--fidelity", metavar="NAME", help="Short for --set analysis.fidelity=NAME.", show_default=False),
]
Seed = Annotated[int, typer.Option("--seed", metavar="N", min=0, max=2**63 - 1, help="Seed of everything random.")]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON document instead, also on failure.")]
Quiet = Annotated[bool, typer.Option("-q", "--quiet", help="Print only what went wrong.")]
Verbose = Annotated[
    int, typer.Option("-v", "--verbose", count=True, help="Print more; -vv also tracebacks.", show_default=False)
]
NoPlots = Annotated[bool, typer.Option("--no-plots", help="Draw no figures.")]


@dataclass(frozen=True, kw_only=True)
class Common:
    """What every verb takes."""

    json: Json = False
    verbose: Verbose = 0


@dataclass(frozen=True, kw_only=True)
class Changing:
    """What a verb takes that reads specifications."""

    set: Changes = None

    @property
    def changes(self) -> tuple[str, ...]:
        """What ``--set`` says, in order."""
        return tuple(self.set or ())


@dataclass(frozen=True, kw_only=True)
class OneSpec(Changing):
    """What a verb takes that reads one specification and writes a folder."""

    spec: SpecFile
    out: OutFolder = None


@dataclass(frozen=True, kw_only=True)
class Computing(OneSpec):
    """What a verb takes that computes."""

    fidelity: Fidelity = None
    seed: Seed = 0
    no_plots: NoPlots = False
    quiet: Quiet = False
