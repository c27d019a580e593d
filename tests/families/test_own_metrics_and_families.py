"""Metrics that are functions of a program, and families that it registers: everywhere where cfmkit's own are."""

from __future__ import annotations

import inspect
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import own_definitions
import pytest
import spare_family

import cfmkit
from cfmkit import families
from cfmkit.cli import run_command
from cfmkit.families.base import ResultNames

pytestmark = pytest.mark.lists

CAM = Path(__file__).parents[2] / "configs" / "cam.yaml"
VARY = {"mechanism.springs.stiffness": ["0.5 N/mm", "1 N/mm"]}


def swing(result):
    """Largest effort minus the smallest one."""
    return float(np.ptp(result.curve.effort))


def test_a_function_is_a_metric_of_evaluate_sweeps_and_sensitivity_studies():
    spec = cfmkit.load(CAM)
    expected = swing(cfmkit.analyze(spec))
    assert cfmkit.evaluate(spec, [swing])["swing"].value == expected
    study = cfmkit.sweep(spec, vary=VARY, metrics=["force_mean", swing])
    singly = [swing(cfmkit.analyze(spec.replace({"mechanism.springs.stiffness": k}))) for k in (500.0, 1000.0)]
    assert study.table["swing"].tolist() == pytest.approx(singly, rel=1e-12)
    parameters = {"mechanism.springs.stiffness": {"normal": "1 %"}}
    found = cfmkit.sensitivity(spec, method="local", parameters=parameters, metrics=[swing])
    (slope,) = [
        value
        for metric, index, value in zip(*(found.indices[k] for k in ("metric", "index", "value")), strict=True)
        if (metric, index) == ("swing", "normalised_slope")
    ]
    assert slope == pytest.approx(1.0, abs=0.05)  # forces are in proportion to the springs, but for friction


def test_a_metric_of_the_user_stands_in_requirements_with_its_unit_and_in_reports(tmp_path):
    cfmkit.metric(swing, dimension="force")
    text = CAM.read_text().replace("requirements:", "requirements:\n  - {metric: swing, max: 60 N}", 1)
    (tmp_path / "cam.yaml").write_text(text)
    assert cfmkit.check(tmp_path / "cam.yaml") == ()
    result = cfmkit.analyze(tmp_path / "cam.yaml")
    assert result.requirements[0].sentence.startswith("swing ")
    assert result.requirements[0].ok == (result.metrics["swing"].value <= 60)
    found = cfmkit.batch([tmp_path / "cam.yaml"], tmp_path / "out", verb="analyze", plots=False, page=True)
    written = json.loads(next((tmp_path / "out").rglob("*/metrics.json")).read_text())
    assert written["metrics"]["swing"] == {
        "value": result.metrics["swing"].value,
        "unit": "N",
        "definition": "Largest effort minus the smallest one.",
    }
    assert "swing" in next((tmp_path / "out").rglob("*/report.html")).read_text()
    assert found.exit_code == 0


def test_a_requirement_takes_the_function_itself_and_misses_it_where_it_is_missed():
    spec = cfmkit.load(CAM).replace({"requirements": [{"metric": swing, "max": "1"}]})
    (outcome,) = cfmkit.analyze(spec).requirements
    assert (outcome.metric, outcome.ok) == ("swing", False)
    assert [row["met"] for row in cfmkit.sweep(spec, vary=VARY, metrics=[swing]).summary["requirements"]] == [0]


def test_a_yield_counts_requirements_on_a_metric_of_the_user():
    spec = cfmkit.load(CAM)
    nominal = swing(cfmkit.analyze(spec))
    spec = spec.replace({"requirements": [{"metric": swing, "max": f"{nominal}"}]})
    parameters = {"mechanism.springs.stiffness": {"normal": "1 %"}}
    found = cfmkit.sensitivity(spec, method="tolerance", samples=60, parameters=parameters)
    assert 0.2 < found.summary["yield"]["value"] < 0.8  # the nominal part is on the bound: half of all are below


def test_no_value_says_why_and_a_function_that_fails_is_named():
    @cfmkit.metric
    def never(result):
        return None

    @cfmkit.metric
    def broken(result):
        return result.curve.effort["load"]

    assert cfmkit.evaluate(CAM, ["never"])["never"].value is None
    with pytest.raises(cfmkit.UsageError, match="the metric 'broken' failed: IndexError"):
        cfmkit.evaluate(CAM, ["broken"])
    study = cfmkit.sweep(CAM, vary=VARY, metrics=["broken"])
    assert set(study.table["status"]) == {"invalid"}
    assert all("the metric 'broken' failed" in text for text in study.table["message"])


@pytest.mark.parametrize(
    ("keys", "reported"),
    [
        ({"name": "Swing it"}, "cannot be the name of a metric"),
        ({"dimension": "newton"}, "there is no dimension 'newton'; there are length"),
    ],
)
def test_a_malformed_metric_is_refused_in_one_line(keys, reported):
    with pytest.raises(cfmkit.UsageError, match=reported):
        cfmkit.metric(swing, **keys)
    with pytest.raises(cfmkit.UsageError, match="cannot be the name of a metric"):
        cfmkit.evaluate(CAM, [lambda result: 1.0])


@pytest.mark.parametrize("name", ["force_ripple", "undercut_travel"])
def test_a_metric_does_not_hide_one_of_cfmkit(name):
    cfmkit.metric(swing, name=name)
    with pytest.raises(cfmkit.UsageError, match=f"the metric '{name}' needs another name"):
        cfmkit.analyze(CAM)


def test_a_registered_family_is_one_like_any_other_until_another_of_its_name_is():
    with pytest.raises(cfmkit.SpecError, match="'spare'"):
        cfmkit.loads(spare_family.TEXT)
    cfmkit.register(spare_family.FAMILY_RECORD)
    result = cfmkit.analyze(cfmkit.loads(spare_family.TEXT))
    np.testing.assert_allclose(result.curve.effort, 2000 * result.curve.motion)
    assert "force" in result._repr_html_()
    assert "spare" in families.names()
    cfmkit.register(replace(spare_family.FAMILY_RECORD, summary="another"))
    assert families.family("spare").summary == "another"


def test_the_page_of_a_family_names_no_command_for_which_it_has_no_file(capsys):
    cfmkit.register(spare_family.FAMILY_RECORD)
    assert run_command(["show", "spare"]) == 0
    assert "cfmkit new" not in capsys.readouterr().out
    assert run_command(["show", "cam"]) == 0
    assert "cfmkit new cam" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("record", "reported"),
    [
        (lambda: families.family("cam"), "cfmkit itself has a family of this name"),
        (
            lambda: replace(spare_family.FAMILY_RECORD, outputs=ResultNames(branches=["load"])),
            "the field 'outputs.branches' of its record",
        ),
        (
            lambda: replace(spare_family.FAMILY_RECORD, outputs=ResultNames({"half_band": ("ratio", "of its own")})),
            "its value 'half_band' has the name of a metric: it needs another one",
        ),
        (
            lambda: replace(spare_family.FAMILY_RECORD, outputs=ResultNames(findings={"thin_wall": "of its own"})),
            "two findings are called 'thin_wall': one of them needs another name",
        ),
        (lambda: replace(spare_family.FAMILY_RECORD, interface=99), "is for interface 99"),
        (lambda: replace(spare_family.FAMILY_RECORD, name="other"), "'family' of its specifications is 'spare'"),
        (lambda: "cam", "a cfmkit.families.base.Family is needed, not str"),
    ],
)
def test_a_record_that_cannot_be_used_is_refused(record, reported):
    with pytest.raises(cfmkit.UsageError, match=reported):
        cfmkit.register(record())
    assert families.list_registered() == {}


def test_other_processes_compute_registered_families_and_metrics_of_modules():
    cfmkit.register(spare_family.FAMILY_RECORD)
    spec, vary = cfmkit.loads(spare_family.TEXT), {"mechanism.stiffness": ["1 N/mm", "3 N/mm"]}
    metrics = [own_definitions.peak_to_peak]
    alone, together = (cfmkit.sweep(spec, jobs, vary=vary, metrics=metrics).table for jobs in (1, 2))
    assert alone["peak_to_peak"].tolist() == pytest.approx([10.0, 30.0])
    assert alone["peak_to_peak"].tolist() == together["peak_to_peak"].tolist()


def test_a_function_that_no_other_process_can_import_is_refused_before_it_begins():
    def local(result):
        return 1.0

    with pytest.raises(cfmkit.UsageError, match="'local' cannot be computed in other processes: put it in a module"):
        cfmkit.sweep(CAM, 2, vary=VARY, metrics=[local])


def test_kept_results_are_of_the_functions_that_are_registered():
    plain = families.origin("cam")
    cfmkit.metric(swing)
    first = families.origin("cam")
    cfmkit.metric(swing)
    assert plain == {}
    assert families.origin("cam") == first != plain
    cfmkit.metric(lambda result: 2.0, name="swing")
    assert families.origin("cam") != first


@pytest.mark.parametrize("name", [name for name in cfmkit.__all__ if inspect.isfunction(getattr(cfmkit, name))])
def test_signatures_name_every_argument(name):
    """Editors complete from them: nothing is taken as ``**keys``."""
    parameters = inspect.signature(getattr(cfmkit, name)).parameters.values()
    assert not [one.name for one in parameters if one.kind is inspect.Parameter.VAR_KEYWORD]
    documentation = getattr(cfmkit, name).__doc__
    assert [one.name for one in parameters if one.name not in documentation] == []


def test_signatures_have_the_keys_of_the_blocks_that_they_stand_for():
    from cfmkit.families.request_spec import RequestArguments, SuggestBlock
    from cfmkit.specs import Sensitivity, Sweep

    assert set(RequestArguments.__annotations__) == set(SuggestBlock.model_fields)
    for function, block, others in (
        (cfmkit.sweep, Sweep, {"spec", "jobs", "seed"}),
        (cfmkit.sensitivity, Sensitivity, {"spec", "jobs"}),
        (cfmkit.suggest, SuggestBlock, {"request", "seed", "jobs", "time_budget"}),
    ):
        assert set(inspect.signature(function).parameters) - others == set(block.model_fields)
