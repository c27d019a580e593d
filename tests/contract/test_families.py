"""What every family must do, over every configuration that belongs to it; a new family is picked up by itself."""

from __future__ import annotations

import pickle
import re
from functools import cache
from pathlib import Path

import numpy as np
import plugin_support
import pytest
import spare_family

import cfmkit
from cfmkit import api, families
from cfmkit.cli import run_command
from cfmkit.cli.verbs.new import template
from cfmkit.documents import run_outcome
from cfmkit.export import Drawing
from cfmkit.families.deferred_imports import load_deferred
from cfmkit.results import Status
from cfmkit.runs.files_a_run_writes import files
from cfmkit.specs.keys_and_schema import keys
from cfmkit.specs.units import DIMENSIONS_BY_NAME

CONFIGS = [*sorted((Path(__file__).parents[2] / "configs").glob("*.yaml")), *plugin_support.CONFIGS]
BY_NAME = {path.stem: path for path in CONFIGS}

every_config = pytest.mark.parametrize("path", CONFIGS, ids=BY_NAME)
every_family = pytest.mark.parametrize("name", families.names())


def designable(path: Path) -> bool:
    return families.family(cfmkit.load(path).family).design is not None and cfmkit.load(path).design is not None


SEARCHES = {
    "beam_design_lan": pytest.mark.long,
    "beam_lan_rising": pytest.mark.long,
    "slider_crank_taper_design": pytest.mark.slow,
    "slider_crank_paper_ranges": pytest.mark.slow,
}
"""Designs by long searches."""

every_design = pytest.mark.parametrize(
    "path",
    [pytest.param(path, id=path.stem, marks=SEARCHES.get(path.stem, ())) for path in CONFIGS if designable(path)],
)


FEW = 3


@cache
def analysed(path):
    """Return the result of a config; results are values, so tests may share them."""
    return api.analyze(cfmkit.load(path))


@cache
def designed(path):
    """Return the design of a config, likewise; of a shape search with few starts, which may hold less of the travel."""
    spec = cfmkit.load(path)
    if getattr(getattr(spec.design, "optimise", None), "starts", 0) > FEW:
        kept = tuple(one for one in spec.requirements if one.metric != "strict_range_fraction")
        spec = spec.replace({"design.optimise.starts": FEW, "design.optimise.widened": 1, "requirements": kept})
    return api.design(spec)


def numbers(quantities):
    return {name: (quantity.value, quantity.dimension) for name, quantity in quantities.items()}


@every_family
def test_a_family_has_a_config_and_the_config_of_its_template(name):
    record = families.family(name)
    assert record.name == name
    assert {cfmkit.load(path).family for path in CONFIGS} >= {name}
    spec = cfmkit.loads(template(name))
    assert spec.family == name


@every_family
def test_a_template_runs_and_is_designed_without_a_warning(name):
    spec = cfmkit.loads(template(name))
    for found in (spec, cfmkit.design(spec).spec):
        done = run_outcome.report_on(cfmkit.analyze(found))
        assert [item.name for item in done.warnings] == []
        assert (done.status, not done.missed) == (Status.COMPLETE, True)


@every_family
def test_the_band_of_the_template_is_one_that_a_spec_takes(name):
    text = template(name)
    spec = cfmkit.loads(re.sub(r"(?m)^  # (band: \S+ ?%?).*$", r"  \1", text).encode())
    assert text.count("# band: 5 %") == 1
    assert spec.analysis.band == 0.05
    assert spec.replace({"analysis.band": "2 %"}) == spec.replace({"analysis.band": 0.02})


@pytest.mark.lists
@every_family
def test_the_template_mentions_every_key_of_the_mechanism_the_design_and_the_analysis(name):
    text = template(name)
    paths = [key.path.split(".") for key in keys(families.family(name).spec_type)]
    named = {path[1] for path in paths if path[0] in ("mechanism", "design", "analysis") and len(path) == 2}
    assert {word for word in named if f"{word}:" not in text} == set()


@pytest.mark.lists
@every_family
def test_a_template_lists_the_words_of_a_choice(name):
    text = template(name)
    assert "{words of" not in text
    if name == "vcfm":
        from cfmkit.families.vcfm.leaves_spec import LEAF_KINDS, SPRING_KINDS

        assert f"structure: v-beam             # {', '.join(LEAF_KINDS)}\n" in text
        assert f"structure: diamond            # {', '.join(SPRING_KINDS)}\n" in text


@pytest.mark.lists
@every_family
def test_what_a_family_says_about_itself_is_complete(name):
    record = families.family(name)
    assert record.summary
    assert record.papers
    assert all(DIMENSIONS_BY_NAME[dimension] and definition for dimension, definition in record.outputs.values.values())
    assert all(record.outputs.findings.values())
    parts = [record, *filter(None, (record.design, record.draw, record.elastic))]
    functions = [value for part in parts for value in vars(part).values() if callable(value)]
    assert len(functions) > 6
    assert all(callable(load_deferred(function)) for function in functions)


@every_config
def test_a_config_solves_and_meets_its_requirements(path):
    found = run_outcome.report_on(analysed(path))
    assert found.result.status is Status.COMPLETE, found.result.message
    assert found.requirements
    assert [outcome.sentence for outcome in found.missed] == []


@every_config
@pytest.mark.parametrize("complete", [False, True])
def test_a_config_round_trips_through_yaml(path, complete, monkeypatch):
    monkeypatch.chdir(path.parent)  # data files that a text names are sought here
    spec = cfmkit.load(path)
    assert cfmkit.loads(cfmkit.dumps(spec, complete)) == spec
    resolved = api.resolve(spec)
    assert cfmkit.loads(cfmkit.dumps(resolved, complete)) == resolved
    assert api.resolve(resolved) == resolved


@every_config
def test_the_arrays_of_a_result_are_finite_and_cannot_be_written_to(path):
    result = analysed(path)
    for curve in result.curves:
        for name, column in curve.columns():
            assert not column.values.flags.writeable, name
            assert len(column.values) == len(curve)
        assert np.isfinite(curve.motion).all()
        assert np.isfinite(curve.effort[curve.stable]).all()
        assert np.isnan(curve.effort).mean() < 0.01
        with pytest.raises(ValueError, match="read-only"):
            curve.motion[0] = 1.0


@every_config
def test_the_same_spec_gives_the_same_result(path):
    one, other = analysed(path), api.analyze(cfmkit.load(path))
    assert numbers(api.evaluate(one)) == numbers(api.evaluate(other))
    for curve, again in zip(one.curves, other.curves, strict=True):
        np.testing.assert_array_equal(curve.effort, again.effort)


@every_config
def test_the_resolved_spec_gives_the_same_result(path, monkeypatch):
    monkeypatch.chdir(path.parent)
    result = analysed(path)
    again = api.analyze(cfmkit.loads(cfmkit.dumps(result.spec, complete=True)))
    assert again.spec == result.spec
    found, wanted = numbers(api.evaluate(again)), numbers(api.evaluate(result))
    assert list(found) == list(wanted)
    for name, (value, dimension) in wanted.items():  # sums of other arrays may round otherwise
        assert found[name] == (value if value is None else pytest.approx(value, rel=1e-12, abs=0.0), dimension), name


@every_config
def test_every_numeric_leaf_can_be_replaced(path):
    spec = cfmkit.load(path)
    leaves = dict(spec.leaves())
    assert len(leaves) > 5
    for leaf, value in leaves.items():
        new = value if isinstance(value, int) else value * (1 + 1e-9)
        changed = spec.replace({leaf: new})
        assert changed.get_value(leaf) == new, leaf
        assert spec.get_value(leaf) == value, leaf
        others = {other: item for other, item in changed.leaves() if other != leaf}
        assert others == {other: item for other, item in leaves.items() if other != leaf}, leaf


def _explained(record, name):
    """Return what a family says of a value: one of something named in brackets is explained for all of its kind."""
    plain, bracket, _ = name.partition("[")
    kind = next((known for known in record.outputs.values if bracket and known.startswith(f"{plain}[")), name)
    return record.outputs.values.get(kind)


@every_config
def test_every_value_and_finding_is_one_that_the_family_explains(path):
    record, result = families.family(cfmkit.load(path).family), analysed(path)
    explained = {name: _explained(record, name) for name in result.values}
    assert {name for name, known in explained.items() if known is None} == set()
    assert {item.name for item in result.warnings} <= set(record.outputs.findings)
    for name, quantity in result.values.items():
        assert (quantity.dimension, quantity.definition) == explained[name]
    assert set(record.outputs.headline) <= set(api.evaluate(result)), "a headline that no metric has"


@every_config
def test_a_cure_is_a_change_that_the_spec_takes(path):
    spec = cfmkit.load(path)
    for item in analysed(path).warnings:
        for cure in item.cures:
            assert cfmkit.load(path, [cure] if isinstance(cure, str) else cure) != spec


def test_some_configuration_has_a_cure():
    assert any(item.cures for path in CONFIGS for item in analysed(path).warnings)


@every_config
def test_spec_and_curves_survive_the_way_to_another_process(path):
    result = analysed(path)
    spec, curves = pickle.loads(pickle.dumps((result.spec, result.curves)))
    assert spec == result.spec
    np.testing.assert_array_equal(curves[0].effort, result.curve.effort)


@every_design
def test_a_design_is_judged_like_any_other_spec(path):
    design = designed(path)
    assert design.status is Status.COMPLETE, design.message
    written = cfmkit.loads(cfmkit.dumps(design.spec))
    assert written == design.spec
    direct, again = (
        run_outcome.report_on(api.analyze(design.spec), design),
        run_outcome.report_on(api.analyze(written)),
    )
    assert [outcome.sentence for outcome in direct.missed] == []
    assert numbers(again.metrics) == numbers(direct.metrics)


@every_design
def test_designing_a_design_changes_nothing(path):
    design = designed(path)
    again = api.design(design.spec).spec
    if path.stem == "slider_crank_paper_ranges":  # a search goes on from rounded lengths: by digits of its process
        numbers = [
            {key: value for key, value in spec.leaves() if isinstance(value, float)} for spec in (again, design.spec)
        ]
        assert numbers[0] == pytest.approx(numbers[1], rel=1e-3)
    else:
        assert again == design.spec


@every_config
def test_the_parts_of_a_config_can_be_drawn(path):
    spec = cfmkit.load(path)
    if families.family(spec.family).outline is None:
        with pytest.raises(cfmkit.UsageError):
            api.drawing(spec)
        return
    drawn = api.drawing(spec)
    assert isinstance(drawn, Drawing)
    assert any(contour.closed and contour.layer == "cut" for contour in drawn.contours)


@every_config
def test_the_files_of_a_run_are_the_same_every_time(path):
    found = run_outcome.report_on(analysed(path))
    one, other = (dict(files(found, plots=False)) for _ in range(2))
    assert {"metrics.json", "resolved.yaml", "curve.csv"} <= set(one)
    assert one == other


@pytest.fixture
def spare(monkeypatch, tmp_path):
    """A fifth family in the registry, which draws and designs nothing; its spec in the current folder."""
    monkeypatch.setitem(families.FAMILY_MODULES, "spare", "spare_family")
    monkeypatch.chdir(tmp_path)
    Path("spare.yaml").write_text(spare_family.TEXT)
    return "spare.yaml"


def test_a_family_without_drawings_gets_the_picture_of_its_curve(spare):
    assert set(api.figures(cfmkit.analyze(cfmkit.load(spare)))) == {"curve"}
    assert run_command(["analyze", spare, "-o", "out", "-q"]) == 0
    assert Path("out/figures/curve.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    "command", [("check",), ("design",), ("export",), ("sweep", "--vary", "analysis.points=[5,6]")]
)
def test_a_family_with_as_little_as_there_can_be_breaks_no_command(spare, command, capsys):
    verb, *options = command
    assert run_command([verb, spare, *options, *(["-o", "out"] if verb != "check" else [])]) in (0, 2, 3)
    assert "bug" not in capsys.readouterr().err


@pytest.mark.parametrize(
    "arguments", [("show", "spare"), ("show",), ("schema", "spare"), ("schema",), ("new", "spare")]
)
def test_a_family_without_a_template_or_references_is_explained_like_the_others(spare, arguments, capsys):
    assert run_command(list(arguments)) in (0, 2)
    assert "bug" not in capsys.readouterr().err
