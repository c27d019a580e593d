"""What a notebook shows of specifications, results and studies: little, all of it text, and a figure."""

from __future__ import annotations

import pickle
from dataclasses import is_dataclass, replace
from pathlib import Path

import numpy as np
import pytest

import cfmkit
from cfmkit.families import family
from cfmkit.metrics import check, values_of_family
from cfmkit.results import Design, Finding, Result, Status
from cfmkit.tables import Table

CONFIGS = Path(__file__).parents[2] / "configs"
HOSTILE = "<script>alert(1)</script>"


@pytest.fixture(scope="module")
def result():
    return cfmkit.analyze(CONFIGS / "cam.yaml")


@pytest.mark.parametrize("name", ["cam", "beam_lan2010", "slider_crank_bilancia2019"])
def test_texts_of_everything_are_short(name):
    spec = cfmkit.load(CONFIGS / f"{name}.yaml")
    found = cfmkit.analyze(spec)
    for one in (spec, found, found.curve, found.metrics["force_mean"]):
        assert 10 < len(repr(one)) < 2000
    assert spec.name in repr(found)


def test_a_curve_says_over_which_travel_it_goes_loading_and_unloading(result):
    assert "962 points, 0 ... 0.24 m, branches load, unload" in repr(result.curve)


def test_a_batch_is_shown_with_a_row_per_specification_and_its_text_is_short(tmp_path):
    spec = tmp_path / f"{HOSTILE.replace('/', '')}.yaml"
    spec.write_text((CONFIGS / "slider_crank_bilancia2019.yaml").read_text())
    found = cfmkit.batch([spec], tmp_path / "out", verb="analyze", plots=False)
    assert "exit code 0" in repr(found)
    assert len(repr(replace(found, entries=found.entries * 40))) < 2000
    shown = replace(found, entries=found.entries * 12)._repr_html_()
    assert shown.count("<tr>") == 11
    assert "2 more rows" in shown
    assert "<script>" not in shown


def test_a_result_measures_itself_as_evaluate_and_the_metrics_do(result):
    assert {name: one.value for name, one in result.metrics.items()} == {
        name: one.value for name, one in cfmkit.evaluate(result).items()
    }
    assert result.requirements == check(
        result.spec.part_requirements, result, values_of_family(family("cam").outputs.values)
    )


def test_a_result_is_shown_with_metrics_requirements_and_one_figure(result):
    shown = result._repr_html_()
    assert shown.count("<svg") == 1
    assert "50.7 N load, 49.3 N unload over 238 mm" in shown
    assert shown.count("<td>ok</td>") == len(result.requirements)
    assert len(shown.partition("<figure")[0].partition("<svg")[0]) < 2000


def test_a_result_without_a_curve_is_shown_with_its_reason():
    spec = cfmkit.load(CONFIGS / "cam.yaml").replace({"name": HOSTILE})
    from cfmkit.runs.notebook_result import AnalysisView

    shown = AnalysisView.from_result(Result(spec, Status.NO_EQUILIBRIUM, "nothing holds it"))._repr_html_()
    assert "nothing holds it" in shown
    assert HOSTILE not in shown


def test_a_study_is_shown_with_its_best_point_requirements_a_figure_and_its_first_points():
    vary = {"mechanism.roller_radius": np.linspace(0.008, 0.012, 12)}
    study = cfmkit.sweep(CONFIGS / "cam.yaml", vary=vary)
    assert len(repr(study)) < 2000
    shown = study._repr_html_()
    assert shown.count("<svg") == 1
    assert "met at 12 of 12" in shown
    assert "best: --set mechanism.roller_radius=8mm" in shown
    assert set(study.figures) <= set(study.table.headers) | {
        header.partition(" [")[0] for header in study.table.headers
    }
    assert shown.rpartition("<table")[2].count("<tr>") == 11
    assert "2 more rows" in shown


@pytest.mark.parametrize("method", ["tolerance", "local"])
def test_a_sensitivity_study_is_shown_with_a_figure(method):
    parameters = {"mechanism.springs.stiffness": {"normal": "1 %"}}
    spec = CONFIGS / "cam.yaml"
    study = cfmkit.sensitivity(spec, method=method, samples=10, parameters=parameters, metrics=["force_mean"])
    assert study._repr_html_().count("<svg") == 1
    assert any(name.startswith("force_mean") for name in study.figures)
    assert len(repr(study)) < 2000
    again = pickle.loads(pickle.dumps(study))
    assert again.summary == study.summary
    assert set(again.figures) == set(study.figures)


def test_a_spec_is_shown_as_its_file():
    spec = cfmkit.load(CONFIGS / "cam.yaml").replace({"name": HOSTILE})
    assert "roller_radius" in spec._repr_html_()
    assert HOSTILE not in spec._repr_html_()


def test_a_result_goes_through_a_pipe_between_processes(result):
    other = pickle.loads(pickle.dumps(result))
    np.testing.assert_array_equal(other.curve.effort, result.curve.effort)


def test_a_design_shows_how_it_ended_and_its_file():
    spec = cfmkit.load(CONFIGS / "cam.yaml")
    warned = Finding("thin", f"the leaf is thin {HOSTILE}")
    shown = Design(
        spec, Status.COMPLETE, f"found {HOSTILE}", warnings=(warned,), notes=(("made", "88 %"),)
    )._repr_html_()
    assert HOSTILE not in shown
    assert all(word in shown for word in ("found", "thin", "made: 88 %", "roller_radius"))
    none = Design(None, Status.INFEASIBLE, "no design", nearest_feasible={"design.force": "12 N"})._repr_html_()
    assert "design.force: 12 N" in none


def texts_that_are_long(one, path="", depth=3):
    """Return what is reached from something by its public names, beside arrays, and has a text that is long.

    That is, of 2 000 letters or more, or with an array written out.
    """
    names = [name for name in dir(type(one)) if not name.startswith(("_", "model_"))]
    names += [name for name in getattr(one, "__dict__", {}) if not name.startswith("_")]
    for name in sorted(set(names)):
        inside = getattr(one, name, None)  # a force has no angle
        if callable(inside) or isinstance(inside, np.ndarray):
            continue
        if len(repr(inside)) >= 2000 or "array([" in repr(inside):
            yield f"{path}.{name}"
        of_the_solver = is_dataclass(inside) and (path, name) in {
            ("", "state"),
            ("", "closed"),
            (".closed", "solution"),
        }
        if depth and (of_the_solver or isinstance(inside, (cfmkit.Spec, cfmkit.Curve, Table))):
            yield from texts_that_are_long(inside, f"{path}.{name}", depth - 1)


@pytest.mark.parametrize("name", ["cam", "beam_lan2010", "slider_crank_li2019", "slider_crank_strip"])
def test_texts_of_whatever_is_in_a_result_are_short(name):
    found = cfmkit.analyze(CONFIGS / f"{name}.yaml")
    assert list(texts_that_are_long(found)) == []
    name, value = next(iter(found.metrics.items()))
    assert repr(found.metrics).startswith(f"{{{name!r}: {value}, ")


def test_texts_of_whatever_is_in_a_study_are_short():
    found = cfmkit.sweep(CONFIGS / "cam.yaml", vary={"mechanism.roller_radius": "7mm:9mm:3"})
    assert set(texts_that_are_long(found)) <= {".table.headers"}  # names of all columns, as they are
    assert all(len(repr(one)) < 2000 for one in found.summary.values())
    assert "'metrics': Named of" in repr(found.summary)


def test_texts_of_drawings_files_and_measured_curves_are_short(tmp_path):
    spec = cfmkit.load(CONFIGS / "cam.yaml", ["analysis.points=21"])
    curve = cfmkit.analyze(spec).curve
    rows = [f"{1e3 * place},{force}" for place, force in zip(curve.motion, curve.effort, strict=True)]
    (tmp_path / "curve.csv").write_text("\n".join(["displacement [mm],force [N]", *rows]) + "\n")
    measured = cfmkit.measure(tmp_path / "curve.csv")
    fitted = cfmkit.calibrate(spec, tmp_path / "curve.csv", fit=["mechanism.rolling_friction"])
    named = (measured, measured.source, measured.source.recording, fitted, fitted.after)
    for one in (cfmkit.drawing(spec), cfmkit.export(spec), *named):
        assert 10 < len(repr(one)) < 2000, type(one)
        assert "array([" not in repr(one)


def test_metrics_and_requirements_are_tables_with_a_column_for_each_branch(result):
    shown = result.metrics._repr_html_()
    assert "<th>metric</th><th>worst</th><th>load</th><th>unload</th><th>what it is</th>" in shown
    assert shown.count("<tr>") == 1 + sum("[" not in name for name in result.metrics)
    assert f"<td>{result.metrics['force_mean[unload]'].value:.6g} N</td>" in shown
    met = result.requirements._repr_html_()
    assert met.count("<td>ok</td>") == len(result.requirements)
    assert "<td>&lt;= 170 mm</td>" in met
    assert pickle.loads(pickle.dumps(result.requirements)) == result.requirements


def test_a_result_is_drawn_on_axes_of_a_figure_of_ones_own(result):
    from matplotlib import pyplot

    figure, (left, right) = pyplot.subplots(1, 2)
    try:
        assert result.plot(left) is left
        assert result.plot(right, bands=False, names=False, arrows=False) is right
        assert left.get_xlabel() == "displacement [mm]"
        assert len(left.texts) > len(right.texts) == 0
        np.testing.assert_allclose(right.lines[0].get_xdata(), 1e3 * result.curve.select_branch("load").motion)
        own = result.plot()
        assert own.figure.get_size_inches() * 25.4 == pytest.approx((160, 100))
        pyplot.close(own.figure)
    finally:
        pyplot.close(figure)


def test_what_was_not_solved_cannot_be_drawn():
    from cfmkit.runs.notebook_result import AnalysisView

    failed = AnalysisView.from_result(
        Result(cfmkit.load(CONFIGS / "cam.yaml"), Status.NO_EQUILIBRIUM, "nothing holds it")
    )
    with pytest.raises(cfmkit.SolutionError, match="nothing holds it"):
        failed.plot()


def test_suggestions_are_shown_as_the_page_of_the_command():
    found = cfmkit.suggest(force="10 kN", travel="10 mm", envelope=["20 mm", "20 mm", "1 mm"], material="pla")
    shown = found._repr_html_()
    assert all(f"<td>{name}</td>" in shown for name in ("cam", "beam", "vcfm", "slider-crank"))
    assert 10 < len(repr(found)) < 2000
    assert "<svg" not in shown


@pytest.mark.slow
def test_proposals_are_shown_with_their_numbers_and_drawn_to_one_scale():
    """Slow: one proposal is designed and judged."""
    keys = {"force": "10 N", "travel": "3 mm", "envelope": ["80 mm", "70 mm", "13 mm"], "material": "pla"}
    found = cfmkit.suggest(**keys, time_budget="60 s")
    assert found.proposals
    shown = found._repr_html_()
    assert shown.count("<svg") == 1
    assert f"<td>1 {found.proposals[0].family}</td>" in shown
    assert len(repr(found)) < 2000


def test_a_measurement_and_a_fit_show_their_values_and_warnings():
    recording = CONFIGS / "synthetic" / "cam_loop.csv"
    measured = repr(cfmkit.measure(recording, window="40 mm:120 mm"))
    assert "cam_loop.csv, 1 cycle; force_mean 49.17 N" in measured
    fitted = repr(cfmkit.calibrate(CONFIGS / "cam.yaml", recording, fit=["mechanism.rolling_friction"]))
    assert "mechanism.rolling_friction = 0.00223" in fitted
    assert fitted.endswith("warnings: weakly_identified, lack_of_fit>")


def test_a_metric_that_is_not_there_is_answered_with_the_nearest(result):
    with pytest.raises(KeyError, match="there is no metric 'ripple'; did you mean 'force_ripple'"):
        result.metrics["ripple"]
    assert result.metrics.get("ripple") is None


def test_python_is_told_of_arguments_and_not_of_options():
    with pytest.raises(cfmkit.SpecError, match=r"^envelope is missing"):
        cfmkit.suggest(force="20 N", travel="10 mm")
    with pytest.raises(cfmkit.SpecError, match=r"^force: 20 has no unit"):
        cfmkit.suggest(force="20", travel="10 mm", envelope=["80 mm", "60 mm"])
