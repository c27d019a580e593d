"""What editors and shells are told: metrics, the line that finds the schema, keys of --set; what the recipe lists."""

import json
import re
from pathlib import Path

import pytest

import cfmkit
from cfmkit import families
from cfmkit.cli import run_command
from cfmkit.runs.editor_schema import SCHEMA_LINE_START, metric_names, schema

pytestmark = pytest.mark.lists

ROOT = Path(__file__).parents[2]
EXAMPLES = [one for one in cfmkit.examples() if "/" not in one.name]


@pytest.mark.parametrize("name", ["cam", "beam", "vcfm", "slider-crank"])
def test_the_schema_lists_every_metric_that_an_example_requires(name):
    found = schema([families.family(name)])
    closed, pattern = found["$defs"]["Requirement"]["properties"]["metric"]["anyOf"]
    names = set(closed["enum"])
    assert names == set(metric_names(families.family(name)))
    required = {
        requirement.metric
        for one in EXAMPLES
        if one.family == name
        for requirement in cfmkit.load(one.path).requirements
    }
    assert required
    assert all(metric in names or re.match(pattern["pattern"], metric) for metric in required)
    assert "force_rippel" not in names


def test_new_and_examples_write_the_schema_that_their_first_line_names(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert run_command(["new", "vcfm", "--json"]) == 0
    assert run_command(["examples", "cam_as_built", "--json"]) == 0
    for spec in ("vcfm.yaml", "cam_as_built.yaml"):
        first = Path(spec).read_text().splitlines()[0]
        assert first.startswith(SCHEMA_LINE_START)
        assert json.loads(Path(first.removeprefix(SCHEMA_LINE_START)).read_text())["$defs"]["Requirement"]
        cfmkit.load(spec)
    assert run_command(["examples", "--schema"]) == 2


def test_a_file_of_its_own_on_request(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert run_command(["new", "cam", "--no-schema", "--json"]) == 0
    assert [one.name for one in tmp_path.iterdir()] == ["cam.yaml"]
    assert not Path("cam.yaml").read_text().startswith(SCHEMA_LINE_START)
    capsys.readouterr()
    assert run_command(["new", "cam", "--out", "-"]) == 0
    assert SCHEMA_LINE_START not in capsys.readouterr().out
