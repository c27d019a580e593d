"""Pages of the site that are made from the package: keys, metrics, units, materials, commands, Python, the gallery.

They are written to ``docs/made/`` before Sphinx reads, and are no part of the repository.
"""

from __future__ import annotations

import contextlib
import io
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from sphinx.application import Sphinx

MADE = Path(__file__).with_name("made")
GALLERY = (
    ("cam", (), "A roller, a cam and two springs: 50 N over 240 mm, friction makes a loop."),
    ("cam_no_undercut", (), "The same without undercut: a larger force constant, softer springs."),
    ("cam_dynamics", (), "The slider lifted by 100 mm in an eighth of a second."),
    ("beam_lan2010", (), "Four curved beams in two halves: 9.7 N over half of the travel."),
    ("beam_williams_toggle", (), "Two beams that snap through."),
    ("vcfm_ding2022", (), "Snap-through leaves beside a diamond; a preload adjusts the force."),
    ("vcfm_pla", (), "A design for printed PLA."),
    ("slider_crank_li2019", (), "Springs chosen for a constant torque about the stretched position."),
    ("slider_crank_bilancia2019", (), "Three torsion springs: 1.5 N over 35 mm."),
    ("slider_crank_strip", (), "The same force from one strip of constant thickness."),
)
"""Examples that are quick to run, changes to them, and what they show."""


def made() -> dict[str, str]:
    """Return every page by its name below `MADE`, but the gallery."""
    from cfmkit import families

    pages = {f"keys_{record.name.replace('-', '_')}.md": _family(record) for record in families.records()}
    return pages | {
        "metrics.md": _metrics(),
        "units.md": _units(),
        "materials.md": _materials(),
        "commands.md": _commands(),
        "python.md": _python(),
    }


def gallery(folder: Path) -> str:
    """Return the page of the gallery; its pictures are drawn into a folder."""
    from cfmkit import api
    from cfmkit.families import family
    from cfmkit.plots.figures import figures
    from cfmkit.plots.style import png
    from cfmkit.runs.shipped_files import example

    parts = ["# Gallery\n", "Every picture is drawn by the command above it while this site is made.\n"]
    for name, changes, about in GALLERY:
        spec = api.load(example(name).path, changes)
        result = api.analyze(spec)
        parts.append(f"## {name}\n\n{about}\n\n```text\ncfmkit analyze configs/{name}.yaml\n```\n")
        for stem, draw in list(figures(family(spec.family), result).items())[:2]:
            (folder / f"{name}-{stem}.png").write_bytes(png(draw(), 110))
            parts.append(f"![{name}: {stem}]({name}-{stem}.png)\n")
    return "\n".join(parts)


def _family(record: Any) -> str:

    from cfmkit.specs.keys_and_schema import keys
    from cfmkit.specs.units import border_unit

    blocks: dict[str, list[Any]] = {}
    for key in keys(record.spec_type):
        head, dot, _ = key.path.partition(".")
        blocks.setdefault(head.removesuffix("[]") if dot or key.kind.endswith("block") else "spec", []).append(key)
    parts = [f"# Keys of {record.phrase}\n", f"{record.summary[0].upper()}{record.summary[1:]}.\n"]
    parts.append(f"`cfmkit show {record.name}` prints the same; `cfmkit new {record.name}` starts a file.\n")
    for head, known in blocks.items():
        rows = [(f"`{one.path}`", _kind(one), one.default, one.allowed, _needed(one)) for one in known]
        parts += [f"## {head}\n", *_table(("key", "kind, unit", "default", "allowed", "meaning"), rows)]
    values = [(f"`{name}`", border_unit(kind), text) for name, (kind, text) in record.outputs.values.items()]
    parts += ["## Values beside the metrics\n", *_table(("name", "unit", "what it is"), values)]
    found = [(f"`{name}`", text) for name, text in record.outputs.findings.items()]
    parts += ["## Warnings and failures\n", *_table(("name", "meaning"), found)]
    parts += ["## References\n", *(f"- {paper.reference}" for paper in record.papers)]

    return "\n".join(parts) + "\n"


def _kind(key: Any) -> str:
    return f"{key.kind}, e.g. `{key.example}`" if key.example else key.kind


def _needed(key: Any) -> str:
    return f"{key.description}{' (required)' if key.required else ''}"


def _metrics() -> str:
    from cfmkit.metrics import definitions
    from cfmkit.specs.units import border_unit

    rows = [(f"`{one.name}`", border_unit(one.dimension), one.definition) for one in definitions("force")]
    text = (
        "Over the requirement's `over`, else `analysis.window`, else the full travel. Without a branch the worst one "
        "counts; `force_mean[load]` picks one. On a torque curve `force_...` is called `torque_...`.\n"
    )
    return "\n".join(["# Metrics\n", text, *_table(("name", "unit", "definition"), rows)]) + "\n"


def _units() -> str:
    from cfmkit.specs.units import DIMENSIONS_BY_NAME, unit_table

    units = [(f"`{one[0]}`", one[1], one[2].replace("_", " "), f"{one[3]:.12g}") for one in unit_table()]
    kinds = [
        (one.name.replace("_", " "), f"`{one.unit}`", f"`{one.example}`", one.description)
        for one in DIMENSIONS_BY_NAME.values()
        if one.unit
    ]
    text = "Case-sensitive; combine with `*`, `/` and `^`: `N*mm/rad`, `kg/m^3`. Zero needs no unit.\n"
    return (
        "\n".join(
            [
                "# Units\n",
                text,
                *_table(("unit", "name", "measures", "in SI"), units),
                "## Dimensions\n",
                *_table(("dimension", "written in", "example", "meaning"), kinds),
            ]
        )
        + "\n"
    )


def _materials() -> str:
    from cfmkit.stock import MATERIALS_BY_NAME

    rows = [
        (
            f"`{one.name}`",
            f"{one.youngs_modulus / 1e9:.4g}",
            "" if one.yield_strength is None else f"{one.yield_strength / 1e6:.4g}",
            f"{one.poisson_ratio:.3g}",
            f"{one.density:.4g}",
            one.source,
        )
        for one in MATERIALS_BY_NAME.values()
    ]
    head = ("material", "E [GPa]", "yield [MPa]", "Poisson", "density [kg/m^3]", "source")
    return "\n".join(["# Materials\n", "At room temperature, under short-term loads.\n", *_table(head, rows)]) + "\n"


def _commands() -> str:
    from cfmkit.cli.commands import Verbs
    from cfmkit.cli.main import main

    parts = ["# Commands\n", "What `--help` prints.\n"]
    verbs = Verbs.list_commands(None, None)  # type: ignore[arg-type]
    for arguments in ([], *([verb] for verb in verbs)):
        parts += [
            f"## {' '.join(['cfmkit', *arguments])}\n",
            "```text",
            _printed(main, [*arguments, "--help"]).rstrip(),
            "```\n",
        ]
    return "\n".join(parts)


def _printed(main: Any, arguments: Sequence[str]) -> str:
    """Return what a command prints on a page of 84 columns, which a page of the site has room for, without colours."""
    before = dict(os.environ)
    os.environ |= {"COLUMNS": "84", "NO_COLOR": "1"}  # typer keeps a TERMINAL_WIDTH for good
    into = io.StringIO()
    try:
        with contextlib.redirect_stdout(into):
            main(list(arguments))
    finally:
        os.environ.clear()
        os.environ |= before
    return into.getvalue()


def _python() -> str:
    import inspect

    import cfmkit

    names = [name for name in cfmkit.__all__ if not name.startswith("_")]
    functions = [name for name in names if inspect.isfunction(getattr(cfmkit, name))]
    classes = [name for name in names if inspect.isclass(getattr(cfmkit, name))]
    text = (
        "Arrays are read-only and in SI units. Every function takes a specification or the path of its file. "
        "[Results in Python](../python.md) has examples.\n"
    )
    parts = [
        "# Python\n",
        text,
        "## Functions\n",
        "```{eval-rst}",
        *(f".. autofunction:: cfmkit.{name}\n" for name in functions),
        "```\n",
    ]
    return "\n".join(
        [
            *parts,
            "## Types\n",
            "```{eval-rst}",
            *(f".. autoclass:: cfmkit.{name}\n   :members:\n" for name in classes),
            "```\n",
        ]
    )


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> Iterator[str]:
    yield f"| {' | '.join(head)} |"
    yield "|" + "---|" * len(head)
    for row in rows:
        yield f"| {' | '.join(_cell(text) for text in row)} |"
    yield ""


def _cell(text: str) -> str:
    """Return text as a cell: Markdown's own signs stay as they are, but in code."""
    text = " ".join(text.split())
    if text.startswith("`"):
        return text.replace("|", "\\|")
    pieces = text.replace("|", "\\|").split("`")
    for at in range(0, len(pieces), 2):
        for sign in ("<", ">", "*", "_", "["):
            pieces[at] = pieces[at].replace(sign, {"<": "&lt;", ">": "&gt;"}.get(sign, f"\\{sign}"))
    return "`".join(pieces)


def write(app: Any = None) -> None:
    """Write all made pages; those whose text has not changed keep their time."""
    MADE.mkdir(exist_ok=True)
    pages = made() | {"gallery.md": gallery(MADE)}
    for name, text in pages.items():
        path = MADE / name
        if not path.is_file() or path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")


def others(app: Sphinx, page: str, source: list[str]) -> None:
    """Put every page that the index does not name where it says OTHERS: a new page is in the site at once."""
    if page == "index":
        named = set(source[0].split())
        more = sorted(name for name in app.env.found_docs if "/" not in name and name not in named and name != "index")
        source[0] = source[0].replace("OTHERS", "\n".join(more))


def setup(app: Sphinx) -> dict[str, Any]:
    """Write the pages before the site is read."""
    app.connect("builder-inited", write)
    app.connect("source-read", others)
    return {"parallel_read_safe": True}


if __name__ == "__main__":
    write()
