"""Write docs/papers.md: the numbers that the papers print, from the rows that `cfmkit papers` computes.

``python docs/make_papers.py`` after a row or a result has changed; a test compares the page with what is computed.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from cfmkit.families import records
from cfmkit.runs.papers import VERDICT_MEANINGS, check, rows

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from cfmkit.runs.papers import ComputedRow

PAGE = Path(__file__).with_name("papers.md")
HEAD = """\
# Compared with the papers

This page lists every number that the five papers print in a table, an abstract or a conclusion, and every number that
their text states about a figure. It also lists numbers in equations and in the text if a result depends on them. None
is left out because it disagrees. `cfmkit papers` recomputes all of them and ends with exit code 5 if a verdict does not
hold; `--all` also computes those that take a minute, and `cfmkit papers lan-2010 -v` shows the command behind each row.
The page is made from the same rows (`docs/make_papers.py`, from `cfmkit/runs/printed_numbers.yaml`). The texts that
were available have no page breaks, so the place is a section, table, figure or equation. Models and settings of
instruments are not listed.

```console
$ cfmkit papers cam -q
```
"""


def page(done: Sequence[ComputedRow]) -> str:
    """Return the page for rows that were computed."""
    return (
        "\n".join([HEAD, *_counts(done), *(line for paper in _papers(done) for line in _section(paper, done))]) + "\n"
    )


def _papers(done: Iterable[ComputedRow]) -> list[str]:
    return list(dict.fromkeys(one.row.paper for one in done))


def _counts(done: Sequence[ComputedRow]) -> Iterator[str]:
    yield "| verdict | numbers | meaning |\n|---|---|---|"
    for verdict, meaning in VERDICT_MEANINGS.items():
        yield f"| {verdict} | {sum(len(one.row.printed) for one in done if one.row.verdict == verdict)} | {meaning} |"
    yield ""


def _section(paper: str, done: Sequence[ComputedRow]) -> Iterator[str]:
    mine = [one for one in done if one.row.paper == paper]
    (reference,) = [one.reference for record in records() for one in record.papers if one.name == paper]
    yield f"## {paper}\n\n{reference}\n"
    yield "| place | what | printed | `cfmkit` | verdict | why |\n|---|---|---|---|---|---|"
    for one in mine:
        cells = (one.row.place, one.row.what, ", ".join(one.row.printed), _here(one), one.row.verdict, one.row.why)
        yield f"| {' | '.join(_cell(cell) for cell in cells)} |"
    yield ""


def _here(one: ComputedRow) -> str:
    if one.row.verdict == "given":
        return "the same"
    return ", ".join(one.row.expected if one.skipped else one.computed)


def _cell(text: str) -> str:
    return text.replace("|", "\\|").replace("*", "\\*").replace("<", "&lt;").replace(">", "&gt;")


if __name__ == "__main__":
    PAGE.write_text(page(list(check(rows()))), encoding="utf-8")
