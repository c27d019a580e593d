"""Shape design and studies of beam mechanisms that touch: the force on a workpiece, stops that stay."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from beam_support import CONFIGS

import cfmkit
from cfmkit.elastica import Control, Displacement, gradient, trace
from cfmkit.errors import InputError, SpecError
from cfmkit.families.beam import model
from cfmkit.families.beam.force_at_few_poses import replace_values
from cfmkit.families.beam.network_from_spec import assemble
from cfmkit.families.beam.shaping.design import task_of
from cfmkit.families.beam.shaping.report import judge_design
from cfmkit.families.beam.shaping.response import respond
from cfmkit.families.beam.shaping.search import ShapeCandidate, StartBudget, evaluate_in_model, flatten
from cfmkit.families.beam.shaping.sqp_program import Flattest, Shaping
from cfmkit.families.beam.shaping.task_and_variables import TaskLimits, Variables

CLOSE = Control(tolerance=1e-10)
OPTIMISE = {
    "contact": "work",
    "window": (9e-3, 14e-3),
    "objective": "ripple",
    "free": {"tip": {"x": (8e-3, 16e-3)}},
    "orders": (1,),
    "limits": {"max_length_ratio": 2.0},
    "starts": 1,
    "drawn": 3,
    "tolerances": {"samples": 2},
}


def gripper(**changes):
    """Return the finger of the example, as a design of its force on the workpiece."""
    spec = cfmkit.load(CONFIGS / "beam_gripper.yaml")
    return spec.replace({"design": {"optimise": OPTIMISE | changes}, "analysis.points": 15})


def leaf_at_a_stop():
    """Return the leaf of the example, moved by 20 mm into its bumper."""
    spec = cfmkit.load(CONFIGS / "beam_stop.yaml")
    drive = {"kind": "displacement", "node": "tip", "direction": "-90 deg"}
    return spec.replace({"mechanism.drive": drive, "analysis": {"travel": "20 mm"}, "requirements": []})


@pytest.mark.parametrize(
    ("spec", "names"),
    [
        (gripper(), ("mechanism.nodes.tip.at.0", "mechanism.nodes.tip.at.1", "mechanism.beams.finger.shape.sweep")),
        (leaf_at_a_stop(), ("mechanism.nodes.mid.at.1", "mechanism.thickness", "mechanism.stops.bumper.gap")),
    ],
)
def test_forces_with_closed_contacts_have_the_derivatives_of_differences(spec, names):
    assembly, x = assemble(spec), np.array([spec.get_value(name) for name in names])
    drive = Displacement(assembly.driven, assembly.direction, np.linspace(0.0, spec.extent, 4))

    def build(values):
        return assemble(replace_values(spec, dict(zip(names, values, strict=True)))).network

    def forces(values):
        path = trace(build(values), drive, CLOSE)
        return np.array([path.effort, path.contact_force(0)])[:, path.at_requested]

    path = trace(assembly.network, drive, CLOSE)
    slopes = gradient(path, build, x)
    assert path.contact_force(0)[path.at_requested][-1] > 0.5
    for k in range(len(x)):
        step = np.where(np.arange(len(x)) == k, 1e-6 * max(abs(x[k]), 1e-2), 0.0)
        differences = (forces(x + step) - forces(x - step)) / (2 * step[k])
        for found, expected in zip((slopes.effort, slopes.contact_force(0)), differences, strict=True):
            assert found[:, k] == pytest.approx(expected, abs=1e-7 * np.abs(expected).max())


def test_derivatives_are_refused_where_sides_touch():
    spec = gripper().replace(
        {"design": None, "mechanism.obstacles.work": {"kind": "disc", "centre": (14e-3, -16e-3), "radius": 10e-3}}
    )
    assembly = assemble(spec)
    path = trace(assembly.network, Displacement(assembly.driven, assembly.direction, np.array([0.0, 1e-3])), CLOSE)
    with pytest.raises(InputError, match="sides of beams touch"):
        gradient(path, lambda _: assembly.network, np.zeros(1))


def test_the_goal_and_the_limits_of_a_force_on_a_workpiece_have_the_derivatives_of_differences():
    spec = gripper()
    task = replace(task_of(spec, spec.design.optimise), limits=TaskLimits(stress=60e6, force_target=1.0))
    program = Shaping(Variables(task, 1), 9e-3, Flattest())
    z = program.begin(np.array([12e-3 / task.size, 1.2]))
    seen = program.evaluate(z, sloped=True)
    for k in range(2):
        step = np.where(np.arange(len(z)) == k, 1e-6, 0.0)
        ahead, behind = (program.evaluate(z + sign * step, sloped=False) for sign in (1.0, -1.0))
        for rows, after, before in zip(seen.rows, ahead.rows, behind.rows, strict=True):
            change = (after.values - before.values) / 2e-6
            assert rows.slopes[:, k] == pytest.approx(change, rel=1e-3, abs=1e-3 * np.abs(change).max())


def test_the_force_that_a_design_sees_is_the_column_of_the_contact():
    spec = gripper()
    task = task_of(spec, spec.design.optimise)
    found = ShapeCandidate(np.array([12e-3 / task.size, 1.2]), 1, 9e-3, 0.2, 0.0, "", 0)
    judged = judge_design(spec, task, found)
    result = cfmkit.analyze(judged.spec)
    column = result.curve.extra["work_tip_force"].values[result.curve.displacement >= 9e-3 - 1e-12]
    ripple = result.values["contact_force_ripple[work]"].value
    assert judged.half_band == pytest.approx(ripple / (2 - ripple), rel=1e-9)
    assert column.max() - column.min() <= ripple * column.max() * (1 + 1e-9)
    poses = np.array([0.0, 9e-3, 14e-3])
    force = respond(Variables(task, 1), found.x, poses).force
    assert force[1:] == pytest.approx(column[[0, -1]], rel=1e-3)
    assert judged.spec.mechanism.obstacles == spec.mechanism.obstacles


def test_a_pad_inside_an_obstacle_at_rest_is_no_design():
    spec = gripper().replace({"mechanism.obstacles.work.centre": (14e-3, -12.1e-3)})
    task = task_of(spec, spec.design.optimise)
    nodes = dict(task.network.nodes)
    nodes["tip"] = replace(nodes["tip"], y=-1e-3)
    lower = replace(task, network=replace(task.network, nodes=nodes))
    x, poses = np.array([14e-3 / task.size, 1.2]), np.array([0.0, 1e-3])
    assert respond(Variables(task, 1), x, poses) is not None
    assert respond(Variables(lower, 1), x, poses) is None


@pytest.mark.slow
def test_a_few_steps_make_the_force_on_a_workpiece_flatter_and_keep_its_mean():
    spec = gripper(force={"target": 1.0, "tolerance": 0.02})
    task = task_of(spec, spec.design.optimise)
    before = evaluate_in_model(task, ShapeCandidate(np.array([12e-3 / task.size, 1.2]), 1, 9e-3, 1.0, 0.0, "", 0))
    after = flatten(task, before, StartBudget(flattening=8))
    judged = judge_design(spec, task, after)
    assert after.feasible
    assert judged.half_band < before.objective - 0.003
    assert judged.half_band == pytest.approx(after.objective, abs=1e-4)
    mean = cfmkit.analyze(judged.spec).values["contact_force[work]"].value
    assert mean == pytest.approx(1.0, abs=0.021)


def test_mechanisms_with_contacts_are_not_solved_twice_in_a_study(monkeypatch):
    monkeypatch.setattr(model, "solve", lambda spec: pytest.fail("its own analysis solves it"))
    assert not list(model.solve_rows([gripper(), leaf_at_a_stop()]))


def test_a_stop_of_a_rotation_beside_the_contact_is_no_reason_to_refuse_a_search():
    stop = {"lock": {"node": "tip", "rotation": True, "gap": "10 deg"}}
    assert "lock" in gripper().replace({"mechanism.stops": stop}).mechanism.stops


@pytest.mark.parametrize(
    ("changes", "place", "says"),
    [
        ({"design.optimise.contact": "wrok"}, "design.optimise.contact", "there are: work"),
        (
            {
                "design.optimise.contact": "lock",
                "mechanism.stops": {"lock": {"node": "tip", "rotation": True, "gap": "10 deg"}},
            },
            "design.optimise.contact",
            "its force is a moment",
        ),
        (
            {"mechanism.obstacles.work": {"kind": "disc", "centre": (14e-3, -16e-3), "radius": 10e-3}},
            "design.optimise",
            "state 'nodes' alone of 'obstacles.work'",
        ),
        ({"design.target": {"stiffness": "1 N/mm", "start": "1 N"}}, "design", "remove it, or 'optimise.contact'"),
    ],
)
def test_what_cannot_be_designed_is_refused_with_its_place(changes, place, says):
    with pytest.raises(SpecError) as caught:
        gripper().replace(changes)
    assert place in str(caught.value)
    assert says in str(caught.value)
