"""A batch as systems of continuous integration show it: annotations of GitHub, JUnit XML, a summary in Markdown.

An annotation is a problem at the line of its specification. Of JUnit there is one suite per specification, in it one
test for the solution and one for each requirement. Names never hold a value that was found, so that a system that
follows a test from run to run finds it again.
"""

from __future__ import annotations

import os
import re
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree

from cfmkit.errors import ExitCode, OutputError, UsageError, visible
from cfmkit.studies.batch_sources_and_outcomes import message, outcome

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from cfmkit.metrics.compare import MetricChange
    from cfmkit.studies.batch_sources_and_outcomes import Entry
    from cfmkit.studies.earlier_batch import BatchComparison


LOCATION_PATTERN = re.compile(r"(?P<file>.*?):(?P<line>\d+):(?P<col>\d+): (?P<reported>.*)", re.DOTALL)
"""Place and message of a fault of a file."""
MAX_CHANGES_IN_ANNOTATION = 8  # changed values in one annotation: GitHub cuts long ones


def workflow_commands(
    entries: Sequence[Entry],  # every specification of a batch
    # line and column of a requirement of a file, by its number; (0, 0) if it is not known
    place_of: Callable[[str, int], tuple[int, int]],
    changes: Sequence[MetricChange] = (),  # since an earlier batch; those beyond the tolerance are errors
) -> Iterator[str]:
    """Yield one workflow command for each specification with something to say, at the place of its gravest problem."""
    for entry in entries:
        beyond = [change for change in changes if change.spec == entry.spec and change.beyond]
        if not entry.skipped and (annotation := _annotation(entry, place_of, beyond)):
            yield annotation


def _annotation(entry: Entry, place_of: Callable[[str, int], tuple[int, int]], beyond: Sequence[MetricChange]) -> str:
    """Return the one command for a specification: faults before missed requirements, changes and warnings; or ""."""
    place: dict[str, Any] = {"file": entry.spec}
    if entry.errors:
        texts = [match["reported"] if (match := LOCATION_PATTERN.fullmatch(text)) else text for text in entry.errors]
        if first := LOCATION_PATTERN.fullmatch(entry.errors[0]):
            place = {"file": first["file"], "line": first["line"], "col": first["col"]}
        return command("error", place, "\n".join(text.removeprefix("error    ") for text in texts))
    texts = [requirement["sentence"] for requirement in entry.missed]
    if texts:
        number = next(at for at, requirement in enumerate(entry.requirements) if not requirement["ok"])
        line, column = place_of(entry.spec, number)
        place |= ({"line": line, "col": column} if line else {}) | {"title": "requirement missed"}
    elif entry.code:
        texts = [entry.message]
    elif beyond:
        place["title"] = "changed"
    texts += [change.sentence for change in beyond[:MAX_CHANGES_IN_ANNOTATION]]
    texts += [f"{len(beyond) - MAX_CHANGES_IN_ANNOTATION} more values in changes.csv"] * (
        len(beyond) > MAX_CHANGES_IN_ANNOTATION
    )
    if texts:
        return command("error", place, "\n".join(texts))
    if not entry.warnings:
        return ""
    names = ", ".join(dict.fromkeys(item["name"] for item in entry.warnings))
    return command("warning", place | {"title": names}, "\n".join(item["message"] for item in entry.warnings))


def command(kind: str, properties: Mapping[str, Any], message: str) -> str:
    """Return a workflow command; no name or message in it can end it or begin another.

    Examples
    --------
    >>> command("error", {"file": "a,b.yaml", "line": "3"}, "100 % wrong")
    '::error file=a%2Cb.yaml,line=3::100 %25 wrong'
    """
    reported = ",".join(f"{key}={_escape(str(value), ':,')}" for key, value in properties.items())
    return f"::{kind} {reported}::{_escape(message)}"


def _escape(text: str, more: str = "") -> str:
    text = visible(text.replace("%", "%25").replace("\r", "%0D").replace("\n", "%0A"))
    for char in more:
        text = text.replace(char, f"%{ord(char):02X}")
    return text


Element = ElementTree.Element
FAILURE_CODES = (ExitCode.NO_SOLUTION, ExitCode.PARTIAL)
"""Ends that say something about the mechanism; all others but these are errors of the run."""
PASSED_CODES = (ExitCode.OK, ExitCode.REQUIREMENT_MISSED)
NOT_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
"""Characters that XML 1.0 cannot hold, not even escaped."""


def junit(
    entries: Sequence[Entry],  # every specification of the batch
) -> bytes:
    """Return the XML document."""
    root = Element("testsuites", name="cfmkit batch")
    for entry in entries:
        root.append(_test_suite(entry))
    _set_counts_and_time(root, list(root))
    ElementTree.indent(root)
    text = ElementTree.tostring(root, encoding="unicode")
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{text}\n'.encode()


def _test_suite(entry: Entry) -> Element:
    suite = Element("testsuite", name=clean(entry.spec))
    suite.extend([_solution_case(entry), *_requirement_cases(entry)])
    _set_counts_and_time(suite, [suite])
    return suite


def _set_counts_and_time(element: Element, suites: Sequence[Element]) -> None:
    """Set the numbers of tests by outcome, and the time that they took, as attributes of an element."""
    cases = [case for suite in suites for case in suite.iter("testcase")]
    element.set("tests", str(len(cases)))
    for key, tag in (("failures", "failure"), ("errors", "error"), ("skipped", "skipped")):
        element.set(key, str(sum(case.find(tag) is not None for case in cases)))
    element.set("time", f"{sum(float(case.get('time', 0)) for case in cases):.3f}")


def _test_case(entry: Entry, name: str, seconds: float = 0.0) -> Element:
    place = {"classname": clean(entry.folder.replace(".", "_")), "name": clean(name), "file": clean(entry.spec)}
    return Element("testcase", place | {"time": f"{seconds:.3f}"})


def _solution_case(entry: Entry) -> Element:
    case = _test_case(entry, "solved", entry.seconds)
    if entry.skipped:
        case.append(Element("skipped", message=clean(entry.message)))
    elif entry.code not in PASSED_CODES:
        tag = "failure" if entry.code in FAILURE_CODES else "error"
        reported = "\n".join((*entry.errors, entry.bug)).strip() or entry.message
        case.append(_problem_element(tag, entry.status, entry.message, reported))
    if entry.warnings:
        said = Element("system-out")
        said.text = clean("\n".join(f"warning {warning['name']}: {warning['message']}" for warning in entry.warnings))
        case.append(said)
    return case


def _problem_element(tag: str, kind: str, message: str, text: str) -> Element:
    problem = Element(tag, type=clean(kind), message=clean(message))
    problem.text = clean(text)
    return problem


def _requirement_cases(entry: Entry) -> Iterator[Element]:
    names: dict[str, int] = {}
    for requirement in entry.requirements:
        name = requirement_name(requirement)
        names[name] = names.get(name, 0) + 1
        case = _test_case(entry, name if names[name] == 1 else f"{name} (again, {names[name]})")
        if entry.code not in (*PASSED_CODES, ExitCode.PARTIAL):
            case.append(Element("skipped", message="there is no solution to measure"))
        elif not requirement["ok"]:
            case.append(_problem_element("failure", "requirement", requirement["sentence"], requirement["sentence"]))
        yield case


def requirement_name(requirement: Mapping[str, Any]) -> str:
    """Return a requirement without what was found.

    Examples
    --------
    >>> known = {"metric": "force_ripple", "min": None, "max": 0.05, "unit": "1", "over": [2.0, 240.0]}
    >>> requirement_name(known | {"over_unit": "mm"})
    'force_ripple <= 0.05 over 2 ... 240 mm'
    """
    unit = "" if requirement["unit"] == "1" else f" {requirement['unit']}"
    bounds = [
        f"{sign} {requirement[key]:.6g}{unit}"
        for key, sign in (("min", ">="), ("max", "<="))
        if requirement[key] is not None
    ]
    over = (
        f" over {requirement['over'][0]:.6g} ... {requirement['over'][1]:.6g} {requirement['over_unit']}"
        if requirement["over"]
        else ""
    )
    return f"{requirement['metric']} {' and '.join(bounds)}{over}"


def clean(text: str) -> str:
    """Return text in which control characters are escaped, but line feeds, and without what XML cannot hold."""
    return NOT_XML.sub("\N{REPLACEMENT CHARACTER}", "\n".join(map(visible, text.split("\n"))))


def prepare_file(path: str, option: str = "--junit") -> Callable[[bytes], None]:
    """Return what writes a file; its folder is made now, and a folder in its place is reported now.

    Raises OutputError if it will not be possible to write it.
    """
    from cfmkit.store import atomic_write
    from cfmkit.store.safe_disk_changes import reporting

    if not path.strip():
        raise UsageError(f"{option} is empty; name a file")
    with reporting(path):
        os.makedirs(os.path.dirname(os.path.abspath(path)), exist_ok=True)
    if os.path.isdir(path):
        raise OutputError(f"cannot write {path}: it is a folder")

    def write(data: bytes) -> None:
        atomic_write(path, data)

    return write


MAX_CHANGES_IN_SUMMARY = 50  # changed values that are listed; all stand in changes.csv
MARKUP_PATTERN = re.compile(r"([\\`*_\[\]<>|~&@#$]|^[=+-])")
ZERO_WIDTH_SPACE = "&#8203;"
"""A blank of no width: a backslash before it does not keep a page from making a mention of @name."""


def summary(
    entries: Sequence[Entry],  # every specification of the batch
    compared: BatchComparison | None = None,  # with an earlier batch
) -> bytes:
    """Return the summary: one row per specification, what is missed, and what has changed."""
    return ("\n".join(_summary_lines(entries, compared)) + "\n").encode()


def _summary_lines(entries: Sequence[Entry], compared: BatchComparison | None) -> Iterator[str]:
    yield f"## cfmkit: {plain(message(entries))}"
    yield ""
    yield "| specification | verb | verdict | requirements | warnings |"
    yield "|---|---|---|---|---|"
    for entry in entries:
        met = len(entry.requirements) - len(entry.missed)
        required = f"{met} of {len(entry.requirements)} met" if entry.requirements else ""
        cells = (plain(entry.spec), plain(entry.verb), _verdict_cell(entry), required, plain(entry.warned or ""))
        yield f"| {' | '.join(cells)} |"
    troubles = [line for entry in entries for line in _trouble_lines(entry)]
    if troubles:
        yield from ("", "### What is wrong", "", *troubles)
    if compared is not None:
        yield from _comparison_lines(compared)


def _verdict_cell(entry: Entry) -> str:
    word = outcome(entry)
    return word if word == "ok" or entry.skipped else f"**{word}**"


def _trouble_lines(entry: Entry) -> Iterator[str]:
    if entry.errors:
        yield from (f"- {plain(line)}" for line in entry.errors)
    elif entry.code is ExitCode.REQUIREMENT_MISSED:
        for requirement in entry.missed:
            yield f"- {plain(entry.spec)}: {plain(requirement['sentence'])}"
    elif entry.code:
        yield f"- {plain(entry.spec)}: {plain(entry.message)}"


def _comparison_lines(compared: BatchComparison) -> Iterator[str]:
    count = len(compared.changes_beyond_tolerance)
    yield from ("", f"### Compared with {plain(compared.folder)}", "")
    if not compared.changes:
        yield "No metric has changed."
    else:
        reported = f"{count} value{'s' * (count != 1)} changed by more than {100 * compared.tolerance:.4g} %"
        less = len(compared.changes) - count
        yield plain(f"{reported}, {less} by less." if less else f"{reported}.")
        shown = (*compared.changes_beyond_tolerance, *(change for change in compared.changes if not change.beyond))[
            :MAX_CHANGES_IN_SUMMARY
        ]
        yield from ("", "| specification | change |", "|---|---|")
        for change in shown:
            yield f"| {plain(change.spec)} | {'**' * change.beyond}{plain(change.sentence)}{'**' * change.beyond} |"
        if len(compared.changes) > len(shown):
            yield from ("", f"{len(compared.changes) - len(shown)} more values in changes.csv.")
    if compared.gone:
        yield from ("", f"No longer there: {plain(', '.join(compared.gone))}")


def plain(text: str) -> str:
    """Return text that Markdown and HTML show as it is, on one line; it mentions nobody and links nowhere.

    Examples
    --------
    >>> plain("a_b | <i>")
    'a\\\\_b \\\\| \\\\<i\\\\>'
    """
    shown = MARKUP_PATTERN.sub(r"\\\1", visible(" ".join(text.split())))
    return (
        shown.replace("@", f"@{ZERO_WIDTH_SPACE}")
        .replace("://", f":{ZERO_WIDTH_SPACE}//")
        .replace("www.", f"www{ZERO_WIDTH_SPACE}.")
    )
