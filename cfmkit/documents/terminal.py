"""A document as characters on a terminal: what of it fits into 15 lines, or everything, and the printing of its blocks.

A short page has the title with the window, requirements beside what matters most, one line for each note and warning,
and the files. Names, paths and commands are never broken, whatever the width.
"""

from __future__ import annotations

import io
import json
import textwrap
from dataclasses import dataclass
from typing import TYPE_CHECKING

from cfmkit.documents.document import (
    BLANK_LINE,
    ELLIPSIS_MARK,
    LABEL_COLUMNS,
    MIN_CLAUSE_LENGTH,
    NUMBER_START,
    CellGrid,
    GridColumn,
    JsonText,
    PageTable,
    Paragraph,
    Span,
    TextLine,
    Tone,
    ValueRow,
    Verbatim,
    WarningEntry,
    Written,
    line,
    shortened_to_clause,
    verdict,
    whole_line,
)
from cfmkit.errors import visible

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from rich.console import Console, ConsoleOptions, RenderableType
    from rich.segment import Segment
    from rich.table import Table as RichTable
    from rich.text import Text

    from cfmkit.documents.document import Block, Document, Note

MAX_LINES, MAX_LINES_WITH_TABLES = 15, 24
"""Of a short page of one mechanism, and of one that lists points, specifications or proposals: a screen."""
INDENT_COLUMNS, WORD_COLUMNS = 2, 12  # columns before a word such as ``test plan``, and columns that it gets
GAP_COLUMNS = 3  # columns between the two halves of the headline, and before a remedy
LEAST_GAP = 2  # columns between the two ends of a line: fewer would read as one text
LEAST_TEXT = 8  # characters of a text beside a name: with fewer only the name is shown
MIN_FACTS = 4  # lines of the headline that are filled with what is not required, where there is room
MORE_TEXT = "-v: all"  # what stands at the end of a short page
TONE_STYLES = {"good": Tone.GOOD, "warn": Tone.BAD, "bad": Tone.BAD}


def page(document: Document, width: int, everything: bool = False) -> Iterator[Block]:
    """Yield the blocks of a page: of a result what fits into `MAX_LINES`, or everything; else its body."""
    if not document.title:
        yield from document.body
        return
    top = list(_title(document, width))
    yield from top
    if everything:
        yield from _whole_page(document)
    else:
        most = MAX_LINES_WITH_TABLES if document.tables and not document.metrics else MAX_LINES
        yield from _short_page(document, width, most - len(top))


def _title(document: Document, width: int) -> Iterator[TextLine]:
    """Yield what it is, its main value and the window, and at the far end the verdict; below where there is no room."""
    name, summary = Span(document.title, Tone.LABEL), f"   {document.summary}" if document.summary else ""
    end = Span(document.verdict, TONE_STYLES[document.tone])
    left = len(document.title) + len(summary)
    if left + LEAST_GAP + len(document.verdict) <= width:
        yield whole_line(name, summary, " " * (width - left - len(document.verdict)), end)
        return
    if left <= width or not summary:
        yield whole_line(name, summary)
    else:
        yield whole_line(name)
        yield TextLine((Span(f"  {document.summary}"),))
    if document.verdict:
        yield whole_line("  ", end)


# --- a short page -----------------------------------------------------------------------------------------------------


def _short_page(document: Document, width: int, spare: int) -> Iterator[TextLine | CellGrid]:
    """Yield the lines below the title: what must stand first takes its lines, warnings and facts share the others."""
    notes = [text for note in document.notes if not note.is_detail for text in _note_lines(note, width)]
    tables = [text for table in document.tables if table.most != 0 for text in _table_lines(table, width)]
    follow = _file_lines(document.files, width)
    if document.next:
        follow.append(whole_line(_label("next", Tone.GOOD), document.next))
    needed = _most_of_headline(document.headline)
    spare -= len(notes) + len(tables) + len(follow)
    warnings = _warning_lines(document.warnings, width, max(spare - needed, min(len(document.warnings), 2)))
    yield from _headline(document.headline, width, max(spare - len(warnings), 1))
    yield from (*tables, *notes, *warnings, *follow)


def _most_of_headline(rows: Sequence[ValueRow]) -> int:
    """Return how many lines are kept for the headline where warnings would need them."""
    required = sum(row.required for row in rows)
    return max(required, min(MIN_FACTS, -(-len(rows) // 2)))


def _label(word: str, tone: str = Tone.LABEL) -> Span:
    return Span(f"{' ' * INDENT_COLUMNS}{word:<{WORD_COLUMNS}}" + ("" if len(word) < WORD_COLUMNS else " "), tone)


def _note_lines(note: Note, width: int) -> list[TextLine]:
    room = width - INDENT_COLUMNS - WORD_COLUMNS
    if note.is_command:
        return [whole_line(_label(note.word, note.tone), note.text)]
    if note.whole:
        lines = textwrap.wrap(note.text, room, break_long_words=False, break_on_hyphens=False) or [""]
        return [whole_line(_label(note.word if not at else "", note.tone), text) for at, text in enumerate(lines)]
    return [_with_remedy(_label(note.word, note.tone), "", note.short or note.text, note.remedy, room)]


def _with_remedy(word: Span, name: str, text: str, remedy: str, room: int) -> TextLine:
    """Return a line of a name, what fits of a text, and a remedy at the far end if the text keeps its number."""
    left = room - len(name)
    shown = shortened_to_clause(text, left) if left >= LEAST_TEXT else ""
    if remedy:
        beside = shortened_to_clause(text, max(left - len(remedy) - GAP_COLUMNS, 0))
        kept = bool(NUMBER_START.search(beside)) if NUMBER_START.search(shown) else not beside.endswith(ELLIPSIS_MARK)
        if beside != shown and (len(beside) < MIN_CLAUSE_LENGTH or not kept):
            remedy = ""
        else:
            shown = beside
    whole = name + shown if shown else name.removesuffix(": ")
    return whole_line(word, whole, " " * (room - len(whole) - len(remedy)) + remedy if remedy else "")


def _warning_lines(warnings: Sequence[WarningEntry], width: int, most: int) -> list[TextLine]:
    """Return one line for each warning, the names of the others in the last."""
    room = width - INDENT_COLUMNS - WORD_COLUMNS
    shown = warnings if len(warnings) <= most else warnings[: max(most - 1, 0)]
    lines = []
    for at, warning in enumerate(shown):
        word = f"{'warning' if len(warnings) == 1 else f'warnings {len(warnings)}'}" if not at else ""
        remedy = warning.options[0] if warning.options else ""
        lines.append(_with_remedy(_label(word, Tone.BAD), f"{warning.name}: ", warning.short, remedy, room))
    if rest := warnings[len(shown) :]:
        names = ", ".join(dict.fromkeys(warning.name for warning in rest))
        text = shortened_to_clause(f"and {len(rest)} more (-v): {names}", room)
        lines.append(whole_line(_label("" if shown else f"warnings {len(warnings)}", Tone.BAD), text))
    return lines


def _headline(rows: Sequence[ValueRow], width: int, most: int) -> Iterator[TextLine]:
    """Yield requirements beside what else matters; below each other where the page is narrow."""
    required, facts = [row for row in rows if row.required], [row for row in rows if not row.required]
    most = max(most, 1)
    if len(required) > most:  # those that are missed first
        required.sort(key=lambda row: row.ok is True)
        more = len(required) - most + 1
        required, facts = required[: most - 1], [ValueRow("", f"and {more} more requirements (-v)"), *facts]
    if not required:
        half = min(most, -(-len(facts) // 2))
        required, facts = facts[:half], facts[half:]
    left = _row_spans(required, width)
    room, tall = width - _widest_line(left) - GAP_COLUMNS, min(max(len(left), MIN_FACTS), most)
    fitting = [row for row in facts if _widest_line(_row_spans([row], width)) <= room]
    right = _row_spans(fitting[:tall], width)
    while right and _widest_line(right) > room:  # one has the longest label, another the longest value
        del right[-1]
    if facts[:2] != fitting[:2] or len(right) < min(2, tall, len(facts)):
        below = _row_spans([*required, *facts[: max(MIN_FACTS, len(required)) if left else None]], width)[:most]
        for cells in below:  # a number is never cut: at the margin the line goes on
            if len(cells) == 3 and _widest_line([cells]) > width:
                yield TextLine((*cells[:1], Span(cells[1].text.partition("  ")[0].rstrip())))
                yield TextLine(
                    (Span(" " * len(cells[0].text) + cells[1].text.partition("  ")[2].strip() + "  "), cells[2])
                )
            else:
                yield TextLine(cells)
        return
    for at in range(max(len(left), len(right))):
        texts: tuple[Span, ...] = left[at] if at < len(left) else ()
        pad = " " * (_widest_line(left) - sum(len(span.text) for span in texts) + GAP_COLUMNS)
        yield whole_line(*texts, *([Span(pad), *right[at]] if at < len(right) else []))


def _row_spans(rows: Sequence[ValueRow], width: int) -> list[tuple[Span, ...]]:
    """Return rows as spans: label, value with its window, bound and verdict, in columns."""
    texts = [_value_with_window(row) for row in rows]
    label = max([WORD_COLUMNS, *(len(row.label) + 2 for row in rows)])
    bounded = [at for at, row in enumerate(rows) if row.required]
    value = max([0, *(len(texts[at]) for at in bounded)])
    bound = max([0, *(len(row.bound) for row in rows)])
    value = max(min(value, width - INDENT_COLUMNS - label - bound - 12), 8)
    lines: list[tuple[Span, ...]] = []
    for row, text in zip(rows, texts, strict=True):
        head = Span(" " * INDENT_COLUMNS + f"{row.label:<{label}}")
        if not row.required:
            lines.append((head, Span(text)))
            continue
        shown = shortened_to_clause(text, value)
        lines.append((head, Span(f"{shown:<{value}}  {row.bound:<{bound}}  "), verdict(row.ok)))
    return lines


def _value_with_window(row: ValueRow) -> str:
    return f"{row.value} over {row.window}" if row.window else row.value


def _widest_line(lines: Iterable[Sequence[Span]]) -> int:
    """Return the number of characters of the widest line, at least 0."""
    return max([0, *(sum(len(span.text) for span in spans) for spans in lines)])


def _drop_ranked_columns(table: PageTable, width: int) -> PageTable:
    """Return a table without the columns of the highest ranks, as many as it takes to fit a page."""
    while any(column.rank for column in table.columns):
        if (
            sum(map(_least_columns, table.columns, _cell_texts(table))) + INDENT_COLUMNS + 2 * (len(table.columns) - 1)
            <= width
        ):
            break
        at = max(range(len(table.columns)), key=lambda k: table.columns[k].rank)
        table = table._replace(
            columns=(*table.columns[:at], *table.columns[at + 1 :]),
            rows=tuple((*row[:at], *row[at + 1 :]) for row in table.rows),
        )
    return table


def _cell_texts(table: PageTable) -> list[list[str]]:
    """Return the texts of the cells of each column."""
    return [
        [getattr(row[at], "text", str(row[at])) for row in table.rows if at < len(row)]
        for at in range(len(table.columns))
    ]


def _least_columns(column: GridColumn, texts: Sequence[str]) -> int:
    """Return how many characters a column needs: its longest cell, or word where cells may be cut."""
    words = [word for text in texts for word in (text.split() if column.wraps else [text])]
    return max([min(len(column.head), LEAST_COLUMNS) if column.wraps else len(column.head), *map(len, words)])


def _table_lines(table: PageTable, width: int) -> list[TextLine | CellGrid]:
    """Return a table as lines: as many rows as a short page has of it, each as wide as the page."""
    table = _drop_ranked_columns(table, width)
    rows = table.rows if table.most is None else table.rows[: table.most]
    more, table = len(table.rows) - len(rows), table._replace(rows=rows)
    texts = _cell_texts(table)
    heads = [column.head for column in table.columns]
    least = list(map(_least_columns, table.columns, texts))
    wide = [max(map(len, column), default=0) for column in texts]
    room = width - INDENT_COLUMNS - 2 * (len(wide) - 1)
    top = table.heading
    if not top and sum(wide) - wide[0] + max(wide[0], len(heads[0])) > room:  # a long head takes a line of its own
        top, heads[0] = heads[0], ""
    wide = [max(columns, len(head)) for columns, head in zip(wide, heads, strict=True)]
    lines: list[TextLine | CellGrid] = [line(f"  {top}", Tone.LABEL)] if top else []
    while sum(wide) > room:  # texts give way, words and numbers do not
        able = [at for at, column in enumerate(table.columns) if column.wraps and wide[at] > least[at]]
        if not able:  # cells take several lines
            columns = tuple(column._replace(head=head) for column, head in zip(table.columns, heads, strict=True))
            return [*lines, CellGrid(columns, rows, gap=2, indented=True)]
        widest = max(able, key=lambda at: wide[at])
        wide[widest] = max(wide[widest] - (sum(wide) - room), least[widest])
    cells = [[cell if isinstance(cell, Span) else Span(cell) for cell in row] for row in rows]
    if any(heads):
        cells.insert(0, [Span(head, Tone.FAINT) for head in heads])
    for row in cells:
        spans = [
            Span(f"{shortened_to_clause(span.text, wide[at]):<{wide[at] + 2}}", span.tone)
            for at, span in enumerate(row)
        ]
        lines.append(whole_line(" " * INDENT_COLUMNS, *spans))
    if more > 0:
        lines.append(line(f"  and {more} more (-v)", Tone.FAINT))
    return lines


def _file_lines(files: Written | None, width: int) -> list[TextLine]:
    """Return the folder and as many names as one line has room for; the folder is whole."""
    if files is None:
        return []
    room, text = width - INDENT_COLUMNS - WORD_COLUMNS, files.place
    names, most = files.names(), room - len(MORE_TEXT) - GAP_COLUMNS
    for at, name in enumerate(names):
        if len(text) + 2 + len(name) + (4 if at + 1 < len(names) else 0) > most:
            text += " ..."
            break
        text += f"{'  ' if not at else ' '}{name}"
    more = (
        " " * (room - len(text) - len(MORE_TEXT)) + MORE_TEXT
        if len(text) + GAP_COLUMNS + len(MORE_TEXT) <= room
        else ""
    )
    return [whole_line(_label("files", Tone.GOOD), text, Span(more, Tone.FAINT))]


# --- everything -------------------------------------------------------------------------------------------------------


def _whole_page(document: Document) -> Iterator[Block]:
    """Yield every value, table, note, warning with its remedies, and file."""
    yield BLANK_LINE
    rows = [*(row for row in document.headline if row.required), *(document.metrics or document.headline)]
    if rows:
        cells = [(f"  {row.label}", _value_with_window(row), row.bound, verdict(row.ok)) for row in dict.fromkeys(rows)]
        yield CellGrid((GridColumn(wraps=False), GridColumn(), GridColumn(wraps=False), GridColumn(wraps=False)), cells)
        yield BLANK_LINE
    for table in document.tables:
        if table.heading:
            yield line(f"  {table.heading}", Tone.LABEL)
        yield CellGrid(table.columns, table.rows, gap=2, indented=True)
        yield BLANK_LINE
    for note in document.notes:
        if note.is_command:
            yield whole_line(Span(f"{note.word:<{LABEL_COLUMNS}}", note.tone), note.text)
        else:
            yield Paragraph(note.word, note.text + (f": {note.remedy}" if note.remedy else ""), note.tone)
    for warning in document.warnings:
        yield Paragraph("warning", f"{warning.name}: {warning.text}" + (":" if warning.commands else ""), Tone.BAD)
        yield from (whole_line(" " * LABEL_COLUMNS + command) for command in warning.commands)
    if document.files is not None:
        yield Paragraph("files", f"{document.files.place}  {' '.join(document.files.files)}", Tone.GOOD)
        if document.files.seconds:
            yield Paragraph("time", f"{document.files.seconds:.2f} s")
    if document.next:
        yield whole_line(Span(f"{'next':<{LABEL_COLUMNS}}", Tone.GOOD), document.next)


# --- characters -------------------------------------------------------------------------------------------------------


def print_blocks(blocks: Iterable[Block], width: int, colours: bool = False, ascii_only: bool = False) -> str:
    """Return blocks as the text of a terminal with `width` columns."""
    return "".join(_print_block(block, width, colours, ascii_only) for block in blocks)


def _print_block(block: Block, width: int, colours: bool, ascii_only: bool) -> str:
    if isinstance(block, Verbatim):
        return block.text
    if isinstance(block, JsonText):
        return json.dumps(block.data, indent=2, ensure_ascii=ascii_only, allow_nan=False) + "\n"
    from rich.console import Console

    page = io.StringIO()
    console = Console(
        file=page, force_terminal=colours or None, width=width, highlight=False, markup=False, emoji=False
    )
    for item in _renderables(block, width):
        # What a text says about wrapping would be lost: rich prints a copy of it.
        no_wrap, overflow = getattr(item, "no_wrap", None), getattr(item, "overflow", None)
        console.print(_Visible(item), crop=False, no_wrap=no_wrap, overflow=overflow)
    return "\n".join(text.rstrip() for text in page.getvalue().split("\n"))


def _renderables(block: TextLine | Paragraph | CellGrid, width: int) -> Iterator[RenderableType]:
    """Yield what rich prints for a block; of a paragraph line by line."""
    if isinstance(block, CellGrid):
        yield _rich_table(block, width)
    elif isinstance(block, Paragraph):
        lines = textwrap.wrap(block.text, width - LABEL_COLUMNS, break_long_words=False, break_on_hyphens=False) or [""]
        yield _rich_text(Span(f"{block.word:<{LABEL_COLUMNS}}", block.tone), Span(lines[0]), whole=True)
        for text in lines[1:]:
            yield _rich_text(Span(" " * LABEL_COLUMNS + text), whole=True)
    else:
        yield _rich_text(*block.spans, whole=block.whole)


def _rich_text(*spans: Span, whole: bool = False) -> Text:
    from rich.text import Text

    text = Text.assemble(*((span.text, span.tone) for span in spans))
    if whole:
        text.no_wrap, text.overflow = True, "ignore"
    return text


LEAST_COLUMNS = 8  # columns that a cell of several lines gets at least: most words of the pages are not longer


def _least_width(block: CellGrid, rows: Sequence[Sequence[Text]]) -> int:
    """Return how wide a page has to be for a table of which only the columns of texts wrap."""
    widths = (2 if block.indented else 0) + block.gap * (len(block.columns) - 1)
    for place, column in enumerate(block.columns):
        longest = max([len(column.head), *(row[place].cell_len for row in rows if place < len(row))])
        widths += min(longest, LEAST_COLUMNS) if column.wraps else longest
    return widths


def _rich_table(block: CellGrid, width: int) -> RichTable:
    from rich.table import Table

    headed = any(column.head for column in block.columns)
    table = Table(box=None, show_header=headed, header_style=Tone.FAINT, padding=(0, block.gap, 0, 0), pad_edge=False)
    if block.indented:
        table.add_column("", width=0)
    rows = [[_rich_text(cell if isinstance(cell, Span) else Span(cell)) for cell in row] for row in block.rows]
    # Where the page is too narrow for what should not wrap, this is folded, too: a number that loses its last digit
    # or its unit at the margin would be a wrong one.
    folded = _least_width(block, rows) > width
    for column in block.columns:
        table.add_column(column.head, overflow="fold", no_wrap=not (column.wraps or folded))
    for cells in rows:
        table.add_row(*([""] if block.indented else []), *cells)
    return table


@dataclass(frozen=True)
class _Visible:
    """Something to print, in which a name that holds control characters commands nothing."""

    item: RenderableType

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> Iterator[Segment]:
        from rich.segment import Segment

        for text, style, control in console.render(self.item, options):
            yield Segment("\n".join(map(visible, text.split("\n"))), style, control)
