"""`cfmkit show` explains by name whatever a run can print."""

import ast
import itertools
import re
from functools import cache
from pathlib import Path

from sources import calls_of

from cfmkit.cli import show_topics
from cfmkit.experiment.value_definitions import recorded
from cfmkit.stock.springs.spec import CatalogueSpring, SpringWire


@cache
def explained():
    return set(show_topics.names())


def names_of_findings():
    """Return the names that calls of `Finding` and `finding` state."""
    firsts = (call.args[0] for _, call in calls_of(("Finding", "finding")))
    constants = (part.value for first in firsts for part in ast.walk(first) if isinstance(part, ast.Constant))
    return {value for value in constants if isinstance(value, str)}


def test_every_warning_is_explained_those_of_recordings_and_studies_too():
    """Of recordings, calibrations and studies none was."""
    stated = names_of_findings()
    assert {"holes", "seating_cycles", "weakly_identified", "unbalanced", "fidelity_left_out"} <= stated
    assert stated - explained() == set()


def test_every_number_of_a_recording_is_explained():
    wanted = {*recorded("force"), *recorded("torque"), "data_by_friction"}
    assert wanted - explained() == set()
    assert show_topics.found("coverage").data["values"][0]["family"] == "recordings"


def table(page, head):
    """Return the first cells of a table of a page, below a head."""
    rows = itertools.takewhile(lambda line: line.startswith("|"), page.partition(f"\n{head}:\n\n")[2].splitlines())
    return [row.split("|")[1] for row in list(rows)[2:]]


def test_the_names_that_the_reference_calls_new_are_those_of_the_program():
    page = (Path(__file__).parents[2] / "docs" / "reference.md").read_text(encoding="utf-8")
    named = re.findall(r"`([a-z_]+)`", " ".join(table(page, "Numbers")))
    warnings = re.findall(r"`([a-z_]+)`", page.partition("\nWarnings: ")[2].partition(". ")[0])
    keys = re.findall(r"`([a-z_.\[\]]+)`", " ".join(table(page, "Keys")))
    assert len(named) > 20
    assert len(warnings) == 8
    assert len(keys) > 10
    assert {*named, *warnings} - explained() == {"relative_change"}  # a column of changes.csv
    catalogue = {*CatalogueSpring.model_fields, *SpringWire.model_fields}
    assert [key for key in keys if key not in catalogue and show_topics.found(key) is None] == []
