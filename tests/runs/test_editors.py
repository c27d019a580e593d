"""What editors and shells are told: metrics, the line that finds the schema, keys of --set; what the recipe lists."""

import contextlib
import json
import re
from pathlib import Path
from types import SimpleNamespace

import pytest

import cfmkit
from cfmkit import families
from cfmkit.cli import run_command, shell_completion
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


def completed(text, **named):
    return shell_completion.changes(SimpleNamespace(params=named), text)


def test_keys_of_set_are_those_of_the_family_on_the_command_line():
    cam = str(ROOT / "configs" / "cam.yaml")
    assert "mechanism.roller_radius=" in completed("mechanism.ro", spec=cam)
    assert all(word.startswith("mechanism.ro") for word in completed("mechanism.ro", spec=cam))
    assert "mechanism.bistable.length=" not in completed("mechanism.", spec=cam)
    assert "mechanism.bistable.length=" in completed("mechanism.b", spec="nowhere.yaml")
    assert "mechanism.bistable.length=" in completed("mechanism.b", specs=(str(ROOT / "configs/vcfm_pla.yaml"),))


@pytest.mark.parametrize("verb", ["sweep", "sensitivity"])
def test_vary_is_completed_with_the_same_keys(verb, monkeypatch, capsys):
    monkeypatch.setenv("_CFMKIT_COMPLETE", "complete_zsh")
    spec = ROOT / "configs" / "cam.yaml"
    monkeypatch.setenv("_TYPER_COMPLETE_ARGS", f"cfmkit {verb} {spec} --vary mechanism.roller_r")
    with contextlib.suppress(SystemExit):
        run_command([])
    assert "mechanism.roller_radius=" in capsys.readouterr().out


def test_after_the_sign_of_equality_come_the_words_of_a_closed_choice():
    found = completed("mechanism.positive.structure=", spec=str(ROOT / "configs/vcfm_pla.yaml"))
    assert "mechanism.positive.structure=diamond" in found
    assert completed("mechanism.positive.length=", spec=str(ROOT / "configs/vcfm_pla.yaml")) == []
