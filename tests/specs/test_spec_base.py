"""Specifications that take values from another file: what overrides what, and which file an error names."""

from __future__ import annotations

from pathlib import Path

import pytest

import cfmkit
from cfmkit.specs.yamlio.base_file import base_files

CAM = (Path(__file__).parents[2] / "configs" / "cam.yaml").read_text()


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "cam.yaml").write_text(CAM)
    return tmp_path


def written(folder, text, name="own.yaml"):
    (folder / name).write_text(text)
    return folder / name


def problems(path):
    with pytest.raises(cfmkit.SpecError) as caught:
        cfmkit.load(path)
    return caught.value.problems


def test_values_of_the_file_override_those_of_its_base_key_by_key(folder):
    own = written(folder, "base: cam.yaml\nname: softer\nmechanism: {springs: {stiffness: 0.6 N/mm}}\n")
    spec, base = cfmkit.load(own), cfmkit.load(folder / "cam.yaml")
    assert spec == base.replace({"name": "softer", "mechanism.springs.stiffness": 600.0})
    assert "base" not in cfmkit.dumps(spec)


def test_lists_replace_those_of_the_base_as_a_whole(folder):
    own = written(folder, "base: cam.yaml\nrequirements: [{metric: force_mean, min: 1 N}]\n")
    assert [one.metric for one in cfmkit.load(own).requirements] == ["force_mean"]


def test_a_base_may_have_a_base_and_options_come_last(folder):
    written(folder, "base: cam.yaml\nmechanism: {springs: {stiffness: 0.6 N/mm, count: 4}}\n", "middle.yaml")
    own = written(folder, "base: middle.yaml\nmechanism: {springs: {count: 6}}\n")
    springs = cfmkit.load(own).mechanism.springs
    assert (springs.stiffness, springs.count) == (pytest.approx(600.0), 6)
    springs = cfmkit.load(own, ["mechanism.springs.stiffness=0.5 N/mm"]).mechanism.springs
    assert (springs.stiffness, springs.count) == (pytest.approx(500.0), 6)
    assert [file.name for file in base_files(own)] == ["middle.yaml", "cam.yaml"]


def test_errors_name_the_file_that_has_the_value(folder):
    (folder / "cam.yaml").write_text(CAM.replace("brace_length: 200 mm", "brace_length: 200 kg"))
    line = CAM.split("\n").index(next(one for one in CAM.split("\n") if "brace_length: 200 mm" in one)) + 1
    own = written(folder, "base: cam.yaml\nmechanism:\n  roller_radius: 16 s\n  nonsense: 1\n")
    found = {Path(one.source).name: [] for one in problems(own)}
    for one in problems(own):
        found[Path(one.source).name].append((one.line, one.path))
    assert found["cam.yaml"] == [(line, "mechanism.brace_length")]
    assert found["own.yaml"] == [(3, "mechanism.roller_radius"), (4, "mechanism.nonsense")]
    assert [one.text.strip() for one in problems(own) if one.path == "mechanism.brace_length"] == [
        "brace_length: 200 kg"
    ]


def test_a_list_of_the_file_is_blamed_on_the_file_whatever_the_base_has_there(folder):
    own = written(folder, "base: cam.yaml\nrequirements:\n  - {metric: force_ripple, min: 3 N}\n")
    (found,) = problems(own)
    assert (Path(found.source).name, found.line, found.path) == ("own.yaml", 3, "requirements.0.min")


def test_a_metric_that_the_base_misspells_is_found_in_the_base(folder):
    (folder / "cam.yaml").write_text(CAM.replace("metric: force_ripple", "metric: force_riple", 1))
    (found,) = problems(written(folder, "base: cam.yaml\nname: mine\n"))
    assert Path(found.source).name == "cam.yaml"
    assert "did you mean 'force_ripple'" in found.message


def test_files_that_name_each_other_are_refused_with_the_circle(folder):
    written(folder, "base: other.yaml\n")
    written(folder, "base: own.yaml\n", "other.yaml")
    (found,) = problems(folder / "own.yaml")
    assert Path(found.source).name == "other.yaml"
    assert found.path == "base"
    assert "these files name each other: own.yaml -> other.yaml -> own.yaml" in found.message
    (found,) = problems(written(folder, "base: own.yaml\n"))
    assert "own.yaml -> own.yaml" in found.message


@pytest.mark.parametrize(
    ("value", "reported"),
    [
        ("nowhere.yaml", "there is no file 'nowhere.yaml' in the folder"),
        ("../cam.yaml", "in the folder of the specification, or below it"),
        ("/etc/passwd", "in the folder of the specification, or below it"),
        ("12", "must be the name of a YAML file"),
        ("[cam.yaml]", "must be the name of a YAML file"),
        ("''", "must be the name of a YAML file"),
    ],
)
def test_a_base_that_is_none_is_refused_in_one_line(folder, value, reported):
    (found,) = problems(written(folder, f"name: mine\nbase: {value}\n"))
    assert (found.line, found.path) == (2, "base")
    assert reported in found.message


def test_a_base_that_cannot_be_read_as_yaml_is_named(folder):
    (folder / "cam.yaml").write_text("cfmkit: 1\nfamily: [cam\n")
    assert {Path(one.source).name for one in problems(written(folder, "base: cam.yaml\n"))} == {"cam.yaml"}


def test_a_text_has_no_base():
    with pytest.raises(cfmkit.SpecError, match="this text is in no file"):
        cfmkit.loads("base: cam.yaml\n")


def test_a_batch_computes_again_when_the_base_has_changed(folder):
    own = written(folder, "base: cam.yaml\nname: mine\nanalysis: {points: 21}\n")
    runs = []
    for stiffness in ("0.69", "0.69", "0.68"):
        (folder / "cam.yaml").write_text(CAM.replace("stiffness: 0.69 N/mm", f"stiffness: {stiffness} N/mm"))
        runs.append(cfmkit.batch([own], folder / "out", verb="analyze", plots=False).entries[0].reused)
    assert runs == [False, True, False]


def test_a_problem_shows_its_line_with_a_caret_below_the_value():
    problem = cfmkit.Problem("a.yaml", 3, 18, "mechanism.roller_radius", "no", "  roller_radius: 16 kg")
    assert problem.excerpt == ("    3 |   roller_radius: 16 kg", "      |                  ^")
    assert problem.excerpt[1].index("^") == problem.excerpt[0].index("16 kg")
    long = cfmkit.Problem("a.yaml", 1, 5001, "", "no", "x" * 5000 + "Y" + "z" * 5000)
    line, caret = long.excerpt
    assert len(line) <= 100
    assert line[caret.index("^")] == "Y"
    assert cfmkit.Problem("--set a", 0, 0, "a", "no").excerpt == ()
    assert cfmkit.Problem("a.yaml", 1, 1, "", "no", "\x1b[31m\ta").excerpt[0] == "    1 |  [31m a"
