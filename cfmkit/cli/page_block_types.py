"""The description of a page: a sequence of blocks, each of them a value that `Terminal.show` prints.

A verb describes its page without knowing who prints it: how wide the terminal is, whether it
has colours, and what becomes of a line that is too long are the printer's affair.
Blocks are named tuples and not dataclasses because every start of the program makes these
classes: in 0.07 ms each instead of 0.5.
"""

from __future__ import annotations

from collections import defaultdict
from typing import TYPE_CHECKING, Any, NamedTuple

from cfmkit.errors import visible

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    from cfmkit.specs.spec import Spec

    Record = Mapping[str, Any]

PLAIN, GOOD, BAD, LABEL, FAINT = "", "cyan", "bold yellow", "bold", "dim"
"""Tones. Colours only repeat what a word says, and blue stands against yellow, which everybody can tell apart."""

MARGIN = 9
"""Columns of the words that begin a paragraph: ``warning`` or ``feasible`` and a blank."""

MOST_NAMES = 2
"""Files of one folder that are named: the paragraph of a cam's design has 163 characters then, two lines of the widest
page; with four of each it has 222."""


class Span(NamedTuple):
    """A piece of text and its tone."""

    text: str
    tone: str = PLAIN


class TextLine(NamedTuple):
    """One line of text."""

    spans: tuple[Span, ...] = ()  # from left to right
    right: str = ""  # what stands at its far end
    droppable: bool = False  # whether `right` goes where there is no room for it
    whole: bool = False  # whether it keeps its length where the terminal is narrower: paths and commands are copied


BLANK = TextLine()


class Paragraph(NamedTuple):
    """A text of any length that a word such as ``warning`` begins; nothing in it is cut."""

    word: str
    text: str
    tone: str = LABEL


class GridColumn(NamedTuple):
    """A column of a table: its head, and whether its cells may take several lines."""

    head: str = ""
    wraps: bool = True


class CellGrid(NamedTuple):
    """Cells in columns, without lines between them."""

    columns: tuple[GridColumn, ...]  # heads are shown if one of them is not empty
    rows: Sequence[Sequence[str | Span]]  # from the top down
    gap: int = 3  # blanks between columns
    # whether the whole table stands in from the margin; else the cells of the first column see to that
    indented: bool = False


class Verbatim(NamedTuple):
    """Text that is printed as it is."""

    text: str


class JsonText(NamedTuple):
    """Data that is printed as JSON."""

    data: Record


Block = TextLine | Paragraph | CellGrid | Verbatim | JsonText


def line(text: str, tone: str = PLAIN) -> TextLine:
    """Return a line of one tone."""
    return TextLine((Span(text, tone),))


def whole_line(*spans: str | Span) -> TextLine:
    """Return a line that keeps its length."""
    return TextLine(tuple(Span(one) if isinstance(one, str) else one for one in spans), whole=True)


def title(spec: Spec, right: str, droppable: bool = False) -> TextLine:
    """Return the first line of a page: the family and the name, and at the far end how it went."""
    return TextLine((Span(spec.family, LABEL), Span(f"  {' '.join(spec.name.split())}")), right, droppable)


def columns(*wraps: bool) -> tuple[GridColumn, ...]:
    """Return columns without heads, by whether their cells may take several lines."""
    return tuple(GridColumn("", each) for each in wraps)


def verdict(ok: bool | None) -> Span:
    """Return how a requirement ended: nothing where there was none."""
    return Span("") if ok is None else Span("ok", GOOD) if ok else Span("MISSED", BAD)


def within(bounds: Mapping[str, Any]) -> str:
    """Return the bounds ``min`` and ``max`` of a requirement, as far as it has them."""
    low = [f">= {bounds['min']}"] if bounds["min"] is not None else []
    return " and ".join([*low, *([f"<= {bounds['max']}"] if bounds["max"] is not None else [])])


def spaced(name: str) -> str:
    """Return a name of the files as people write it."""
    return name.replace("_", " ")


class Field(NamedTuple):
    """One column of a table of records: its head, and the cell of a record."""

    head: str
    cell: Callable[[Any], str]
    wraps: bool = False


def field(name: str, head: str | None = None, wraps: bool = False) -> Field:
    """Return a column that shows one field of a record."""
    return Field(name if head is None else head, lambda record: str(record[name]), wraps)


def listed(heading: str, records: Iterable[Record], fields: Sequence[Field]) -> Iterator[Block]:
    """Yield a table of records under its heading; nothing where there are none."""
    rows = [[one.cell(record) for one in fields] for record in records]
    if not rows:
        return
    yield BLANK
    if heading:
        yield line(heading, LABEL)
    yield CellGrid(tuple(GridColumn(one.head, one.wraps) for one in fields), rows, gap=2, indented=True)


class Written(NamedTuple):
    """What a run left behind: its folder, the files in it in the order in which they were written, and the time."""

    folder: str
    files: tuple[str, ...]
    seconds: float = 0.0

    @property
    def data(self) -> dict[str, Any]:
        """The same for the JSON document."""
        return {"out": self.folder, "files": list(self.files)}

    def block(self, everything: bool) -> Paragraph:
        """Return the paragraph that says what stands in the folder now: some of each folder, or everything."""
        names = " ".join(_braced(self.files, None if everything else MOST_NAMES))
        return Paragraph("written", f"{visible(self.folder.rstrip('/'))}/  {names}", GOOD)


def _braced(names: Iterable[str], most: int | None) -> Iterator[str]:
    """Yield names, those of one folder together: ``geometry/{cam.dxf,cam.svg,...}``."""
    folders: dict[str, list[str]] = defaultdict(list)
    for name in names:
        folder, _, base = name.rpartition("/")
        folders[folder].append(base)
    for folder, bases in folders.items():
        if most is None or not folder:
            yield from (f"{folder}/{base}" if folder else base for base in bases)
        elif len(bases) == 1:
            yield f"{folder}/{bases[0]}"
        else:
            more = ["..."] if len(bases) > most else []
            yield f"{folder}/{{{','.join([*bases[:most], *more])}}}"


def next_command(*words: str) -> TextLine:
    """Return the line that says which command follows, never broken: it is copied."""
    return whole_line(Span(f"{'next':<{MARGIN}}", GOOD), command_line(*words))


def command_line(*words: str) -> str:
    """Return a command as it is typed, on one line whatever its words hold."""
    return " ".join(map(_quoted, words))


def _quoted(word: str) -> str:
    import shlex

    if word.isprintable():
        return shlex.quote(word)
    escaped = word.replace("\\", "\\\\").replace("'", "\\'")
    return f"$'{visible(escaped)}'"
