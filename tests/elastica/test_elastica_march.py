"""Compiled equations beside those in numpy: the same gradients, Hessians, inertia and paths; numpy if not compiled."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import threading
import zipfile
from pathlib import Path
from typing import Any

import beam_networks
import numpy as np
import pytest
from buckling_structures import cantilever
from contact_layouts import with_pads
from network_cases import from_json, read_cases

import cfmkit.elastica as el
from cfmkit.elastica.contact.equations import ContactEquations, open_all_contacts
from cfmkit.elastica.contact.terms import gaps
from cfmkit.elastica.mechanics import energy
from cfmkit.elastica.mechanics.compiled import CompiledEquations
from cfmkit.elastica.mechanics.compiled_module import COUNT_FIELDS, WITHOUT_C_VARIABLE, load_compiled
from cfmkit.elastica.mechanics.designs import set_up
from cfmkit.elastica.mechanics.discretise import Discretisation, discretise
from cfmkit.elastica.mechanics.equations import COMPLEX_STEP, MarchCode, MarchPlan, NumpyEquations
from cfmkit.elastica.mechanics.march import engine, equations
from cfmkit.elastica.mechanics.plain_networks import arrange
from cfmkit.elastica.mechanics.problem import DEGREES_MORE
from cfmkit.elastica.model.beam_fits import is_plain
from cfmkit.elastica.results.path import load_displacement
from cfmkit.elastica.tracing.accuracy import (
    CORRECTION_ERROR,
    NEXT_CORRECTION,
    compare_states,
    pick_points,
    point_errors,
)
from cfmkit.elastica.tracing.trace import DegreeAndPieces, trace_on
from cfmkit.elastica.tracing.trace_many import CompiledBatch
from cfmkit.numerics.continuation import Border, PathBranch

ROOT = Path(__file__).parents[2]
needs_c = pytest.mark.skipif(load_compiled() is None, reason="the compiled module was not built")


def random_state(network: Discretisation, seed: int) -> Any:
    return 0.1 * np.random.default_rng(seed).standard_normal(network.size)


def difference(found: Any, right: Any) -> float:
    return float(np.abs(found - right).max() / np.abs(right).max())


def at_rest(own: NumpyEquations) -> Any:
    return own.solve(np.zeros(own.n), 0.0)


def assert_same_functional(network: Discretisation, z: Any) -> None:
    own = equations(network)
    assert isinstance(own, CompiledEquations)
    gradient, hessian = own.evaluate(z, 0.3, 0.7)
    assert difference(gradient, energy.gradient(network, z, 0.3, 0.7)) < 1e-12
    assert difference(hessian, energy.hessian(network, z, 0.3, 0.7)) < 1e-12


@needs_c
@pytest.mark.parametrize("seed", range(0, 50, 10))
def test_gradients_and_hessians_of_c_and_numpy_are_equal_on_200_random_networks(seed: int) -> None:
    for number in range(seed, seed + 10):
        net = beam_networks.network(number, follower=number % 2 == 0)
        for drive in beam_networks.drives(net, number):
            network = discretise(net, drive, 3 + number % 7)
            assert_same_functional(network, random_state(network, number))


@needs_c
def test_gradients_and_hessians_of_c_and_numpy_are_equal_on_the_shipped_configs() -> None:
    for case in read_cases():
        if case["name"].startswith("config: "):
            network = discretise(from_json(case["network"]), from_json(case["drive"]))
            assert_same_functional(network, random_state(network, 1))


@needs_c
@pytest.mark.parametrize("ramp", [False, True])
def test_stops_and_pads_of_c_and_numpy_are_equal_on_random_layouts(ramp: bool) -> None:
    """Open and closed as their forces say, which are of either sign here; by random numbers far from equilibrium."""
    for seed in range(40):
        network = discretise(*with_pads(seed), 6)
        compiled = equations(network, ramp)
        assert isinstance(compiled, CompiledEquations)
        right = ContactEquations(network, ramp, plain=equations(open_all_contacts(network), ramp))
        free = random_state(network, seed)[network.free]
        free[-len(network.contacts) :] *= 10
        in_c, in_numpy = compiled.linearise(free, 0.4), right.linearise(free, 0.4)
        assert in_c.residual == pytest.approx(in_numpy.residual, abs=1e-12 * np.abs(in_numpy.residual).max())
        assert in_c.tangent == pytest.approx(in_numpy.tangent, abs=1e-12 * np.abs(in_numpy.tangent).max())
        assert in_c.change == pytest.approx(in_numpy.change, abs=1e-12)
        z = compiled.values(free, 0.4)
        measured = [gaps(network, contact, z[None])[0] for contact in network.contacts]
        assert compiled.measure_nodes(z[None])[:, 0] == pytest.approx(measured, abs=1e-13)
        for mine, its in zip(compiled.evaluate(z, 0.3, 0.7), right.evaluate(z, 0.3, 0.7), strict=True):
            assert difference(mine, its) < 1e-12
        if np.linalg.cond(in_numpy.tangent) < 1e12:  # else two rigid floors press on one pad
            assert compiled.resolve(free, 0.4, np.ones((1, compiled.n)))[1] == right.count_unstable(in_numpy)


@needs_c
def test_a_path_with_stops_and_pads_of_c_is_that_of_numpy(monkeypatch: pytest.MonkeyPatch) -> None:
    fast = el.trace(*with_pads(0), el.Control(tolerance=1e-8))
    monkeypatch.setenv(WITHOUT_C_VARIABLE, "1")
    slow = el.trace(*with_pads(0), el.Control(tolerance=1e-8))
    events = [[(event.kind, event.number) for event in path.contact_events] for path in (fast, slow)]
    assert events[0] == events[1]
    drives = [[event.drive for event in path.contact_events] for path in (fast, slow)]
    assert drives[0] == pytest.approx(drives[1], rel=1e-10)
    assert len(drives[0]) == 4
    assert fast.motion("tip")[fast.at_requested] == pytest.approx(slow.motion("tip")[slow.at_requested], abs=1e-10)
    assert fast.contact_force(0)[fast.at_requested] == pytest.approx(slow.contact_force(0)[slow.at_requested], abs=1e-9)


@needs_c
@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("ramp", [False, True])
def test_linearised_equations_are_equal_and_exact(seed: int, ramp: bool) -> None:
    net = beam_networks.network(seed, follower=seed % 2 == 0)
    for drive in beam_networks.drives(net, seed):
        network = discretise(net, drive, 5)
        own, right = equations(network, ramp), NumpyEquations(network, ramp)
        free = random_state(network, seed)[network.free]
        found, known = own.linearise(free, 0.4), right.linearise(free, 0.4)
        for ours, theirs in zip(found, known, strict=True):
            assert difference(ours, theirs) < 1e-12
        stepped = right.gradient(free, 0.4 + 1j * COMPLEX_STEP)[network.free].imag / COMPLEX_STEP
        assert difference(found.change, stepped) < 1e-12


@needs_c
@pytest.mark.parametrize("seed", range(0, 24, 6))
def test_factors_count_what_dense_eigenvalues_count(seed: int) -> None:
    """At poses far from equilibrium, where up to some tens of directions are unstable."""
    counts = set()
    for number in range(seed, seed + 6):
        net = beam_networks.network(number, follower=False)
        for drive in beam_networks.drives(net, number)[:3]:
            network = discretise(net, drive, 6, pieces=1 + number % 3)
            own, free = equations(network), random_state(network, number)[network.free]
            free[np.isfinite(own.unit)] *= 2000  # section forces under which elements buckle
            right = np.random.default_rng(number).standard_normal((2, own.n))
            tangent = own.linearise(free, 0.2).tangent
            found, unstable = own.resolve(free, 0.2, right)
            negative = int((np.linalg.eigvalsh(tangent) < 0).sum())
            assert unstable == negative - 2 * len(network.elements.length)
            assert np.abs(found @ tangent - right).max() < 1e-9 * (1 + np.abs(found).max() * np.abs(tangent).max())
            counts.add(unstable)
    assert len(counts) > 2


def coil(turns: float, degree: int) -> Discretisation:
    beam = el.Beam("a", "b", el.Section(2e9, 1e-2, 1e-4), el.arc(2 * np.pi * turns))
    net = el.Network({"a": el.Node(0.0, 0.0, el.CLAMPED_SUPPORT), "b": el.Node(0.1, 0.0)}, {"coil": beam})
    return discretise(net, el.Rotation("b", np.array([1.0])), degree)


@needs_c
def test_a_coil_of_twenty_turns_is_factored_with_its_inertia() -> None:
    network = coil(20.25, 10)
    assert len(network.free) > 450
    own, free = equations(network), random_state(network, 2)[network.free]
    tangent = own.linearise(free, 0.5).tangent
    right = np.random.default_rng(1).standard_normal((1, own.n))
    found, unstable = own.resolve(free, 0.5, right)
    assert unstable == int((np.linalg.eigvalsh(tangent) < 0).sum()) - 2 * len(network.elements.length)
    assert np.abs(found @ tangent - right).max() < 1e-9 * np.abs(found).max() * np.abs(tangent).max()


@needs_c
def test_an_element_that_buckles_between_its_ends_waits_for_its_neighbours() -> None:
    """At the load at which the element alone is singular its unknowns cannot be eliminated first."""
    stiff = el.Section(2e9, 1e-2, 1e-3, axial=False)
    net = el.Network(
        {"a": el.Node(0, 0, el.CLAMPED_SUPPORT), "b": el.Node(0.1, 0.0, el.slider_support(0.0))},
        {"x": el.Beam("a", "b", stiff)},
    )
    rigidity = 2e9 * 1e-2 * 1e-9 / 12
    network = discretise(net, el.Loading((el.PointLoad("b", fx=-1.0),), np.array([1.0])), 8, pieces=4)
    alone = 4 * np.pi**2 * rigidity / 0.025**2
    for factor in (0.999999, 1.0, 1.000001):
        own = equations(network)
        state = own.solve(np.zeros(own.n), factor * alone)
        assert state is not None
        tangent = own.linearise(state.x, state.drive).tangent
        assert state.unstable == int((np.linalg.eigvalsh(tangent) < 0).sum()) - 2 * 4


def test_factors_under_following_loads_solve_and_count_real_eigenvalues() -> None:
    net = cantilever(el.Section(2e9, 1e-2, 1e-3))
    network = discretise(net, el.Loading((el.PointLoad("t", fx=-1.0, follows=True),), np.array([30.0])), 8, pieces=2)
    own = equations(network)
    free = 2 * random_state(network, 1)[network.free]
    tangent = own.linearise(free, 30.0).tangent
    assert np.abs(tangent - tangent.T).max() > 1e-3
    right = np.random.default_rng(1).standard_normal((2, own.n))
    found, unstable = own.resolve(free, 30.0, right)
    assert found @ tangent.T == pytest.approx(right, abs=1e-9)
    moves = np.flatnonzero(network.free < network.n_motions)
    forces = np.setdiff1d(np.arange(own.n), moves)
    ff = np.linalg.solve(tangent[np.ix_(forces, forces)], tangent[np.ix_(forces, moves)])
    stiffness = tangent[np.ix_(moves, moves)] - tangent[np.ix_(moves, forces)] @ ff
    eigenvalues = np.linalg.eigvals(stiffness)
    assert unstable == int((eigenvalues[np.abs(eigenvalues.imag) < 1e-9 * np.abs(eigenvalues)].real < 0).sum())


@needs_c
@pytest.mark.parametrize(("seed", "number"), [(1, 0), (3, 2), (4, 1), (5, 3)])
def test_marches_of_c_and_numpy_are_equal(seed: int, number: int) -> None:
    """Constant loads first, then the drive; the last one with a load that follows."""
    net = beam_networks.network(seed, follower=False)
    network = discretise(net, beam_networks.drives(net, seed)[number], 6)
    ends = []
    for kind in (equations, NumpyEquations):
        ramp, own = kind(network, True), kind(network)
        loaded = ramp.march(at_rest(ramp), np.array([1.0]), MarchPlan(0.5, 1.0)).states[-1]
        start, goals = own.solve(loaded.x, 0.0), beam_networks.drives(net, seed)[number].points / network.scales.drive
        ends.append(own.march(start, goals, MarchPlan(0.3 * abs(goals[0]), abs(goals[-1]), branch=PathBranch(0.0, 1))))
    one, other = ends
    assert one.code is other.code is MarchCode.DONE
    assert len(one.states) == len(other.states)
    assert one.step == pytest.approx(other.step)
    assert (one.target == other.target).all()
    for mine, its in zip(one.states, other.states, strict=True):
        assert mine.unstable == its.unstable
        assert mine.x == pytest.approx(its.x, rel=1e-8, abs=1e-8)
        assert mine.effort == pytest.approx(its.effort, rel=1e-8, abs=1e-6)


@needs_c
@pytest.mark.parametrize(("seed", "number"), [(1, 0), (4, 1)])
def test_several_solutions_and_softest_modes_of_c_and_numpy_are_equal(seed: int, number: int) -> None:
    net = beam_networks.network(seed, follower=False)
    network = discretise(net, beam_networks.drives(net, seed)[number], 6)
    c, reference = equations(network), NumpyEquations(network)
    start = at_rest(c)
    ways = start.drive + np.array([1e-3, 3e-3, 50.0]) * np.sign(beam_networks.drives(net, seed)[number].points[-1])
    found = [own.solve_each(np.tile(start.x, (3, 1)), ways) for own in (c, reference)]
    assert (found[0].converged == found[1].converged).all()
    good = found[1].converged
    assert good[:2].all()
    for name in ("free", "rate", "effort"):
        mine, its = (getattr(each, name)[good] for each in found)
        np.testing.assert_allclose(mine, its, rtol=0, atol=1e-7 * np.abs(its).max())
    assert (found[0].unstable == found[1].unstable)[good].all()
    vector = np.cos(np.arange(c.n) ** 1.5)
    flexibilities, modes = zip(
        *(own.find_softest(start.x, start.drive, vector, 4) for own in (c, reference)), strict=True
    )
    assert flexibilities[0] == pytest.approx(flexibilities[1], rel=1e-8)
    assert modes[0] == pytest.approx(modes[1], abs=1e-7 * np.abs(modes[1]).max())


@pytest.mark.parametrize("kind", [equations, NumpyEquations])
def test_a_border_holds_what_it_names_in_place_of_the_drive(kind: Any) -> None:
    net = cantilever(el.Section(2e9, 1e-2, 1e-3))
    own = kind(discretise(net, el.Loading((el.PointLoad("t", fy=1.0),), np.array([1.0])), 8))
    border = np.zeros(own.n + 1)
    border[np.flatnonzero(own.mesh.free == own.mesh.bodies["t"][2])] = 1.0
    state = own.solve(np.zeros(own.n), 0.0, Border(border, 0.8))
    assert state.x @ border[:-1] == pytest.approx(0.8, rel=1e-9)
    again = own.solve(state.x, state.drive)
    assert again.x == pytest.approx(state.x, rel=1e-8, abs=1e-8)


@pytest.mark.parametrize("kind", [equations, NumpyEquations])
def test_a_march_stops_before_a_step_that_is_less_stable(kind: Any) -> None:
    net = el.Network(
        {"a": el.Node(0, 0, el.CLAMPED_SUPPORT), "b": el.Node(0.1, 0, el.slider_support(0.0))},
        {"x": el.Beam("a", "b", el.Section(2e9, 1e-2, 1e-3))},
    )
    critical = 4 * np.pi**2 * 1e-6 / 12 / 0.1  # shortening of a column, both ends clamped, axial strain (t/L)^2 pi^2/3
    own = kind(discretise(net, el.Displacement("b", np.pi, np.array([1.2 * critical])), 8))
    march = own.march(at_rest(own), np.array([1.2 * critical]) / 0.1, MarchPlan(0.01 * critical / 0.1, critical / 0.1))
    assert march.code is MarchCode.STABILITY_CHANGES
    assert 0.5 * critical < march.states[-1].drive * 0.1 < critical


TARGETS = np.linspace(0, 5e-3, 11)[1:]


def leaf(thickness: float) -> tuple[el.Network, el.Displacement]:
    nodes = {"a": el.Node(0, 0, el.CLAMPED_SUPPORT), "b": el.Node(0.08, 0.03, el.slider_support(0.0, rotates=False))}
    section, shape = el.Section(2e9, 1e-2, thickness), el.Polynomial((0.0, 1.0, -0.8))
    return el.Network(nodes, {"x": el.Beam("a", "b", section, shape)}), el.Displacement("b", np.pi, TARGETS)


def leaves(count: int, degree: int = 8) -> CompiledBatch:
    pairs = [leaf(thickness) for thickness in np.linspace(0.5e-3, 1e-3, count)]
    return CompiledBatch(set_up(discretise(*pairs[0], degree), pairs[0], pairs))


@needs_c
def test_a_batch_has_the_efforts_of_single_marches() -> None:
    efforts, codes, _ = leaves(4).march(TARGETS)
    assert (codes == MarchCode.DONE).all()
    for thickness, row in zip(np.linspace(0.5e-3, 1e-3, 4), efforts, strict=True):
        own = NumpyEquations(discretise(*leaf(thickness), 8))
        goals = TARGETS / own.mesh.scales.drive
        march = own.march(at_rest(own), goals, MarchPlan(0.05 * goals[-1], goals[-1], tolerance=1e-9))
        known = march.effort[march.target >= 0] * own.effort_unit
        assert row == pytest.approx(known, rel=1e-7)


@needs_c
def test_states_of_a_batch_lead_to_those_of_a_higher_degree() -> None:
    """Efforts of designs from states of a lower degree are those of a march with the higher one."""
    batch, chosen = leaves(2), [3, 9]
    _, _, states = batch.march(TARGETS, chosen=chosen)
    finer = batch.compare(states, TARGETS[chosen], 12, 1e-12)
    assert finer.converged.all()
    right = leaves(2, 12).march(TARGETS)[0][:, chosen]
    assert finer.effort * batch.effort_unit == pytest.approx(right, rel=1e-9)
    assert not batch.compare(states + 1e3, TARGETS[chosen], 12, 1e-12).converged.any()


@needs_c
def test_states_are_compared_with_a_higher_degree_in_c_as_in_numpy() -> None:
    """Of networks of plain beams, under drives by motions and by loads: the efforts of these C does not know."""
    compared = 0
    for case in list(read_cases())[::4]:
        net, drive = (from_json(case[part]) for part in ("network", "drive"))
        if net.contacts or not all(is_plain(beam) for beam in net.beams.values()):
            continue
        path = el.trace(net, drive, el.Control(tolerance=1e-3, most_points=60))
        mesh, z, drives = path.mesh, path.at.z[1::3], path.at.drive[1::3]
        own = equations(mesh)
        fast = own.compare(z, drives, mesh.degree + DEGREES_MORE, NEXT_CORRECTION)
        if fast is None or not len(z):
            continue
        slow, compared = compare_states(path, z, drives), compared + 1
        assert (fast.converged == slow.converged).all()
        assert fast.is_as_stable(slow.unstable)[slow.converged].all()
        pairs = [(fast.largest.max(), slow.largest[0]), (fast.force / slow.largest, slow.force / slow.largest)]
        pairs += [
            (fast.moved[slow.converged], slow.moved[slow.converged]),
            (fast.motion, slow.motion),
            (fast.ends, slow.ends),
        ]
        pairs += [(fast.effort * own.effort_unit, slow.effort)] if mesh.rate.any() else []
        # beside its bifurcation this column moves by 3e-10 for a rounding of its arrays
        limit = 1e-9 if case["name"] == "column 3e-05 m thick, clamped" else 1e-10
        for mine, its in pairs:
            assert mine == pytest.approx(its, abs=limit * max(np.abs(its).max(), 1.0)), case["name"]
    assert compared > 12


@needs_c
def test_arrays_that_c_fills_for_plain_networks_are_those_of_numpy() -> None:
    filled = with_terms = linked = 0
    for case in read_cases():
        net, drive = (from_json(case[part]) for part in ("network", "drive"))
        right = discretise(net, drive, 8)
        mesh = arrange(net, drive, 8)
        found, known = equations(mesh), equations(right)
        if "laws" not in getattr(found, "arrays", {}):
            continue
        assert (mesh.free == right.free).all()
        assert mesh.scales == pytest.approx(right.scales, rel=1e-14)
        for name, array in known.arrays.items():
            assert found.arrays[name] == pytest.approx(array, rel=1e-12, abs=1e-14), (case["name"], name)
        counts = slice(len(COUNT_FIELDS))
        assert (found.row[counts] == known.row[counts]).all()
        assert ((found.row == 0) == (known.row == 0)).all()
        filled, with_terms, linked = filled + 1, with_terms + bool(mesh.acting), linked + bool(net.links)
    assert (filled > 100, with_terms > 20, linked > 2) == (True, True, True)


@needs_c
def test_errors_and_works_of_loads_that_c_finds_are_those_of_numpy(monkeypatch: pytest.MonkeyPatch) -> None:
    known = loaded = 0
    for case in list(read_cases())[::5]:
        net, drive = (from_json(case[part]) for part in ("network", "drive"))
        if net.contacts:
            continue
        attempt = trace_on(net, drive, el.Control(tolerance=1e-7, most_points=60), DegreeAndPieces(7))
        path = attempt.path
        if np.isfinite(path.error):
            least = CORRECTION_ERROR * attempt.start.problem.next_correction
            right = max(point_errors(path, pick_points(path, ())).max(), least)
            assert path.error == pytest.approx(right, rel=1e-6, abs=1e-12), case["name"]
            known += right > least
        if isinstance(drive, el.Loading) and len(path):
            with monkeypatch.context() as context:
                context.setenv(WITHOUT_C_VARIABLE, "1")
                right = load_displacement(path.at, drive)
            assert load_displacement(path.at, drive) == pytest.approx(right, rel=1e-12, abs=1e-15), case["name"]
            loaded += 1
    assert known > 5
    assert loaded > 10


@needs_c
def test_several_threads_march_at_once() -> None:
    batch, found = leaves(8), {}
    threads = [threading.Thread(target=lambda k=k: found.update({k: batch.march(TARGETS)[0]})) for k in (0, 1)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    together = batch.march(TARGETS)[0]
    assert (found[0] == together).all()
    assert (found[1] == together).all()


def test_numpy_takes_over_without_the_compiled_module(monkeypatch: pytest.MonkeyPatch) -> None:
    with_what_there_is = el.trace(*leaf(1e-3))
    monkeypatch.setenv(WITHOUT_C_VARIABLE, "1")
    assert engine() == "numpy"
    assert type(equations(discretise(*leaf(1e-3), 8))) is NumpyEquations
    path = el.trace(*leaf(1e-3))
    assert path.effort == pytest.approx(with_what_there_is.effort, rel=1e-9)
    assert path.error == pytest.approx(with_what_there_is.error, rel=1e-3)


@pytest.mark.slow
def test_a_wheel_is_built_without_a_compiler_and_runs_on_numpy(tmp_path: Path) -> None:
    tree, wheels, installed = tmp_path / "tree", tmp_path / "wheels", tmp_path / "installed"
    left_out = shutil.ignore_patterns(".git", ".venv*", "build", "*.so", "*.egg-info", "benchmarks", "tests", "made")
    shutil.copytree(ROOT, tree, ignore=left_out)
    command = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "-w", wheels, tree]
    subprocess.run(command, check=True, env={**os.environ, "CC": "false"}, capture_output=True)
    (wheel,) = wheels.glob("*.whl")
    assert wheel.name.endswith("py3-none-any.whl")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(installed)
    said = "from cfmkit.elastica.mechanics.march import engine; print(engine())"
    environment = {**os.environ, "PYTHONPATH": str(installed)}
    done = subprocess.run(
        [sys.executable, "-c", said], cwd=tmp_path, env=environment, capture_output=True, text=True, check=True
    )
    assert done.stdout.split() == ["numpy"]
