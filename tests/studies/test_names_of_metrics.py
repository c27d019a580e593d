"""Names of metrics in studies: those of forces are accepted on a torque curve, branches are those of the family."""

from __future__ import annotations

import numpy as np
import pytest
from study_rows import run_point

import cfmkit
from cfmkit.errors import SpecError, UsageError
from cfmkit.families import family
from cfmkit.metrics import definitions, values_of_family
from cfmkit.studies.engine import run
from cfmkit.studies.point_evaluation import metrics_of, sample_curve
from cfmkit.studies.sensitivity.setup import prepare as prepare_sensitivity
from cfmkit.studies.summary_and_tables import Summary, main_columns
from cfmkit.studies.sweep_request_and_files import SweepRequest, prepare
from cfmkit.studies.variations import parse_variation

TORQUE = cfmkit.load("configs/slider_crank_li2019.yaml")


CAM = cfmkit.load("configs/cam.yaml").replace({"analysis.points": 41})


STIFFNESS = "mechanism.springs.slider"


def with_requirements(*entries):
    return TORQUE.replace({"requirements": entries})


def test_a_sweep_over_torques_notes_either_name_in_the_same_bytes():
    from cfmkit.studies.summary_and_tables import results_csv

    options = parse_variation(f"{STIFFNESS}=[1 N/cm, 1.1 N/cm]")
    written = []
    for name in ("force_ripple", "torque_ripple"):
        work = prepare(TORQUE, SweepRequest(vary=(options,), metrics=(name, "torque_mean")))
        written.append(b"".join(results_csv(run(work))))
    assert written[0].replace(b"force_ripple", b"torque_ripple") == written[1]
    assert b"torque_mean [N*mm]" in written[0]


def test_the_best_point_follows_a_requirement_under_its_other_name():
    spec = with_requirements({"metric": "force_max", "max": "1 N*m"})
    work = prepare(spec, SweepRequest(vary=(parse_variation(f"{STIFFNESS}=[1.1 N/cm, 1 N/cm]"),)))
    names = work.study.names
    found = Summary(work.study, main_columns(work.study, ()))
    for indices, rows in run(work).batches():
        found.add(indices, rows)
    assert names[found.shown[0]] == "torque_max"
    assert found.best == 1
    assert "torque_mean" in names
    assert "force_mean" not in names


def test_a_sensitivity_over_torques_takes_requirements_and_their_windows_in_degrees():
    spec = with_requirements({"metric": "force_max", "max": "1 N*m", "over": ("1 deg", "10 deg")})
    block = {"method": "oat", "parameters": {STIFFNESS: ("1 N/cm", "1.1 N/cm")}}
    setup = prepare_sensitivity(spec.replace({"sensitivity": block}))
    (metric,) = setup.study.metrics
    assert (metric.label, metric.dimension) == ("force_max over 1 ... 10 deg", "torque")
    assert np.isfinite(setup.nominal.values).all()


def test_a_branch_that_a_family_cannot_have_is_refused_with_those_it_has(tmp_path):
    assert set(cfmkit.analyze(CAM).curve.branches) == set(family("cam").outputs.branches)
    reported = "there is no branch 'lod'; there are 'load', 'unload'"
    with pytest.raises(UsageError, match=reported):
        metrics_of(CAM, ["force_ripple[lod]"])
    text = cfmkit.dumps(CAM).replace("metric: force_ripple", 'metric: "force_ripple[lod]"')
    assert "[lod]" in text
    with pytest.raises(SpecError, match=reported):
        cfmkit.loads(text)


def test_default_columns_of_a_torque_are_torques():
    work = prepare(TORQUE, SweepRequest(vary=(parse_variation(f"{STIFFNESS}=[1 N/cm, 1.1 N/cm]"),)))
    sample = sample_curve(TORQUE, work.plan, False)
    assert sample.kind == "torque"
    own = values_of_family(family("slider-crank").outputs.values)
    assert {*work.study.names} <= {item.name for item in definitions("torque", own)}


@pytest.mark.parametrize("names", [("torque_mean", "half_band"), ("force_mean", "half_band")])
def test_a_block_of_torques_takes_either_name_and_bounds_of_a_torque(names):
    spec = with_requirements({"metric": "force_max", "max": "150 N*mm"})
    work = prepare(spec, SweepRequest(vary=(parse_variation(f"{STIFFNESS}=1 N/cm:20 N/cm:9"),), metrics=names))
    assert work.vectorised
    (rows,) = [rows for _, rows in run(work).batches()]
    alone = [run_point(work.study, work.plan, k) for k in range(9)]
    assert np.allclose(rows.values, [one.values for one in alone], rtol=1e-9)
    assert rows.met.tolist() == [list(one.met) for one in alone]
