"""Strict reading of a YAML specification into plain Python values, with line and column of every key and value.

PyYAML is used as scanner and parser only. Tags, anchors, merge keys and second documents are faults. Faults are
collected, in plain words (`ParsedYaml.faults`).

An unquoted scalar is read as in YAML 1.2, minus what misleads. YAML 1.1 reads ``1:30`` as 90, ``010`` as 8 and ``no``
as false; 1.2 does not, and people expect either. What two readers take differently is refused with a hint.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import yaml
from yaml.events import (
    AliasEvent,
    DocumentStartEvent,
    Event,
    MappingEndEvent,
    MappingStartEvent,
    ScalarEvent,
    SequenceEndEvent,
    SequenceStartEvent,
)

from cfmkit.errors import QuantityError
from cfmkit.specs.units.strict_decimal_number import (
    MAX_NUMBER_LENGTH,
    NUMBER_PATTERN,
    number_complaint,
    odd_character,
    quote,
    read_number,
)

if TYPE_CHECKING:
    from collections.abc import Iterator

    from yaml.error import Mark, YAMLError

    from cfmkit.specs.yamlio.paths import Path


MAX_FILE_BYTES = 1_000_000
MOST_KINDS = 20
_FOREIGN_MARKS = {
    b"\xff\xfe\x00\x00": "UTF-32",
    b"\x00\x00\xfe\xff": "UTF-32",
    b"\xff\xfe": "UTF-16",
    b"\xfe\xff": "UTF-16",
}


@dataclass(frozen=True)
class Fault:
    """Something wrong at a place of a source, before it is known whose source that is."""

    line: int
    column: int
    path: tuple[str | int, ...]
    message: str
    makes_value_unusable: bool = True  # whether nothing more should be said about the value at `path`


class Unreadable(Exception):
    """The source cannot be read any further."""

    def __init__(self, fault: Fault) -> None:
        """Keep the fault that ended the reading."""
        self.fault = fault
        super().__init__(fault.message)


def decode(data: bytes | str) -> str:
    """Return the text of a source without its byte order mark.

    Raises Unreadable if it is too large, or not UTF-8.
    """
    if len(data) > MAX_FILE_BYTES:
        raise Unreadable(Fault(1, 1, (), f"the file is larger than {MAX_FILE_BYTES} bytes; put long data elsewhere"))
    if isinstance(data, str):
        return data.removeprefix("\ufeff")
    for mark, name in _FOREIGN_MARKS.items():
        if data.startswith(mark):
            raise Unreadable(Fault(1, 1, (), f"the file is {name}; save it as UTF-8"))
    try:
        return data.decode("utf-8").removeprefix("\ufeff")
    except UnicodeDecodeError as error:
        before = data[: error.start].decode("utf-8")
        what = f"the byte 0x{data[error.start]:02x} at offset {error.start} is not UTF-8; save the file as UTF-8"
        raise Unreadable(Fault(*_position(before, len(before)), (), what)) from None


def replace_odd_characters(text: str) -> tuple[str, list[Fault]]:
    """Return the text with a space for every character that is refused, and a fault for each kind of them."""
    kinds = {char: kind[1] for char in set(text) if (kind := odd_character(char))}
    first = sorted((text.index(char), char) for char in sorted(kinds)[:MOST_KINDS])
    faults = [_odd_character_fault(text, index, kinds[char], text.count(char)) for index, char in first]
    return text.translate(dict.fromkeys(map(ord, kinds), " ")), faults


def _odd_character_fault(text: str, index: int, what: str, count: int) -> Fault:
    more = f" ({count} in all)" if count > 1 else ""
    return Fault(*_position(text, index), (), f"here is {what}{more}")


def _position(text: str, index: int) -> tuple[int, int]:
    """Return (line, column) of an index, both from 1; lines end with LF, CRLF or CR."""
    before = text[:index].replace("\r\n", "\n").replace("\r", "\n")
    return before.count("\n") + 1, len(before) - before.rfind("\n")


_YAML_LOADERS: list[Any] = [*filter(None, [getattr(yaml, "CSafeLoader", None)]), yaml.SafeLoader]
"""libyaml if PyYAML has it, which is fast, then PyYAML's own parser, for the words of errors: those of libyaml vary."""
MAX_DEPTH = 32
MAX_NODES = 100_000
MAX_FAULTS = 1000
_WHOLE_PATTERN, _DIGIT_PATTERN = re.compile("[-+]?[0-9]+"), re.compile("[0-9]")
_ZERO_PATTERNS, _WITH_UNIT = re.compile("[-+]?0+"), re.compile("(?>[0-9]+(?:[eE][-+]?[0-9]+)?) *[^-+0-9., ].*")


@dataclass
class ParsedYaml:
    """Content of a YAML source, as far as it could be read.

    `keys` and `values` hold (line, column) by path. `broken` says that the tree is not complete, so that what is
    missing in it means nothing; `unparsed` that this is because it is no YAML.
    """

    tree: Any = None
    keys: dict[Path, tuple[int, int]] = field(default_factory=dict)
    values: dict[Path, tuple[int, int]] = field(default_factory=dict)
    faults: list[Fault] = field(default_factory=list)
    broken: bool = False
    unparsed: bool = False


def read_text(data: bytes | str) -> ParsedYaml:
    """Return what a source says, with every fault found in it."""
    try:
        text, faults = replace_odd_characters(decode(data))
    except Unreadable as stop:
        return ParsedYaml(faults=[stop.fault], broken=True)
    reading = _parse(text)
    # An odd character may well be the reason why the rest is no YAML.
    reading.faults = faults if reading.unparsed and faults else faults + reading.faults
    return reading


def _parse(text: str) -> ParsedYaml:
    """Return the content of clean text; errors are worded by the last of the parsers, which every installation has."""
    for loader in _YAML_LOADERS:
        reading = ParsedYaml()
        try:
            reading.tree = _Builder(reading, yaml.parse(text, Loader=loader)).document()
            return reading
        except Unreadable as stop:
            reading.broken = True
            reading.faults.append(stop.fault)
            return reading
        except yaml.YAMLError as error:
            fault = fault_of(error)
    return ParsedYaml(faults=[fault], broken=True, unparsed=True)


def read_trusted(text: str) -> Any:
    """Return what YAML of the package's own data files holds, which no user writes: no places, limits or hints."""
    return yaml.load(text, _YAML_LOADERS[0])


class _Builder:
    """Takes parser events one by one and fills a `ParsedYaml`."""

    def __init__(self, reading: ParsedYaml, events: Iterator[Event]) -> None:
        self.reading = reading
        self.events = events
        self.nodes = 0

    def document(self) -> Any:
        """Return the only document of the stream; None if there is none."""
        next(self.events)
        event = next(self.events)
        if not isinstance(event, DocumentStartEvent):
            return None
        tree = self._build_node(next(self.events), ())
        next(self.events)
        event = next(self.events)
        if isinstance(event, DocumentStartEvent):
            raise Unreadable(_fault_at(event, (), "a second document starts here; write one specification per file"))
        return tree

    def _build_node(self, event: Event, path: Path) -> Any:
        self._count_node(event, path)
        self.reading.values.setdefault(path, _place_of(event))
        self._refuse_decoration(event, path)
        if isinstance(event, ScalarEvent):
            return self._build_scalar(event, path)
        if isinstance(event, SequenceStartEvent):
            return self._build_sequence(path)
        return self._build_mapping(path, bool(event.flow_style)) if isinstance(event, MappingStartEvent) else None

    def _count_node(self, event: Event, path: Path) -> None:
        self.nodes += 1
        if self.nodes > MAX_NODES:
            raise Unreadable(_fault_at(event, (), f"more than {MAX_NODES} values; put long data into a separate file"))
        if len(path) > MAX_DEPTH:
            raise Unreadable(_fault_at(event, (), f"blocks and lists are nested more than {MAX_DEPTH} deep"))

    def _refuse_decoration(self, event: Event, path: Path) -> None:
        anchor = getattr(event, "anchor", None)
        if isinstance(event, AliasEvent):
            self._complain(event, path, f"'*{anchor}' (an alias) is not read; write the value out")
        elif anchor:
            self._complain(event, path, f"'&{anchor}' (an anchor) is not read; remove it")
        if tag := getattr(event, "tag", None):
            message = tag.replace("tag:yaml.org,2002:", "!!")
            self._complain(event, path, f"the tag {quote(message)} is not read; write the plain value")

    def _build_scalar(self, event: ScalarEvent, path: Path) -> Any:
        try:
            return check_text(event.value) if event.style else read_plain(event.value)
        except QuantityError as error:
            self._complain(event, path, str(error))
            return event.value

    def _build_sequence(self, path: Path) -> tuple[Any, ...]:
        items: list[Any] = []
        last, zeros, spaced = None, [], False  # the item before, and what may be a zero or the start of 0,5 mm
        while not isinstance(event := next(self.events), SequenceEndEvent):
            if last is not None and _split_at_comma(last, event):
                if _ZERO_PATTERNS.fullmatch(getattr(last, "value", "")):
                    zeros.append((last, event))
                else:
                    self._decimal_comma(last, event, (*path, len(items) - 1))
                    last = None
                    continue
            elif last is not None:
                spaced = spaced or not _adjacent(last, event)
            items.append(self._build_node(event, (*path, len(items))))
            last = event
        if zeros and spaced:  # [0,240 mm] alone is two values, as zero needs no unit
            self._decimal_comma(*zeros[0], path)
        return tuple(items)

    def _build_mapping(self, path: Path, flow: bool) -> dict[str, Any]:
        block: dict[str, Any] = {}
        last, key = None, ""  # the value before, and its key
        while not isinstance(event := next(self.events), MappingEndEvent):
            if flow and last is not None and _continues_number(last, event):
                self._decimal_comma(last, event, (*path, key))
                if not _is_empty(following := next(self.events)):
                    self._build_node(following, (*path, ""))
                continue
            key = self._build_key(event, path)
            key_path = (*path, key)
            if first := self.reading.keys.get(key_path):
                message = f"the key {quote(key)} was given in line {first[0]} already; keep one"
                self._complain(event, key_path, message, makes_value_unusable=False)
            self.reading.keys.setdefault(key_path, _place_of(event))
            last = next(self.events)
            block.setdefault(key, self._build_node(last, key_path))
        return block

    def _decimal_comma(self, whole: Event, rest: Event, path: Path) -> None:
        """Complain about a number that YAML ended at its decimal comma, as in ``{pivot: 28,303 N*mm/rad}``."""
        before, after = getattr(whole, "value", ""), getattr(rest, "value", "")
        message = f"{quote(f'{before},{after}')} has a decimal comma; write {before}.{after}"
        if not any(fault.path == path for fault in self.reading.faults):  # thousands have more than one
            self._complain(whole, path, message)

    def _build_key(self, event: Event, path: Path) -> str:
        """Return a key, after a complaint if it is no plain name: then its text, of a list or block an empty one."""
        self._refuse_decoration(event, path)
        if not isinstance(event, ScalarEvent):
            self._build_node(event, (*path, ""))
            self._complain(event, path, "a key must be a name, not a list or a block")
            return ""
        key = self._build_scalar(event, path)
        if not isinstance(key, str):
            self._complain(event, path, f"the key {quote(event.value)} is not a name; keys start with a letter")
        elif key == "<<" and not event.style:
            self._complain(event, path, "'<<' (a merge key) is not read; write the keys out")
        return event.value

    def _complain(self, event: Event, path: Path, message: str, makes_value_unusable: bool = True) -> None:
        if len(self.reading.faults) >= MAX_FAULTS:
            raise Unreadable(_fault_at(event, (), f"more than {MAX_FAULTS} faults; reading stopped here"))
        self.reading.faults.append(Fault(*_place_of(event), path, message, makes_value_unusable))


def _continues_number(value: Event, key: Event) -> bool:
    """Return True if an item in the place of a key is the rest of the number before it, as in ``{k: 28,303}``."""
    if not isinstance(value, ScalarEvent) or not isinstance(key, ScalarEvent) or value.style or key.style:
        return False
    return bool(_WHOLE_PATTERN.fullmatch(value.value) and _DIGIT_PATTERN.match(key.value))


def _split_at_comma(value: Event, item: Event) -> bool:
    """Return True if two items of a list are the halves of one quantity: 2 and 5 mm, with no space after the comma."""
    return (
        _continues_number(value, item)
        and _adjacent(value, item)
        and bool(_WITH_UNIT.fullmatch(getattr(item, "value", "")))
    )


def _adjacent(value: Event, item: Event) -> bool:
    """Return True if nothing but a comma is between two items."""
    end: Any = value.end_mark
    start: Any = item.start_mark
    return bool((end.line, end.column + 1) == (start.line, start.column))


def _is_empty(event: Event) -> bool:
    return isinstance(event, ScalarEvent) and not event.value and not event.style


def _place_of(event: Event) -> tuple[int, int]:
    mark: Any = event.start_mark
    return mark.line + 1, mark.column + 1


def _fault_at(event: Event, path: Path, message: str) -> Fault:
    return Fault(*_place_of(event), path, message)


_CONSTANT_WORDS: dict[str, bool | None] = {
    **dict.fromkeys(("", "~", "null", "Null", "NULL"), None),
    **dict.fromkeys(("true", "True", "TRUE"), True),
    **dict.fromkeys(("false", "False", "FALSE"), False),
}
_CONTROL_PATTERN = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f]")
_INTEGER_PATTERN = re.compile("[-+]?[0-9]+")


def read_plain(text: str) -> Any:
    """Return what an unquoted scalar means: None, a bool, an int, a float, or the text itself.

    Raises QuantityError if it looks like a number but is none that everybody reads the same way.
    """
    if text in _CONSTANT_WORDS:
        return _CONSTANT_WORDS[text]
    if NUMBER_PATTERN.fullmatch(text):
        return _read_scalar_number(text)
    if len(text) <= MAX_NUMBER_LENGTH and (complaint := number_complaint(text, only_traps=True)):
        raise QuantityError(_advise_quoting(complaint))
    return text


def check_text(text: str) -> str:
    """Return the text of a quoted scalar.

    Raises QuantityError if an escape put a control character into it.
    """
    if match := _CONTROL_PATTERN.search(text):
        raise QuantityError(f"the text holds the control character U+{ord(match[0]):04X}; remove it")
    return text


def _read_scalar_number(text: str) -> int | float:
    try:
        value = read_number(text)
    except QuantityError as error:
        raise QuantityError(_advise_quoting(str(error))) from None
    return int(text) if _INTEGER_PATTERN.fullmatch(text) else value


def _advise_quoting(complaint: str) -> str:
    return f"{complaint} (or quote it, if text is meant)"


_PLAIN_WORDS = (
    ("mapping values are not allowed", "a second ': ' on one line, or a line indented under a value; "
     "quote text that holds ': ', or put the key on a separate line"),
    ("sequence entries are not allowed", "a '- ' item cannot start here; put it on a separate line"),
    ("'([@`])' that cannot start any token", "text cannot start with this character; quote it"),
    ("'%' that cannot start any token", "text cannot start with '%'; quote it, or write the number before it: 5 %"),
    ("unexpected end of stream", "a quoted text is never closed"),
    ("unexpected document separator", "a quoted text is never closed"),
    ("unknown escape character|escape sequence of", "an unknown escape after '\\'; in '...' nothing is escaped"),
    ("expected ',' or ']', but got '<stream end>'", "a '[' is never closed"),
    ("expected ',' or '}', but got '<stream end>'", "a '{' is never closed"),
    ("expected ',' or ']'", "in a [...] list a ',' or ']' is missing before this"),
    ("expected ',' or '}'", "in a {...} block a ',' or '}' is missing before this"),
    ("expected the node content, but found '<stream end>'",
     "the file ends where a value is missing, or a '[' or '{' is never closed"),
    ("expected the node content, but found '(.+)'", r"a value is missing before \1"),
    ("expected <block end>, but found '<scalar>'", "text after a closing quote; quote the whole text"),
    ("expected <block end>, but found '<block mapping start>'|expected <block end>, but found '<block sequence start>'",
     "this line is indented differently from the lines it belongs to"),
    ("expected <block end>, but found '\\?'", "a key among list items; indent it under an item"),
    ("expected <block end>, but found '-'", "a list item among keys: indent it under the key it belongs to"),
    ("expected <block end>, but found '(.+)'", r"\1 does not belong here; check the indentation"),
    ("could not find expected ':'", "a key without ': ' after it"),
    ("expected chomping or indentation indicators|expected a comment or a line break", "text after '|' or '>'; put it "
     "on the next line, or quote text that starts so"),
    ("directive|incompatible YAML", "a '%' line before the specification is not read; remove it"),
    ("tag", "tags (!...) are not read; write the plain value"),
    ("expected alphabetic or numeric character", "'&' and '*' (anchors) are not read; quote text that starts so"),
    ("expected '<document start>'", "text after the end of the specification, or before its start"),
)  # fmt: skip


def fault_of(error: YAMLError) -> Fault:
    """Return the fault that a YAML error tells, where it is and in plain words."""
    problem = f"{getattr(error, 'context', None) or ''}: {getattr(error, 'problem', None) or error}"
    message = next(filter(None, (_translate_problem(problem, *entry) for entry in _PLAIN_WORDS)), None)
    mark: Mark | None = getattr(error, "problem_mark", None)
    if message and "never closed" in message:
        mark = getattr(error, "context_mark", None) or mark
    opened: Mark | None = getattr(error, "context_mark", None)
    if message and "is missing before" in message and opened and mark and opened.line != mark.line:
        message += f" (it starts in line {opened.line + 1})"
    line, column = (mark.line + 1, mark.column + 1) if mark else (1, 1)
    return Fault(line, column, (), message or "this is not YAML: " + " ".join(problem.strip(": ").split()))


def _translate_problem(problem: str, pattern: str, words: str) -> str | None:
    match = re.search(pattern, problem)
    return match.expand(words.replace("\\'", "\\\\'")) if match else None
