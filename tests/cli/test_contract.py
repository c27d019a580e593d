"""Every configuration through the installed command: exit 0, with or without a design."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import cfmkit
from cfmkit import families

CONFIGS = sorted((Path(__file__).parents[2] / "configs").glob("*.yaml"))
LONG = ("beam_design_lan", "beam_lan_rising")


JOURNAL = ".cfmkit-journal.sqlite"
"""Where a search notes what it has finished."""

EVERY_DESIGN = "design.yaml", "geometry/"
"""What every design writes, and no analysis: the specification, and what is to be cut."""

RUN_ITSELF = "manifest.json"
"""Names the command, the time and the machine."""


def _cases():
    return [pytest.param(path, marks=pytest.mark.long) if path.stem in LONG else path for path in CONFIGS]


def contents(folder):
    """Return the bytes of every file of a run but its manifest, by name, and metrics.json as a document."""
    found = {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    del found[RUN_ITSELF]
    return found, json.loads(found.pop("metrics.json"))


@pytest.mark.parametrize("name", families.names())
def test_what_a_family_says_of_its_search_are_findings_that_it_explains(name):
    record = families.family(name)
    assert record.design is None or set(record.design.findings) <= set(record.outputs.findings)


@pytest.mark.parametrize("path", _cases(), ids=lambda path: path.stem)
def test_a_config_is_analysed_and_designed_with_exit_0(cli, path):
    spec = cfmkit.load(path)
    assert cli("analyze", str(path), "-o", "one", "-q", "--no-plots").code == 0
    if families.family(spec.family).design is None or spec.design is None:
        return
    assert cli("design", str(path), "-o", "two", "-q", "--no-plots").code == 0
    assert cli("analyze", "two/design.yaml", "-o", "three", "-q", "--no-plots").code == 0
    same_but_for(families.family(spec.family).design, cli.folder / "two", cli.folder / "three")


def same_but_for(search, design, analysis):
    """Check that a design's folder holds all of the analysis's, to the letter, and nothing more than is declared."""
    (files, reported), (same_files, same) = contents(design), contents(analysis)
    more = {name for name in set(files) - set(same_files) if not name.startswith(EVERY_DESIGN)}
    assert {name: files.get(name) for name in same_files} == same_files
    assert more <= ({*search.tables, JOURNAL} if search else set())

    assert {name: reported["metrics"].get(name) for name in same["metrics"]} == same["metrics"]
    assert set(reported["metrics"]) == set(same["metrics"])
    known = reported.pop("search", {})
    assert not known or (search and (search.findings or search.tables))
    assert not set(known) & set(reported["metrics"]), "what only the search knows is in the words of a metric"
    assert all(one["model"] for one in known.values())
    beside = [item for item in reported["warnings"] if item not in same["warnings"]]
    assert [item for item in reported["warnings"] if item not in beside] == same["warnings"]
    assert {item["name"] for item in beside} <= set(search.findings if search else ())
    assert {**reported, "metrics": 0, "warnings": 0} == {**same, "metrics": 0, "warnings": 0}
