"""The Python API: specifications in and out, results, errors; and the report that the files are made of."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import cfmkit
from cfmkit import Run, families, specs
from cfmkit.errors import ExitCode, SpecError
from cfmkit.results import Result, Status
from cfmkit.runs import specfile
from cfmkit.runs.run import files, run_design
from cfmkit.runs.specfile import read_spec
from cfmkit.specs.yamlio import read_document

CAM = Path(__file__).parents[2] / "configs" / "cam.yaml"


@pytest.fixture(scope="module")
def spec():
    return cfmkit.load(CAM)


@pytest.fixture(scope="module")
def result(spec):
    return cfmkit.analyze(spec)


def test_the_readme_example_works():
    spec = cfmkit.load(CAM)
    result = cfmkit.analyze(spec)
    assert result.curve.force.shape == (2 * 481,)
    assert not result.curve.force.flags.writeable


def test_load_takes_changes_as_the_option_set_does():
    spec = cfmkit.load(CAM, ["mechanism.roller_radius=10 mm", "analysis.points=11"])
    assert (spec.mechanism.roller_radius, spec.analysis.points) == (0.01, 11)


def test_load_takes_one_change_as_it_stands():
    assert cfmkit.load(CAM, "mechanism.roller_radius=10 mm").mechanism.roller_radius == pytest.approx(0.01)


def test_an_empty_block_is_called_empty(spec):
    with pytest.raises(SpecError, match="vary: the block is empty; at least 1 must be there"):
        cfmkit.sweep(spec, vary={})


def test_loads_names_its_source_in_every_fault():
    with pytest.raises(cfmkit.SpecError) as caught:
        cfmkit.loads("family: cam\nmechanism: 3\n", source="here")
    assert [problem.source for problem in caught.value.problems] == ["here"]


def test_dumps_is_short_unless_it_is_to_be_complete(spec):
    assert "plate" not in cfmkit.dumps(spec)
    assert "top_margin: 10 mm" in cfmkit.dumps(spec, complete=True)


def test_a_missing_file_is_a_usage_error():
    with pytest.raises(cfmkit.UsageError, match=r"did you mean '.*cam\.yaml'"):
        cfmkit.load(CAM.with_name("cm.yaml"))


def test_every_error_is_a_cfmerror_with_its_exit_code():
    kinds = [getattr(cfmkit, name) for name in cfmkit.__all__ if name.endswith("Error") or name == "FolderInUse"]
    assert len(kinds) >= 9
    assert all(issubclass(kind, cfmkit.CfmError) for kind in kinds)
    assert all(isinstance(kind.exit_code, ExitCode) for kind in kinds)


def test_evaluate_takes_names_and_branches(result):
    found = cfmkit.evaluate(result, ["force_mean[load]", "force_constant"])
    assert list(found) == ["force_mean[load]", "force_constant"]
    assert found["force_constant"].value == pytest.approx(0.009058)
    with pytest.raises(cfmkit.UsageError, match="did you mean 'force_mean'"):
        cfmkit.evaluate(result, ["force_men"])
    assert cfmkit.evaluate(result, ["clearance_min"])["clearance_min"].value is None  # nothing is known of its plate


def test_check_gives_an_outcome_for_each_requirement(spec, result):
    assert [outcome.metric for outcome in result.requirements] == [item.metric for item in spec.requirements]


def test_design_of_a_family_that_cannot_be_designed_is_a_usage_error(monkeypatch, spec):
    record = replace(families.family("cam"), design=None, outline=None, draw=None)
    monkeypatch.setattr("cfmkit.api.family", lambda name: record)
    with pytest.raises(cfmkit.UsageError, match="cannot be designed"):
        cfmkit.design(spec)
    with pytest.raises(cfmkit.UsageError, match="no part to draw"):
        cfmkit.drawing(spec)


def test_progress_and_seed_reach_the_family(monkeypatch, spec):
    seen = []
    record = replace(
        families.family("cam"),
        models={"quasi-static": lambda spec, run: seen.append(run) or Result(spec, Status.COMPLETE)},
    )
    monkeypatch.setattr("cfmkit.api.family", lambda name: record)
    cfmkit.analyze(spec, cfmkit.Run(seed=3))
    assert seen[0].seed == 3


def test_progress_never_falls_where_a_run_looks_again():
    """A design with margins had fallen from 0.6 to 0.525 where it looked for a higher yield a second time."""
    told = []
    run = cfmkit.Run(progress=lambda share, text: told.append((share, text)))
    later = run.part(0.5, 1.0)
    for report, share in ((run, 0.5), (later, 0.2), (later, 0.05), (run, 0.3), (replace(run, seed=1), 0.1), (later, 1)):
        report.progress(share, f"{share}")
    assert [share for share, _ in told] == [0.5, 0.6, 0.6, 0.6, 0.6, 1.0]
    assert [text for _, text in told] == ["0.5", "0.2", "0.05", "0.3", "0.1", "1"]


def test_the_schema_of_several_families_keeps_their_blocks_apart():
    cam = families.family("cam").spec_type
    alone = specs.schema({"cam": cam})
    both = specs.schema({"cam": cam, "other": cam})
    assert [one["properties"]["mechanism"]["$ref"] for one in both["oneOf"]] == [
        "#/$defs/cam.Mechanism",
        "#/$defs/other.Mechanism",
    ]
    names = set(alone["$defs"])
    assert set(both["$defs"]) == {f"{family}.{name}" for family in ("cam", "other") for name in names}


def references(node):
    """Yield every reference in a schema."""
    if isinstance(node, dict):
        yield from ([node["$ref"]] if "$ref" in node else [])
        for value in node.values():
            yield from references(value)
    elif isinstance(node, list):
        for value in node:
            yield from references(value)


def test_every_reference_of_a_schema_leads_somewhere():
    for names in (["cam"], list(families.names())):
        schema = specs.schema({name: families.family(name).spec_type for name in names})
        assert {name.removeprefix("#/$defs/") for name in references(schema)} <= set(schema["$defs"])


def test_faults_of_requirements_are_found_beside_others():
    document = read_document("family: cam\nmechanism: 1\nrequirements:\n  - {metric: riple, max: 1}\n", "x")
    with pytest.raises(cfmkit.SpecError) as caught:
        specfile.bind(document)
    assert [(problem.line, problem.path) for problem in caught.value.problems] == [
        (2, "mechanism"),
        (4, "requirements.0.metric"),
    ]


def test_a_requirement_that_cannot_be_read_is_complained_about_once():
    document = read_document("family: cam\nmechanism: 1\nrequirements:\n  - {metric: riple, max: x y}\n", "x")
    with pytest.raises(cfmkit.SpecError) as caught:
        specfile.bind(document)
    assert [problem.path for problem in caught.value.problems] == ["mechanism", "requirements.0.max"]


def test_a_fault_in_a_block_that_an_option_states_names_the_option_and_the_path_inside():
    document = read_document("family: cam\nmechanism: 1\n", "x").set("requirements=[{metric: force_mean, max: 3 mm}]")
    with pytest.raises(cfmkit.SpecError) as caught:
        specfile.bind(document)
    assert any(
        str(problem).startswith("--set requirements: requirements.0.max: a bound of 'force_mean': '3 mm' is a length")
        for problem in caught.value.problems
    )


def test_the_name_of_an_option_stands_for_the_option_that_it_is_short_for():
    error = cfmkit.SpecError([cfmkit.Problem("--set a", 0, 0, "a", "wrong"), cfmkit.Problem("f", 1, 1, "b", "wrong")])
    assert [one.source for one in specfile.rename_source(error, "--set a", "--a").problems] == ["--a", "f"]


def test_functions_take_the_path_of_a_file_as_well_as_a_specification(spec, result):
    for path in (CAM, str(CAM)):
        assert np.array_equal(cfmkit.analyze(path).curve.force, result.curve.force, equal_nan=True)
    assert cfmkit.check(CAM) == cfmkit.check(spec) == ()
    assert cfmkit.evaluate(CAM, ["force_mean"]) == cfmkit.evaluate(result, ["force_mean"])
    assert cfmkit.design(CAM).spec == cfmkit.design(spec).spec
    assert cfmkit.drawing(CAM).name == cfmkit.drawing(spec).name


@pytest.mark.parametrize(
    "name", ["analyze", "design", "sweep", "sensitivity", "check", "evaluate", "drawing", "export"]
)
@pytest.mark.parametrize("wrong", [None, 3, {"family": "cam"}, b"cam.yaml"])
def test_what_is_neither_a_specification_nor_a_path_is_refused_in_one_line(name, wrong):
    with pytest.raises(cfmkit.UsageError, match=f"needed, not {type(wrong).__name__}; cfmkit.load reads a file"):
        getattr(cfmkit, name)(wrong)


@pytest.mark.parametrize("wrong", [None, ([0.0, 1.0], [5.0, 5.0])])
def test_what_is_neither_a_recording_nor_a_path_is_refused_in_one_line(wrong):
    for call in (lambda: cfmkit.measure(wrong), lambda: cfmkit.calibrate(CAM, wrong, "mechanism.rolling_friction")):
        with pytest.raises(cfmkit.UsageError, match=f"Recording of arrays is needed, not {type(wrong).__name__}"):
            call()


def test_one_column_to_flip_needs_no_list():
    recording = CAM.parent / "synthetic" / "cam_loop.csv"
    turned = [cfmkit.measure(recording, flip=flip, one_branch=True) for flip in ("force", ["force"])]
    assert turned[0].numbers == turned[1].numbers
    plain = cfmkit.measure(recording).numbers.raw["force_mean[load]"].value
    assert turned[0].numbers.raw["force_mean[load]"].value == pytest.approx(-plain, rel=0.05)


@pytest.mark.parametrize(
    ("specs", "more", "words"),
    [
        ([], {}, "there is no specification: name files"),
        (3, {}, "a path is needed, not int"),
        ([None], {}, "a path is needed, not NoneType"),
        (CAM, {"verb": "analyse"}, "'analyse' is not one of 'design', 'analyze'"),
    ],
)
def test_a_batch_of_what_is_no_file_is_refused_before_anything_is_computed(tmp_path, specs, more, words):
    with pytest.raises(cfmkit.UsageError, match=words):
        cfmkit.batch(specs, tmp_path / "out", **more)
    assert not (tmp_path / "out").exists()


def test_one_change_of_a_batch_needs_no_list(tmp_path):
    cfmkit.batch(CAM, tmp_path / "out", verb="analyze", changes="analysis.points=51", plots=False)
    assert "points: 51" in (tmp_path / "out" / "cam" / "resolved.yaml").read_text()


def test_export_is_the_function_before_and_after_the_package_of_that_name_is_imported():
    code = (
        "import cfmkit; before = cfmkit.export; from cfmkit.export import files; import cfmkit.export.dxf_svg_csv; "
        "assert cfmkit.export is before and callable(before) and callable(files); "
        "from cfmkit import export; assert export is before"
    )
    subprocess.run([sys.executable, "-W", "error", "-c", code], check=True)


def test_export_gives_the_files_and_writes_them_where_a_folder_is_named(tmp_path):
    found = cfmkit.export(CAM, kerf="0.2 mm")
    assert {"cam.dxf", "cam.svg", "cam-kerf.dxf"} <= set(found)
    assert found == cfmkit.export(CAM, kerf=0.2e-3)
    written = cfmkit.export(CAM, tmp_path / "out")
    assert {path.name for path in (tmp_path / "out").iterdir()} == {*written, "manifest.json"}
    assert all((tmp_path / "out" / name).read_bytes() == data for name, data in written.items())
    assert cfmkit.export(CAM, format="png") == cfmkit.export(CAM, format=["PNG"])
    assert set(cfmkit.export(CAM, format="png,pdf")) == {"figures/drawing.png", "figures/drawing.pdf"}
    for kerf in (0.0, "0 mm", float("nan")):
        with pytest.raises(cfmkit.UsageError, match="must be > 0"):
            cfmkit.export(CAM, kerf=kerf)


def test_the_place_of_what_a_base_says_is_where_the_base_is_named(tmp_path):
    (tmp_path / "cam.yaml").write_bytes(CAM.read_bytes())
    (tmp_path / "own.yaml").write_text("name: mine\nbase: cam.yaml\n")
    document = read_spec(str(tmp_path / "own.yaml"))
    assert (document.place("requirements.0"), document.place("name")) == ((2, 7), (1, 7))


def test_a_run_without_a_curve_writes_its_numbers_and_its_specification(spec):
    report = run_design(spec.replace({"design.stroke": "2 m"}), Run())
    assert report.status is Status.INFEASIBLE
    assert [name for name, _ in files(report)] == ["metrics.json", "resolved.yaml"]
