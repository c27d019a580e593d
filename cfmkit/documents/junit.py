"""JUnit XML of a batch: what GitLab, Jenkins, GitHub actions and others show beside a change.

One suite per specification, in it one test for the solution and one for each requirement.
Names never hold a value that was found, so that a system that follows a test from run
to run finds it again.
"""

from __future__ import annotations

import os
import re
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree

from cfmkit.errors import ExitCode, OutputError, UsageError, visible

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from cfmkit.studies.batch_sources_and_outcomes import Entry

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
        root.append(_suite(entry))
    _count(root, list(root))
    ElementTree.indent(root)
    text = ElementTree.tostring(root, encoding="unicode")
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{text}\n'.encode()


def _suite(entry: Entry) -> Element:
    suite = Element("testsuite", name=clean(entry.spec))
    suite.extend([_solution(entry), *_requirements(entry)])
    _count(suite, [suite])
    return suite


def _count(element: Element, suites: Sequence[Element]) -> None:
    """Note how many tests there are and how they ended, and how long they took."""
    cases = [case for suite in suites for case in suite.iter("testcase")]
    element.set("tests", str(len(cases)))
    for key, tag in (("failures", "failure"), ("errors", "error"), ("skipped", "skipped")):
        element.set(key, str(sum(case.find(tag) is not None for case in cases)))
    element.set("time", f"{sum(float(case.get('time', 0)) for case in cases):.3f}")


def _case(entry: Entry, name: str, seconds: float = 0.0) -> Element:
    place = {"classname": clean(entry.folder.replace(".", "_")), "name": clean(name), "file": clean(entry.spec)}
    return Element("testcase", place | {"time": f"{seconds:.3f}"})


def _solution(entry: Entry) -> Element:
    case = _case(entry, "solved", entry.seconds)
    if entry.skipped:
        case.append(Element("skipped", message=clean(entry.message)))
    elif entry.code not in PASSED_CODES:
        tag = "failure" if entry.code in FAILURE_CODES else "error"
        reported = "\n".join((*entry.errors, entry.bug)).strip() or entry.message
        case.append(_problem(tag, entry.status, entry.message, reported))
    if entry.warnings:
        said = Element("system-out")
        said.text = clean("\n".join(f"warning {one['name']}: {one['message']}" for one in entry.warnings))
        case.append(said)
    return case


def _problem(tag: str, kind: str, message: str, text: str) -> Element:
    problem = Element(tag, type=clean(kind), message=clean(message))
    problem.text = clean(text)
    return problem


def _requirements(entry: Entry) -> Iterator[Element]:
    names: dict[str, int] = {}
    for one in entry.requirements:
        name = requirement_name(one)
        names[name] = names.get(name, 0) + 1
        case = _case(entry, name if names[name] == 1 else f"{name} (again, {names[name]})")
        if entry.code not in (*PASSED_CODES, ExitCode.PARTIAL):
            case.append(Element("skipped", message="there is no solution to measure"))
        elif not one["ok"]:
            case.append(_problem("failure", "requirement", one["sentence"], one["sentence"]))
        yield case


def requirement_name(one: Mapping[str, Any]) -> str:
    """Return a requirement without what was found.

    Examples
    --------
    >>> known = {"metric": "force_ripple", "min": None, "max": 0.05, "unit": "1", "over": [2.0, 240.0]}
    >>> requirement_name(known | {"over_unit": "mm"})
    'force_ripple <= 0.05 over 2 ... 240 mm'
    """
    unit = "" if one["unit"] == "1" else f" {one['unit']}"
    bounds = [f"{sign} {one[key]:.6g}{unit}" for key, sign in (("min", ">="), ("max", "<=")) if one[key] is not None]
    over = f" over {one['over'][0]:.6g} ... {one['over'][1]:.6g} {one['over_unit']}" if one["over"] else ""
    return f"{one['metric']} {' and '.join(bounds)}{over}"


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
