"""`cfmkit show` explains by name whatever a run can print."""

import ast
import re
from functools import cache
from pathlib import Path

import pytest
from sources import calls_of

from cfmkit.cli import show_topics
from cfmkit.experiment import define_recorded_values

pytestmark = pytest.mark.lists

ROOT = Path(__file__).parents[2]


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
    wanted = {*define_recorded_values("force"), *define_recorded_values("torque"), "data_by_friction"}
    assert wanted - explained() == set()
    assert show_topics.find_page("coverage").data["values"][0]["family"] == "recordings"


def test_the_keys_that_pages_name_are_those_of_the_program():
    """Those of the changes that are called new, too."""
    pages = [path.read_text(encoding="utf-8") for path in (ROOT / "docs").glob("*.md")]
    pages.append((ROOT / "CHANGELOG.md").read_text(encoding="utf-8").partition("\n### New\n")[2])
    pages += [path.read_text(encoding="utf-8") for path in (ROOT / "changes").glob("new_*.md")]
    named = set(re.findall(r"`((?:mechanism|design|analysis)\.[a-z_]+(?:\.[a-z_]+)*)(?=[`:=\[])", "".join(pages)))
    assert len(named) > 60
    kind = show_topics.TOPIC_KINDS["keys"]
    known = {name for record in kind.records() for name in kind.names(record)}
    assert sorted(key for key in named if key not in known and not key.endswith((".yaml", ".py"))) == []
