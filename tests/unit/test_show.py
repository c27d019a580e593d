"""`cfmkit show` explains by name whatever a run can print."""

import ast
from functools import cache
from pathlib import Path

import cfmkit
from cfmkit.cli import show_topics
from cfmkit.experiment.value_definitions import recorded

PACKAGE = Path(cfmkit.__file__).parent


@cache
def explained():
    return set(show_topics.names())


def names_of_findings():
    """Return the names that calls of `Finding` and `finding` state."""
    calls = (
        node
        for path in PACKAGE.rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Call) and ast.unparse(node.func) in ("Finding", "finding")
    )
    constants = (part.value for call in calls for part in ast.walk(call.args[0]) if isinstance(part, ast.Constant))
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
