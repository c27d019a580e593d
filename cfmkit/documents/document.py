"""The description of a result, `Document`, that commands return and renderers read: its parts, its `--json` data.

A document says what was found, not how it looks: `terminal`, `html`, `notebook` and `continuous_integration` of this
package each show it in their way, and `envelope` has it as JSON, with the same keys first whatever the verb and the
outcome. Parts are named tuples and not dataclasses because every start of the program makes these classes: in 0.07 ms
each instead of 0.5.
"""

from __future__ import annotations

import re
from collections import defaultdict
from dataclasses import dataclass, replace
from dataclasses import field as attribute
from enum import StrEnum
from typing import TYPE_CHECKING, Any, NamedTuple

from cfmkit.errors import ExitCode, visible

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    from matplotlib.figure import Figure

    Record = Mapping[str, Any]


class Tone(StrEnum):
    """Styles. Colours only repeat what a word says, and blue stands against yellow, which everybody can tell apart."""

    PLAIN = ""
    GOOD = "cyan"
    BAD = "bold yellow"
    LABEL = "bold"
    FAINT = "dim"


LABEL_COLUMNS = 11  # columns of the words that begin a paragraph: ``test plan`` and two blanks


class Span(NamedTuple):
    """A piece of text and its tone."""

    text: str
    tone: str = Tone.PLAIN
    link: str = ""  # where it leads on a page that has links


class TextLine(NamedTuple):
    """One line of text."""

    spans: tuple[Span, ...] = ()  # from left to right
    whole: bool = False  # whether it keeps its length where the terminal is narrower: paths and commands are copied


BLANK_LINE = TextLine()


class Paragraph(NamedTuple):
    """A text of any length that a word such as ``warning`` begins; nothing in it is cut."""

    word: str
    text: str
    tone: str = Tone.LABEL


class GridColumn(NamedTuple):
    """A column of a table: its head, and whether its cells may take several lines."""

    head: str = ""
    wraps: bool = True
    # which columns short pages leave out where all do not fit, the largest number first; those with 0 stay
    rank: int = 0


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


def line(text: str, tone: str = Tone.PLAIN) -> TextLine:
    """Return a line of one tone."""
    return TextLine((Span(text, tone),))


def whole_line(*spans: str | Span) -> TextLine:
    """Return a line that keeps its length."""
    return TextLine(tuple(Span(span) if isinstance(span, str) else span for span in spans), whole=True)


def verdict(ok: bool | None) -> Span:
    """Return the word for whether a requirement is met; empty for None, where there is no requirement."""
    return Span("") if ok is None else Span("ok", Tone.GOOD) if ok else Span("MISSED", Tone.BAD)


def format_bounds(bounds: Mapping[str, Any]) -> str:
    """Return the bounds ``min`` and ``max`` of a requirement, as far as it has them."""
    low, high = bounds["min"], bounds["max"]
    if low is None:
        return "" if high is None else f"<= {high}"
    return f">= {low}" if high is None else f"{low} to {high}"


def name_in_words(name: str) -> str:
    """Return a name such as ``force_mean`` with spaces instead of underscores."""
    return name.replace("_", " ")


class Field(NamedTuple):
    """One column of a table of records: its head, and the cell of a record."""

    head: str
    cell: Callable[[Any], str]
    wraps: bool = False


def field(name: str, head: str | None = None, wraps: bool = False) -> Field:
    """Return a column that shows one field of a record."""
    return Field(name if head is None else head, lambda record: str(record[name]), wraps)


def record_table(heading: str, records: Iterable[Record], fields: Sequence[Field]) -> Iterator[Block]:
    """Yield a table of records under its heading; nothing where there are none."""
    rows = [[column.cell(record) for column in fields] for record in records]
    if not rows:
        return
    yield BLANK_LINE
    if heading:
        yield line(heading, Tone.LABEL)
    yield CellGrid(tuple(GridColumn(column.head, column.wraps) for column in fields), rows, gap=2, indented=True)


class Written(NamedTuple):
    """The files of a run, in the order in which they were written, their folder, and how long the run took."""

    folder: str
    files: tuple[str, ...]
    seconds: float = 0.0

    @property
    def data(self) -> dict[str, Any]:
        """Folder, files and duration for the JSON document."""
        return {"out": self.folder, "files": list(self.files)}

    @property
    def place(self) -> str:
        """The folder as it is shown."""
        return f"{visible(self.folder.rstrip('/'))}/"

    def names(self) -> list[str]:
        """Return the files, those of a subfolder together: ``geometry/{cam.dxf,...}``."""
        folders: dict[str, list[str]] = defaultdict(list)
        for name in self.files:
            folder, _, base = name.rpartition("/")
            folders[folder].append(base)
        return [
            f"{folder}/{bases[0]}" if len(bases) == 1 else f"{folder}/{{{bases[0]},...}}"
            for folder, bases in folders.items()
            if folder
        ] + [base for base in folders[""] if base != "manifest.json"]


def next_command(*words: str) -> TextLine:
    """Return the line that says which command follows, never broken: it is copied."""
    return whole_line(Span(f"{'next':<{LABEL_COLUMNS}}", Tone.GOOD), command_line(*words))


def command_line(*words: str) -> str:
    """Return a command as it is typed, on one line whatever its words hold."""
    return " ".join(map(_quote_word, words))


def _quote_word(word: str) -> str:
    import shlex

    if word.isprintable():
        return shlex.quote(word)
    escaped = word.replace("\\", "\\\\").replace("'", "\\'")
    return f"$'{visible(escaped)}'"


class ValueRow(NamedTuple):
    """One value of a result, with the bound that it has to keep if there is one."""

    label: str
    value: str
    bound: str = ""
    ok: bool | None = None  # None: nothing is required
    window: str = ""  # where it holds, if that is not the window of the title
    about: str = ""  # what it is

    @property
    def required(self) -> bool:
        """Whether it has to keep a bound."""
        return self.ok is not None


class PageTable(NamedTuple):
    """Records under a heading."""

    heading: str
    columns: tuple[GridColumn, ...]
    rows: tuple[tuple[str | Span, ...], ...]
    most: int | None = None  # rows on a short page; 0: none of it


class Note(NamedTuple):
    """A statement that a word such as ``yield`` begins; on a short page one line of it."""

    word: str
    text: str
    remedy: str = ""  # what changes it, as an option that can be pasted
    tone: str = Tone.LABEL
    whole: bool = False  # whether a short page has all of it, too: how a run ended
    short: str = ""  # what a short page has instead; empty: the clauses of the text that fit
    is_command: bool = False  # whether the text is a command: it is copied, and never broken
    is_detail: bool = False  # whether short pages leave it out


class WarningEntry(NamedTuple):
    """A finding, for short pages in one clause, with the commands that remedy it."""

    name: str
    short: str  # at most `MAX_WARNING_LENGTH` characters
    text: str
    options: tuple[str, ...] = ()  # ``--set ...``, each of them a remedy
    commands: tuple[str, ...] = ()  # the same as whole commands


@dataclass(frozen=True, repr=False)
class Document:
    """Outcome of one command."""

    # more of the JSON document than the envelope has; values for its keys replace them
    data: Mapping[str, Any] = attribute(default_factory=dict)
    # what a page shows as it stands, for commands that list; empty for results. It may be computed as it is read
    body: Iterable[Block] = ()
    exit_code: ExitCode = ExitCode.OK  # of the process
    complaints: tuple[str, ...] = ()  # lines for standard error, whatever the options
    quiet_complaints: tuple[str, ...] = ()  # more of them where the page is not shown
    errors: tuple[Mapping[str, Any], ...] = ()  # the same for the JSON document

    title: str = ""  # of what it is
    summary: str = ""  # its main value and window, behind the title
    verdict: str = ""  # in a few words
    headline: tuple[ValueRow, ...] = ()  # requirements first, then what matters most
    metrics: tuple[ValueRow, ...] = ()  # all values
    tables: tuple[PageTable, ...] = ()
    notes: tuple[Note, ...] = ()
    warnings: tuple[WarningEntry, ...] = ()
    figures: Mapping[str, Callable[[], Figure]] = attribute(default_factory=dict)
    files: Written | None = None
    next: str = ""  # the command that follows

    @property
    def tone(self) -> str:
        """``good``, ``warn`` or ``bad``, by how it ended."""
        return TONES_BY_EXIT_CODE.get(int(self.exit_code), "warn")

    def __repr__(self) -> str:
        """Return what it is of and how it ended."""
        return f"<Document {self.title!r}: {self.summary}; {self.verdict}>"[:500]


TONES_BY_EXIT_CODE = {0: "good", 3: "bad", 4: "bad", 5: "bad", 6: "warn", 7: "bad", 70: "bad"}
"""How a run ended, by its exit code, as the colour of its verdict."""
MAX_WARNING_LENGTH = 100  # characters of a warning on a page: its name, its consequence and a remedy
MIN_CLAUSE_LENGTH = 24
"""Characters below which a clause says too little: rather a part of the next one is taken as well."""
ELLIPSIS_MARK = "..."  # what ends a text that is cut inside a clause
NUMBER_START = re.compile(r"(?<![A-Za-z_])\d")
PLAIN_WORDS = re.compile(r"[a-z]+ [a-z]+ ")


def shortened_to_clause(text: str, limit: int) -> str:
    """Return the clauses of a sentence that fit, with its number if it has one; else its beginning, with dots.

    It begins with the first clause; where this has no number, with the first one that has.

    Examples
    --------
    >>> shortened_to_clause("the roller is too large (16 mm): the first 1.1 mm run on a corner", 40)
    'the roller is too large (16 mm)'
    >>> shortened_to_clause("beams are wide and stiff: bending takes about 6.7 % more energy, and the force rises", 45)
    'bending takes about 6.7 % more energy'
    >>> shortened_to_clause("beams that are wide are stiffer than in beam theory", 30)
    'beams that are wide are ...'
    """
    text = " ".join(text.split())
    if len(text) <= limit:
        return text
    later = re.split(r"(?<=[:;]) ", text)[1:]
    if not NUMBER_START.search(_beginning(text, limit)):
        for at, clause in enumerate(later):
            if NUMBER_START.search(clause) and PLAIN_WORDS.match(clause):
                return _beginning(" ".join(later[at:]), limit)
    return _beginning(text, limit)


def _beginning(text: str, limit: int) -> str:
    """Return what fits of a text, cut where a clause ends; else between words, with dots."""
    if len(text) <= limit:
        return text
    ends = [
        at for mark in ("; ", ": ", ". ", ", ", " (") for at in _find(text, mark) if MIN_CLAUSE_LENGTH <= at <= limit
    ]
    whole = [at for at in ends if text.count("(", 0, at) == text.count(")", 0, at)]
    if whole:
        return text[: max(whole)]
    if (cut := text.rfind(" ", 0, max(limit - 3, 0))) > 0:
        return f"{text[:cut]} {ELLIPSIS_MARK}"
    cut = text.rfind(" ", 0, limit + 1)
    return text[:cut] if cut > 0 else text[:limit]


def _find(text: str, mark: str) -> Iterator[int]:
    """Yield the index of each occurrence of a mark in a text."""
    at = text.find(mark)
    while at >= 0:
        yield at
        at = text.find(mark, at + 1)


def with_skipped_families(skipped: Sequence[str], document: Document) -> Document:
    """Return a document that also reports the families that were skipped: one line each, and in its data."""
    if not skipped:
        return document
    others = document.data.get("warnings", ())
    data = {"warnings": [*others, *({"name": "family_skipped", "message": text} for text in skipped)]}
    lines = tuple(f"warning  {text}; skipped (see `cfmkit doctor`)" for text in skipped)
    return replace(document, data={**document.data, **data}, complaints=(*document.complaints, *lines))


def envelope(document: Document) -> dict[str, Any]:
    """Return what ``--json`` prints of a document."""
    plain = {
        "status": status_of(document.exit_code),
        "message": "",
        "exit_code": int(document.exit_code),
        "metrics": {},
        "requirements": [],
        "warnings": [],
        "errors": list(document.errors),
    }
    return plain | dict(document.data)


def status_of(code: ExitCode) -> str:
    """Return the status word of an exit code, for commands without a solver."""
    return "complete" if code is ExitCode.OK else code.name.lower()
