"""Where paths end and what they keep: limit points, taut beams, toggles that snap, branches, batches."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from buckling_structures import DOWN, STIFF_STRIP, STRIP, UP, arch, cantilever, half_arch, leaves, load, press, toggle

import cfmkit.elastica as el
from cfmkit.elastica.results.between_points import interpolate_path
from cfmkit.errors import InputError


def test_an_arch_that_snaps_under_its_load_has_the_extremes_of_the_force_at_given_travel() -> None:
    control = el.Control(branch="primary", through_folds=True)
    path = el.trace(arch(), load("t", np.linspace(0.05, 2.0, 40)), control)
    effort = el.trace(arch(), press("t", np.linspace(9e-4, 0.036, 118)), el.Control(branch="primary")).effort
    top, low = path.events[1].drive, path.events[3].drive
    assert effort.max() == pytest.approx(top, rel=3e-3)
    assert effort.max() <= top * (1 + 1e-9)
    assert effort.min() >= low - 1e-9 * top
    assert effort.min() == pytest.approx(low, abs=3e-3 * top)


@pytest.mark.parametrize("tolerance", [1e-3, 1e-5, 1e-7])
def test_a_toggle_snaps_and_snaps_back_at_the_limit_points_of_its_force(tolerance: float) -> None:
    """Bars of different length: driven by its travel the toggle has no bifurcation, only a force that falls."""
    bars = toggle(0.012, shift=1e-3)
    force = el.trace(bars, press("t", np.linspace(0, 0.02, 801)[1:]), el.Control(tolerance=1e-7)).effort
    first = int((np.diff(force) < 0).argmax())
    top, low = force[first], force[first:].min()
    control = el.Control(tolerance=tolerance, through_folds=True)
    path = el.trace(bars, load("t", [0.4, 0.8, 1.5, 0.8, 0.4, 0]), control)
    assert path.status is el.PathStatus.COMPLETE, path.message
    assert [(e.kind, e.before, e.after) for e in path.events] == [("limit point", 0, 1), ("limit point", 1, 0)] * 2
    np.testing.assert_allclose([event.drive for event in path.events], [top, low, low, top], atol=3e-5)
    assert path.requested[path.at_requested].tolist() == [0, 0, 0, 1, 2, 3, 4, 4, 4, 5]
    np.testing.assert_allclose(path.motion("t")[-1], 0, atol=1e-8)


def test_a_turn_beyond_its_limit_point_ends_there() -> None:
    """The end of a pinned arc is turned until the arc snaps; by arc length the limit point is passed."""
    nodes = {"a": el.Node(0, 0, el.PINNED_SUPPORT), "b": el.Node(0.1, 0, el.PINNED_SUPPORT)}
    bow, turned = (
        el.Network(nodes, {"x": el.Beam("a", "b", STRIP, el.arc(1.5))}),
        el.Rotation("a", np.linspace(0.1, 3, 30)),
    )
    path = el.trace(bow, turned)
    passed = el.trace(bow, turned, el.Control(through_folds=True, most_points=60))
    assert path.status is el.PathStatus.LIMIT_POINT
    assert f"{path.drive[-1]:.6g}" in path.message
    assert passed.events[0].kind == "limit point"
    assert path.drive[-1] == pytest.approx(passed.events[0].drive, rel=1e-5)


def test_an_inextensible_arc_is_pulled_until_it_is_taut() -> None:
    pulled = el.Displacement("t", 0.0, np.linspace(1e-4, 2e-3, 20))
    path = el.trace(cantilever(STIFF_STRIP, el.arc(0.5)), pulled, el.Control(tolerance=1e-3))
    straight = 0.1 * (0.25 / np.sin(0.25) - 1)
    assert path.status is not el.PathStatus.COMPLETE
    assert path.drive[-1] < path.fits["x"].length - 0.1 == pytest.approx(straight)
    assert path.drive[-1] == pytest.approx(straight, rel=0.1)


@pytest.mark.parametrize("workers", [1, 2])
def test_a_batch_keeps_what_each_path_reached_and_why_it_ended(workers: int) -> None:
    """Among them a network that cannot exist and one with a place that is not a number."""
    strip, push = cantilever(), load("t", np.linspace(0.05, 2.0, 40))
    nowhere = replace(strip, nodes={**strip.nodes, "t": el.Node(float("nan"), 0.0)})
    networks = [strip, arch(), cantilever(shape=el.arc(2 * np.pi)), nowhere, strip]
    outcomes: Any = list(el.trace_many(networks, push, workers=workers))
    assert [outcome.status for outcome in outcomes] == ["COMPLETE", "JUMPS", "INVALID", "INVALID", "COMPLETE"]
    assert "returns to its start" in outcomes[2].message
    assert outcomes[2].value is None
    alone = el.trace(arch(), push)
    assert outcomes[1].message == alone.message
    np.testing.assert_array_equal(outcomes[1].value.effort, alone.effort[alone.at_requested])
    np.testing.assert_array_equal(outcomes[0].value.effort, outcomes[4].value.effort)
    assert len(outcomes[0].value.drive) == 40


def test_a_path_keeps_no_more_memory_than_its_points_take() -> None:
    path = el.trace(half_arch(2e-3, 5e-4), press("t", [2e-4]))
    parts = path.at.z, path.at.drive, path.unstable, path.requested
    assert all(part.base is None or part.base.nbytes == part.nbytes for part in parts)


def test_a_drive_that_stands_still_is_refused() -> None:
    with pytest.raises(InputError, match="must differ from one to the next"):
        press("d", [1e-3, 1e-3, 2e-3])


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("last", [True, False])
def test_a_path_may_end_or_begin_at_its_bifurcation(last: bool) -> None:
    """There is no point beyond it: the index of one was an internal error, or wrapped around to the other end."""
    points = np.linspace(0, 1.9 * 35e-3 * np.sin(np.radians(7)), 21)[1:]
    path = el.trace(leaves(thickness=1e-3, angle=7.0), press("d", points))
    whole = interpolate_path(path)
    assert whole is not None
    place = float(whole.corners[0])
    there, left = whole.solve_at(np.array([place])), int(np.searchsorted(path.drive, place))
    kept = slice(0, left) if last else slice(left, None)
    part = path.take(kept)
    corner = replace(there, branch=path.branch[left : left + 1] if last else path.branch[left - 1 : left])
    law = interpolate_path(part.append(corner) if last else corner.append(part))
    assert law is not None
    assert law.corners[-1 if last else 0] == pytest.approx(place)
    near = place + (-1e-4 if last else 1e-4) * np.arange(6.0)
    assert law.places[-1 if last else 0] == pytest.approx(place, rel=1e-14)
    np.testing.assert_allclose(law.effort("", near), whole.effort("", near), rtol=1e-7)
    np.testing.assert_allclose(law.stress("", near), whole.stress("", near), rtol=1e-3)


@pytest.mark.parametrize(("bifurcation", "offset"), [(0, -1e-10), (0, -1e-11), (1, 1e-10)])
def test_a_point_a_hair_beside_a_bifurcation_spoils_nothing_around_it(bifurcation: int, offset: float) -> None:
    """Newton's method leaves more of the critical mode there than the path moves up to the corner."""
    points = np.linspace(0, 1.9 * 35e-3 * np.sin(np.radians(7)), 21)[1:]
    path = el.trace(leaves(thickness=1e-3, angle=7.0), press("d", points))
    corner = path.events[bifurcation].drive
    beside = el.trace(leaves(thickness=1e-3, angle=7.0), press("d", np.sort([*points, corner + offset])))
    law, expected = interpolate_path(beside), interpolate_path(path)
    assert law is not None
    assert expected is not None
    np.testing.assert_allclose(law.corners, expected.corners, rtol=1e-6)
    near = corner + np.array([-1e-5, -1e-6, 1e-6, 1e-5])
    np.testing.assert_allclose(law.effort("", near), expected.effort("", near), rtol=1e-9)
    largest_stress = expected.solve_at(near).beam_stresses()[0].max(axis=0)
    np.testing.assert_allclose(law.stress("", near), largest_stress, rtol=0.01)


@pytest.mark.parametrize(("many", "factor"), [(2, 1.0), (5, 1 + 1e-6), (3, 1 + 1e-3)])
def test_columns_under_one_platform_bear_its_load_together(many: int, factor: float) -> None:
    """Under a load as under a displacement; were one to buckle alone the others would bear more than they can."""

    def columns(count: int) -> el.Path:
        nodes, beams = {"d": el.Node(0, 0.1, el.slider_support(UP))}, {}
        for i in range(count):
            x = 0.02 * (i - 0.5 * (count - 1))
            nodes[f"w{i}"] = el.Node(x, 0, el.CLAMPED_SUPPORT)
            section = el.Section(2e9, 1e-2, 1e-3 * (factor if i else 1.0))
            beams[f"b{i}"] = el.Beam(f"w{i}", "d", section, end_offset=(x, 0.0))
        drive = load("d", np.linspace(0.1, 1.3, 13), fy=-count * critical)
        return el.trace(el.Network(nodes, beams), drive, el.Control(tolerance=1e-5))

    critical = 4 * np.pi**2 * 2e9 * (1e-2 * 1e-9 / 12) / 0.1**2
    alone, path = columns(1), columns(many)
    assert path.status is el.PathStatus.COMPLETE, path.message
    assert path.stable.all()
    assert {event.kind for event in path.events} == {"bifurcation"}
    assert all(event.before == 0 for event in path.events)  # one that differs buckles before the others, or after them
    assert sum(event.after for event in path.events) == many
    assert path.events[0].drive == pytest.approx(alone.events[0].drive, rel=1e-6 + 3 * (factor - 1))
    assert all(path.end_force(name, 1)[path.at_requested[-1], 2] < 0 for name in path.network.beams)
    expected = many * alone.effort[alone.at_requested]
    np.testing.assert_allclose(path.effort[path.at_requested][-2:], expected[-2:], rtol=1e-4 + 30 * (factor - 1))


@pytest.mark.parametrize("sign", [1, -1])
def test_a_tiny_change_does_not_change_the_side_of_a_branch(sign: Any) -> None:
    """The network decides between two branches that mirror each other, not rounding; the other sign is the other."""
    section = el.Section(1.477e9, 3.6e-3, 1.00998e-3, shear=True, poisson_ratio=0.3)
    points = 4.743e-3 * np.arange(1, 128) / 127

    def side(change: float, sign: Any) -> float:
        shuttle = el.Node(0.0299250, 4.265e-3 * (1 + change), el.slider_support(UP))
        nodes = {"wall": el.Node(0, 0, el.CLAMPED_SUPPORT), "shuttle": shuttle}
        leaf = el.Network(nodes, {"leaf": el.Beam("wall", "shuttle", section)})
        path = el.trace(leaf, el.Displacement("shuttle", DOWN, points), el.Control(sign=sign))
        shape = path.shape("leaf", int(np.abs(path.drive - 2.5e-3).argmin()))
        return float(np.sign(shape[len(shape) // 2, 1] - 0.5 * shape[-1, 1]))

    assert {side(1e-9 * change, sign) for change in range(8)} == {-side(0.0, -sign)}
