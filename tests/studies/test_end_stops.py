"""End stops of a driven shuttle or slider: closed forms and traced models have the same force beyond a gap."""

from __future__ import annotations

import numpy as np
import pytest
from beam_support import CONFIGS
from given_points import GivenPoints

import cfmkit
from cfmkit.errors import SpecError
from cfmkit.families import family
from cfmkit.results import Status
from cfmkit.studies.point_evaluation import Study, metrics_of
from cfmkit.studies.variants_in_rows import points_at_once

GAP = 4e-3
RATE = 5e4
ENDS = {"vcfm_ding2022": 0.006, "slider_crank_strip": 0.034}


def loaded(name, **changes):
    """Return an example without requirements, with other values."""
    return cfmkit.load(CONFIGS / f"{name}.yaml").replace({"requirements": []} | changes)


def stopped(name, stop, **changes):
    """Return an example with a stop of its shuttle or slider."""
    return loaded(name, **{"mechanism.stops": {"end": stop}}, **changes)


def vcfm(stop, preload=0.0, fidelity="analytic"):
    """Return the mechanism of Ding with a stop."""
    return stopped(
        "vcfm_ding2022", stop, **{"analysis.preloads": (preload,), "analysis.fidelity": fidelity, "analysis.points": 61}
    )


def reported(result):
    """Return the messages of a result by the name of the finding."""
    return {finding.name: finding.message for finding in result.warnings}


@pytest.mark.parametrize(
    ("name", "fidelity"), [("vcfm_ding2022", "analytic"), ("vcfm_ding2022", "exact"), ("slider_crank_strip", "beam")]
)
def test_an_elastic_stop_adds_its_rate_times_the_way_beyond_its_gap(name, fidelity):
    few = {"analysis.fidelity": fidelity, "analysis.points": 41}
    free, result = (
        cfmkit.analyze(spec) for spec in (loaded(name, **few), stopped(name, {"gap": GAP, "stiffness": RATE}, **few))
    )
    places = np.linspace(0.0, ENDS[name], 101)
    added = result.closed.effort("load", places) - free.closed.effort("load", places)
    assert added == pytest.approx(RATE * np.maximum(places - GAP, 0.0), abs=1e-9)
    curve = result.curve
    assert curve.extra["stop_end_force"].values == pytest.approx(RATE * np.maximum(curve.motion - GAP, 0.0), abs=1e-12)
    (row,) = np.flatnonzero(curve.extra["event"].values != "")
    assert curve.motion[row] == GAP
    assert curve.extra["event"].values[row] == "end begins"
    assert result.status is Status.COMPLETE
    assert result.values["first_contact"].value == GAP
    assert "stop 'end' is reached at 4 mm" in reported(result)["contact_begins"]


@pytest.mark.parametrize("name", ENDS)
def test_a_rigid_stop_ends_the_curve_at_its_gap_and_blocks_the_drive(name):
    result = cfmkit.analyze(stopped(name, {"gap": GAP}, **{"analysis.points": 41}))
    free = cfmkit.analyze(loaded(name, **{"analysis.points": 41}))
    assert result.status is Status.PARTIAL
    assert result.message == "the drive is blocked by stop 'end' at 4 mm"
    assert reported(result)["blocked"] == result.message
    assert result.curve.motion[-1] == GAP
    assert result.curve.force[-1] == pytest.approx(float(free.closed.effort("load", np.array([GAP]))[0]), rel=1e-9)


def test_mean_and_ripple_of_a_stop_are_those_of_its_column():
    result = cfmkit.analyze(vcfm({"gap": GAP, "stiffness": RATE}).replace({"analysis.window": (3e-3, 6e-3)}))
    found = cfmkit.evaluate(result)
    assert found["contact_force[end]"].value == pytest.approx(RATE * (2e-3) ** 2 / 2 / 3e-3, rel=1e-12)
    assert found["contact_force_ripple[end]"].value == 1.0
    assert found["contact_force_max"].value == pytest.approx(RATE * 2e-3, rel=1e-12)


def test_a_shuttle_that_its_preload_presses_on_a_rigid_stop_begins_with_that_force():
    result = cfmkit.analyze(vcfm({"gap": (0.0, 9e-3)}, preload=1e-3))
    free = cfmkit.analyze(vcfm({"gap": 9e-3}, preload=1e-3))
    assert free.curve.motion[0] < 0
    pressed = float(free.closed.effort("load", np.array([0.0]))[0])
    assert result.curve.motion[0] == 0.0
    assert result.curve.force[0] == pytest.approx(pressed, rel=1e-12)
    assert pressed > 1
    assert result.values["first_contact"].value == 0.0
    assert reported(result)["contact_begins"].startswith("at rest stop 'end' is pressed by 3.")


def test_a_shuttle_that_rests_on_an_elastic_stop_rests_where_all_forces_balance():
    result = cfmkit.analyze(vcfm({"gap": (0.0, 9e-3), "stiffness": RATE}, preload=1e-3))
    rest, free = result.curve.motion[0], cfmkit.analyze(vcfm({"gap": 9e-3}, preload=1e-3))
    push = float(free.closed.effort("load", np.array([rest]))[0])
    assert rest < 0
    assert push + RATE * rest == pytest.approx(0.0, abs=1e-9)
    assert result.curve.force[0] == pytest.approx(0.0, abs=1e-9)
    assert "end ends" in result.curve.extra["event"].values


def test_the_window_that_is_not_stated_ends_at_a_stop():
    low, high = cfmkit.analyze(
        vcfm({"gap": GAP - 1e-3, "stiffness": RATE}).replace({"analysis.window": None})
    ).state.window_of_one
    assert low < high == GAP - 1e-3


def test_parts_with_a_stop_are_the_same_in_a_study_as_alone():
    assert not list(family("vcfm").rows([vcfm({"gap": GAP})] * 2))  # left to their own analyses


@pytest.mark.parametrize(
    ("changes", "place", "says"),
    [
        ({"mechanism.stops": {"a b": {"gap": GAP}}}, "mechanism.stops", "a letter"),
        ({"mechanism.stops": {"a": {"gap": -GAP}}}, "mechanism.stops.a.gap", "must be >= 0"),
        ({"mechanism.stops": {"a": {"gap": "4 deg"}}}, "mechanism.stops.a.gap", "length"),
        ({"mechanism.stops": {"a": {"gap": GAP, "stiffness": 0.0}}}, "mechanism.stops.a.stiffness", "> 0"),
        ({"mechanism.stops": {"a": {"gap": GAP, "node": "tip"}}}, "mechanism.stops.a", "node"),
        (
            {
                "mechanism.stops": {"a": {"gap": GAP}},
                "requirements": [{"metric": "contact_force[b]", "max": "1 N"}],
            },
            "requirements.0.metric",
            "there are: a",
        ),
    ],
)
@pytest.mark.parametrize("name", ENDS)
def test_a_stop_that_cannot_be_is_refused_with_its_place(name, changes, place, says):
    with pytest.raises(SpecError) as caught:
        loaded(name, **changes)
    assert place in str(caught.value)
    assert says in str(caught.value)


def test_stops_of_rigid_links_and_solids_are_refused():
    with pytest.raises(SpecError, match=r"mechanism\.stops: stops are known of flexures and strips"):
        stopped("slider_crank_strip", {"gap": GAP}, **{"analysis.fidelity": "solid"})


def test_requirements_on_stress_count_with_the_stop_reached():
    """Leaves that a stop saves from the rest of the travel have the stress of its gap, not of the travel."""
    free = cfmkit.analyze(vcfm({"gap": 9e-3}))
    result = cfmkit.analyze(vcfm({"gap": GAP}))
    at_gap = float(free.closed.stress("load", np.array([GAP]))[0])
    assert result.values["travel_stress_max"].value < free.values["travel_stress_max"].value
    assert result.curve.extra["max_stress"].values[-1] == pytest.approx(at_gap, rel=1e-9)


@pytest.mark.parametrize("name", ["vcfm_ding2022", "vcfm_pla"])
def test_a_sweep_of_every_column_without_stops_is_solved_in_rows(name):
    """Metrics of contacts, which a mechanism without stops never has, had made every point a run of its own."""
    spec = cfmkit.load(CONFIGS / f"{name}.yaml").replace({"requirements": ()})
    path = "mechanism.bistable.thickness"
    plan = GivenPoints({path: float(spec.get_value(path)) * np.array([0.99, 1.0, 1.01])})
    every = metrics_of(spec, (), cfmkit.analyze(spec).curves[0])
    assert points_at_once(Study(spec, plan.paths, tuple(every)), plan) > 1
