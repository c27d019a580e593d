"""Every family whose models can be chosen lets them be compared, over every configuration with data for several."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import plugin_support
import pytest

import cfmkit
from cfmkit import Run, families
from cfmkit.curves import Curve
from cfmkit.errors import SpecError, UsageError
from cfmkit.results import Finding, Result, Status
from cfmkit.studies.comparison_of_fidelities import (
    FIDELITY_KEY,
    Choices,
    FidelityComparison,
    Variant,
    choices_of,
    compare,
    fidelity_of,
    lines_of,
)
from cfmkit.studies.variations import CannotVary, leaf

CONFIGS = [*sorted((Path(__file__).parents[2] / "configs").glob("*.yaml")), *plugin_support.CONFIGS]
CAM = CONFIGS[0].parent / "cam.yaml"


def quick(path):
    """Return a specification; a part that can be solved as a solid with few poses on a coarse mesh."""
    spec = cfmkit.load(path)
    if "solid" not in families.family(spec.family).models:
        return spec
    return spec.replace({"analysis.solid.poses": 3, "analysis.solid.error": 0.1})


@cache
def comparable(path):
    try:
        return choices_of(quick(path))
    except (SpecError, UsageError):
        return None


LONG = ("beam_williams_toggle", "beam_v_bifurcation", "beam_cantilever", "beam_lee_frame")
"""Configurations of slender beams, which as solids have more elements than all others together."""


@pytest.mark.parametrize(
    "path",
    [pytest.param(path, id=path.stem, marks=[pytest.mark.slow] if path.stem in LONG else []) for path in CONFIGS],
)
def test_models_are_compared_or_one_sentence_says_why_not(path):
    spec = quick(path)
    choices = comparable(path)
    if choices is None:
        with pytest.raises((SpecError, UsageError), match=r"--compare-fidelity: [^\n]+$"):
            choices_of(spec)
        return
    nominal = cfmkit.analyze(spec)
    found = compare(nominal, choices, Run())
    assert found.variants[0].result is nominal
    assert {item.name for item in found.variants} == set(choices.specs)
    for item in found.variants:
        assert fidelity_of(item.result) == item.name
        assert item.result.spec.get_value(FIDELITY_KEY) == item.name
    assert found.finest == [name for name in choices.names if name in choices.specs][-1]
    assert set(found.metrics()) >= {f"fidelity_rms[{item.name}]" for item in found.compared}


@pytest.mark.parametrize("name", families.names())
def test_the_models_of_a_family_are_the_words_of_its_fidelity(name):
    record = families.family(name)
    try:
        words = tuple(leaf(record.spec_type, FIDELITY_KEY).choices)
    except CannotVary:
        words = tuple(record.models)[:1]
    assert tuple(record.models) == words


@pytest.mark.parametrize("path", CONFIGS, ids=lambda path: path.stem)
def test_the_model_that_a_specification_picks_is_one_of_its_family(path):
    spec = cfmkit.load(path)
    record = families.family(spec.family)
    asked = []
    models = {name: lambda _spec, _run, name=name: asked.append(name) for name in record.models}
    replace(record, models=models).analyze(spec, Run())
    assert asked == [spec.fidelity or next(iter(record.models))]


def test_some_configuration_has_data_for_several_models():
    assert any(comparable(path) for path in CONFIGS)


# --- three models of a made-up mechanism -------------------------------------------------------------------


def curve(motion, offset, branches=("load",)):
    parts = [np.asarray(motion)[:: 1 if k == 0 else -1] for k in range(len(branches))]
    whole = np.concatenate(parts)
    names = np.repeat(branches, len(motion))
    return Curve(whole, 10.0 + offset + whole, names, np.ones(len(whole), bool))


def result(*curves, status=Status.COMPLETE, message="", warnings=()):
    spec = cfmkit.load(CAM)
    return Result(spec, status, message, tuple(curves), warnings=warnings)


def outcome(nominal, *others):
    variants = (nominal, *others)
    return FidelityComparison(tuple(Variant(name, item) for name, item in variants), "fine", {})


RANGE = np.linspace(0.0, 0.1, 11)


def test_a_constant_offset_is_the_rms_the_mean_and_the_largest_of_the_difference():
    window = np.linspace(0.05, 0.3, 7)
    found = outcome(("coarse", result(curve(RANGE, 0.5))), ("fine", result(curve(window, 0.0))))
    spans = found.differences(found.compared[0]).window
    assert (spans.lo, spans.hi) == (0.05, 0.1)
    metrics = found.metrics()
    assert {name: item.value for name, item in metrics.items()} == {
        f"fidelity_{name}[coarse]": pytest.approx(0.5) for name in ("rms", "max", "mean")
    }
    assert "(coarse - fine) force, at 1001 even places over 50 ... 100 mm" in metrics["fidelity_rms[coarse]"].definition


def test_each_model_is_compared_with_the_finest_on_each_branch_of_that():
    both = ("load", "unload")
    found = outcome(
        ("fine", result(curve(RANGE, 0.0, both))),
        ("coarse", result(curve(RANGE, -1.0))),
        ("middle", result(curve(RANGE, 0.25, both))),
    )
    means = {name: item.value for name, item in found.metrics().items() if "mean" in name}
    wanted = {"coarse": -1.0, "middle": 0.25}
    assert means == {
        f"fidelity_mean[{name}{branch}]": pytest.approx(value)
        for name, value in wanted.items()
        for branch in ("", ",load", ",unload")
    }
    assert [item.label["fidelity"] for item in found.curves] == [
        (name, "text") for name in ("fine", "coarse", "middle")
    ]


def test_a_model_that_fails_keeps_its_status_and_gives_no_number():
    gone = result(status=Status.NO_EQUILIBRIUM, message="it cannot stand")
    found = outcome(("coarse", result(curve(RANGE, 0.0))), ("fine", gone))
    assert found.shortfall == "fidelity fine: it cannot stand"
    value = found.metrics()["fidelity_rms[coarse]"]
    assert (value.value, value.reason) == (None, "there is no fine curve")
    assert [text for _, text in lines_of(found)] == ["coarse - fine: undefined: there is no fine curve"]


def test_a_curve_that_turns_back_is_shown_but_not_summed_up():
    folded = curve([0.0, 0.06, 0.03, 0.1], 0.0)
    found = outcome(("coarse", result(folded)), ("fine", result(curve(RANGE, 0.0))))
    assert found.metrics()["fidelity_rms[coarse]"].value is None
    assert "many-valued" in found.metrics()["fidelity_rms[coarse]"].reason
    assert len(found.curves) == 2


def test_curves_without_common_travel_are_not_compared():
    found = outcome(("coarse", result(curve(RANGE, 0.0))), ("fine", result(curve(RANGE + 1.0, 0.0))))
    assert found.metrics()["fidelity_max[coarse]"].reason == "they have no travel in common"


def test_what_only_the_other_model_warns_of_is_told_with_its_name_and_what_is_left_out_too():
    shared, own = Finding("shared", "a"), Finding("own", "b")
    found = outcome(
        ("coarse", result(curve(RANGE, 0.0), warnings=(shared,))),
        ("fine", result(curve(RANGE, 0.0), warnings=(shared, own))),
    )
    found = replace(found, left_out={"finer still": "it needs a mesh"})
    assert [(item.name, item.message) for item in found.warnings] == [
        ("fidelity_left_out", "'finer still' cannot run here: it needs a mesh"),
        ("own", "with fidelity fine: b"),
    ]


def test_the_finest_model_that_can_run_is_the_reference():
    spec = cfmkit.load(CAM).replace({FIDELITY_KEY: "quasi-static"})
    choices = Choices(("rough", "quasi-static", "finest"), {"rough": spec, "quasi-static": spec}, {"finest": "no data"})
    found = compare(cfmkit.analyze(spec), choices, Run())
    assert (found.finest, dict(found.left_out)) == ("quasi-static", {"finest": "no data"})
    assert found.metrics()["fidelity_rms[rough]"].value == 0.0
