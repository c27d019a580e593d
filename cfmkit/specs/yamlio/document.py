"""A specification as written: tree, place of every node, problems, values set by options, check by a model.

In ``--set mechanism.springs.0=2 N/mm`` the value is read exactly as
in a file; lists and blocks in flow style only. A key that has dots itself stands in quotes: ``--set
'sensitivity.parameters."mechanism.roller_radius"={normal: 0.1 mm}'``.
"""

from __future__ import annotations

import dataclasses
import re
from dataclasses import dataclass, field
from pathlib import Path as FilePath
from typing import TYPE_CHECKING, Any, TypeVar

from pydantic import BaseModel, ValidationError

from cfmkit.errors import Problem, SpecError, UsageError
from cfmkit.specs.units.fields import BareFloat, BareInt
from cfmkit.specs.units.strict_decimal_number import quote
from cfmkit.specs.yamlio.explain_validation_errors import explain, not_among
from cfmkit.specs.yamlio.paths import NoSuchPlace, Path, parse_indices, to_dotted, with_value
from cfmkit.specs.yamlio.tree_builder import MAX_DEPTH, MAX_FILE_BYTES, Fault, ParsedYaml, read_text

if TYPE_CHECKING:
    from collections.abc import Sequence


SpecType = TypeVar("SpecType", bound=BaseModel)

MOST_PROBLEMS = 100


@dataclass(frozen=True)
class YamlDocument:
    """Content of a file and the options after it, before any type is known."""

    tree: Any  # nested dicts, tuples, text, numbers, bools and None
    source: str  # the file's name for messages
    folder: FilePath | None = None  # what file names in the specification are relative to
    problems: tuple[Problem, ...] = ()  # every fault found while reading
    base: YamlDocument | None = None  # what gives the values that this one does not have: see `base_file.with_base`
    _lines: tuple[str, ...] = field(default=(), repr=False, compare=False)  # of the text
    _reading: ParsedYaml = field(default_factory=ParsedYaml, repr=False, compare=False)
    _spoilt: tuple[Path, ...] = field(default=(), repr=False, compare=False)
    _options: tuple[tuple[Path, str], ...] = field(default=(), repr=False, compare=False)

    @property
    def set_by_options(self) -> tuple[str, ...]:
        """Paths that options have set, dotted, in their order."""
        return tuple(".".join(map(str, path)) for path, _ in self._options)

    @property
    def path(self) -> FilePath:
        """The file, as far as the document is one of a folder."""
        return (self.folder or FilePath()) / FilePath(self.source).name

    @property
    def is_broken(self) -> bool:
        """Whether the tree is not complete, so that what is missing in it means nothing."""
        return self._reading.broken

    def place(self, path: str | Path) -> tuple[int, int]:
        """Return (line, column) of the value at a path, or of the nearest block above it; (0, 0) in an option.

        Of a value of the base it is the place where the base is named.
        """
        path = self._as_path(path)
        if self._option_at(path):
            return 0, 0
        return self._place_in_file(path if self._document_of_value(path) is self else ("base",), at_key=False)

    def set(self, option: str) -> YamlDocument:
        """Return the document changed by an option such as ``a.b=1 mm``.

        Faults in the value become problems of the new document.

        Raises UsageError if the option has no path or no value.
        """
        parsed = parse_option(option)
        if parsed.faults:
            return self._with_problems(parsed, [(fault.path, fault.message) for fault in parsed.faults])
        if self._reading.broken:
            return self
        try:
            tree = with_value(self.tree, parsed.path, parsed.value)
        except NoSuchPlace as error:
            return self._with_problems(parsed, [((), str(error))])
        path = parse_indices(parsed.path, tree)
        options = [old for old in self._options if old[0][: len(path)] != path]
        return dataclasses.replace(self, tree=tree, _options=(*options, (path, parsed.label)))

    def family(self, families: Sequence[str]) -> str:
        """Return what the specification says its family is.

        Raises SpecError if it says none of these `families`, or cannot be read.
        """
        family = self.tree.get("family") if isinstance(self.tree, dict) else None
        if self._reading.broken or not isinstance(self.tree, dict):
            raise SpecError(_sort_problems(self.problems))
        if isinstance(family, str) and family in families:
            return family
        missing = f"the key 'family' is missing: one of {', '.join(families)}"
        problem = self.problem(("family",), not_among(family, families)) if family else self.problem((), missing)
        raise SpecError(_sort_problems((*self.problems, problem)))

    def bind(self, spec_type: type[SpecType]) -> SpecType:
        """Return the specification, checked.

        Raises SpecError with every problem of the file and the options.
        """
        if self._reading.broken or not isinstance(self.tree, dict):
            raise SpecError(_sort_problems(self.problems))
        problems = list(self.problems)
        try:
            spec = spec_type.model_validate(_mark_numbers(self.tree), context={"border": True, "folder": self.folder})
        except ValidationError as error:
            for complaint in explain(error, spec_type, self.tree):
                if not any(complaint.path[: len(spoilt)] == spoilt for spoilt in self._spoilt):
                    problems.append(self.problem(complaint.path, complaint.message, complaint.at_key))
        if problems:
            raise SpecError(_sort_problems(problems))
        return spec

    def problem(self, path: str | Path, message: str, at_key: bool = False) -> Problem:
        """Return a problem at a path, with its line and column or the option that set the value."""
        path = self._as_path(path)
        reported = to_dotted(path)
        if option := self._option_at(path):
            return Problem(option, 0, 0, reported, message)
        owner = self._document_of_value(path)
        line, column = owner._place_in_file(path, at_key)
        return Problem(owner.source, line, column, reported, message, owner._line_of_file(line))

    def _with_problems(self, option: Option, faults: list[tuple[Path, str]]) -> YamlDocument:
        new = [Problem(option.label, 0, 0, to_dotted(path), message) for path, message in faults]
        spoilt = (*self._spoilt, parse_indices(option.path, self.tree))
        return dataclasses.replace(self, problems=(*self.problems, *new), _spoilt=spoilt)

    def _option_at(self, path: Path) -> str:
        """Return the option that set a value or made its block; empty if a file has it."""
        for option_path, label in reversed(self._options):
            if path[: len(option_path)] == option_path or (
                option_path[: len(path)] == path and not self._is_written(path)
            ):
                return label
        return ""

    def _is_written(self, path: Path) -> bool:
        return path in self._reading.values or (self.base is not None and self.base._is_written(path))

    def _document_of_value(self, path: Path) -> YamlDocument:
        """Return the document that a value is from: the base, where this one neither has it nor replaces its block."""
        if self.base is None or not self.base._is_written(path):
            return self
        node = self._reading.tree
        for part in path:
            if not isinstance(node, dict):
                return self
            if part not in node:
                return self.base._document_of_value(path)
            node = node[part]
        return self

    def _place_in_file(self, path: Path, at_key: bool) -> tuple[int, int]:
        table = self._reading.keys if at_key else self._reading.values
        for length in range(len(path), -1, -1):
            if position := table.get(path[:length]) or self._reading.values.get(path[:length]):
                return position
        return 1, 1

    def _line_of_file(self, number: int) -> str:
        return self._lines[number - 1] if 0 < number <= len(self._lines) else ""

    def _as_path(self, path: str | Path) -> Path:
        return parse_indices(tuple(path.split(".")) if path else (), self.tree) if isinstance(path, str) else path


def read_document(
    data: bytes | str,  # the specification, UTF-8
    source: str,  # its name for messages
    folder: FilePath | None = None,  # what file names in it are relative to
) -> YamlDocument:
    """Return what a text says; nothing is raised, faults become the document's problems."""
    reading = read_text(data)
    if not reading.broken and not isinstance(reading.tree, dict):
        reading.broken = True
        reading.faults.append(_fault_without_block(reading))
    lines = _lines_of(data)
    problems = tuple(
        Problem(
            source,
            fault.line,
            fault.column,
            to_dotted(fault.path),
            fault.message,
            lines[fault.line - 1] if 0 < fault.line <= len(lines) else "",
        )
        for fault in reading.faults
    )
    spoilt = tuple(fault.path for fault in reading.faults if fault.path and fault.makes_value_unusable)
    return YamlDocument(reading.tree, source, folder, problems, None, lines, reading, spoilt)


def _lines_of(data: bytes | str) -> tuple[str, ...]:
    """Return the lines of a text, as YAML counts them; none of what is larger than a specification may be."""
    if len(data) > MAX_FILE_BYTES:
        return ()
    text = data.decode("utf-8", "replace") if isinstance(data, bytes) else data
    return tuple(re.split("\r\n|[\r\n\x85\u2028\u2029]", text.removeprefix("\ufeff")))


def _fault_without_block(reading: ParsedYaml) -> Fault:
    what = "a list" if isinstance(reading.tree, tuple) else "a single value"
    reported = "the file is empty" if reading.tree is None else f"the file holds {what}, not keys"
    line, column = reading.values.get((), (1, 1))
    return Fault(line, column, (), f"{reported}; a specification starts with 'cfmkit: 1' and 'family: ...'")


def _sort_problems(problems: Sequence[Problem]) -> list[Problem]:
    """Return problems in the order of the file, those of options last, and not more than can be read."""
    sources = list(dict.fromkeys(problem.source for problem in problems))
    ordered = sorted(
        dict.fromkeys(problems),
        key=lambda problem: (
            problem.line == 0,
            sources.index(problem.source) if problem.line else 0,
            problem.line,
            problem.column,
        ),
    )
    if len(ordered) <= MOST_PROBLEMS:
        return ordered
    last = ordered[MOST_PROBLEMS]
    more = Problem(last.source, 0, 0, "", f"{len(ordered) - MOST_PROBLEMS} more problems are not listed")
    return [*ordered[:MOST_PROBLEMS], more]


def _mark_numbers(tree: Any) -> Any:
    """Return a tree whose numbers are `Bare` ones: they came without a unit."""
    if isinstance(tree, dict):
        return {key: _mark_numbers(value) for key, value in tree.items()}
    if isinstance(tree, tuple):
        return tuple(_mark_numbers(value) for value in tree)
    if isinstance(tree, bool) or not isinstance(tree, int | float):
        return tree
    return BareInt(tree) if isinstance(tree, int) else BareFloat(tree)


@dataclass(frozen=True)
class Option:
    """One parsed option: where the value goes, the value, and what was wrong with its text."""

    path: tuple[str, ...]
    value: Any
    faults: tuple[Fault, ...] = ()

    @property
    def label(self) -> str:
        """Its name in messages: ``--set a.b``."""
        return "--set " + to_dotted(self.path)


_PART_PATTERN = r"""(?:\s*"[^"]+"\s*|\s*'[^']+'\s*|[^."'=]+)"""
_OPTION_PATTERN = re.compile(rf"({_PART_PATTERN}(?:\.{_PART_PATTERN})*)=(.*)", re.DOTALL)


def parse_option(text: str) -> Option:
    """Return the option that ``a.b=value`` means.

    Raises UsageError if there is no ``=``, no path or no value.
    """
    match = _OPTION_PATTERN.fullmatch(text)
    path, equals, value = (match[1], "=", match[2]) if match else text.partition("=")
    parts = [part.strip() for part in re.findall(_PART_PATTERN, path)] if match else []
    example = "write e.g. --set mechanism.springs.count=2"
    if not equals or not value.strip():
        raise UsageError(f"--set {quote(text)}: no value; {example}")
    if not all(parts) or not 0 < len(parts) <= MAX_DEPTH:
        raise UsageError(f"--set {quote(text)}: {quote(path)} is not a dotted path; {example}")
    return _read_value(tuple(_unquote(part) for part in parts), value.strip())


def _unquote(part: str) -> str:
    return part[1:-1] if part[0] in "\"'" else part


def _read_value(path: tuple[str, ...], text: str) -> Option:
    reading = read_text(text)
    faults = tuple(reading.faults)
    if not faults and not reading.broken and isinstance(reading.tree, dict | tuple) and text[0] not in "[{":
        what = (
            "a block; write {key: value}, or quote text" if isinstance(reading.tree, dict) else "a list; write [a, b]"
        )
        faults = (Fault(0, 0, (), f"{quote(text)} would be {what}"),)
    return Option(path, reading.tree, faults)
