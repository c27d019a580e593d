"""A table of paths: how each ends, the events on its way, and its forces, which do not depend on the tolerance.

Most rows are paths that once went wrong: points at, beside and between bifurcations, drives that turn round, several
modes at once, starts on meshes that are too coarse.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from buckling_structures import (
    LEAF_RISE,
    STIFF_STRIP,
    UP,
    arch,
    cantilever,
    half_arch,
    leaves,
    load,
    press,
    toggle,
)

import cfmkit.elastica as el

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

SIGNS = 1, -1


@dataclass(frozen=True, eq=False)
class Case:
    """A network, how it is driven, and what is expected of its path."""

    name: str
    network: el.Network
    drive: Any
    events: str = ""  # "kind before>after" of each; before and after: number of unstable modes
    at: Any = None  # drives of the events; None: those of the reference
    at_error: float = 2.0  # allowed for these, in tolerances of the largest point
    control: Mapping[str, Any] = field(default_factory=dict)
    status: str = "COMPLETE"
    message: str = ""  # that the path's message contains
    branches: str = ""  # p for a requested point on the primary path, b for one on a branch
    alone: tuple[tuple[el.Network, Any], ...] = ()  # structures whose forces add up to these; none: the case itself
    added: tuple[int, ...] = ()  # requested points that the reference does not have
    tolerances: tuple[float, ...] = (1e-3, 1e-5, 1e-7)
    check: Callable[[el.Path, float], None] = lambda _path, _tolerance: None

    @cached_property
    def reference(self) -> tuple[el.Path, ...]:
        """Paths of the structures alone, or of the case itself, at a tight tolerance."""
        control = el.Control(**{**self.control, "tolerance": 1e-10})
        return tuple(el.trace(*each, control) for each in self.alone or ((self.network, self.drive),))


def changes(*counts: int, kind: str = "bifurcation") -> str:
    """Return events of one kind between these numbers of unstable modes."""
    return ", ".join(f"{kind} {before}>{after}" for before, after in pairwise(counts))


LEAF = leaves()
POINTS = np.linspace(0.05, 2.1, 15) * LEAF_RISE
BEGIN, END = (
    event.drive for event in el.trace(LEAF, press("d", POINTS), el.Control(tolerance=1e-10, branch="primary")).events
)
BUCKLES_AND_STRAIGHTENS = changes(0, 1, 0)


def points_near_bifurcations() -> Iterator[Case]:
    """A leaf is asked for points at, beside and around the two ends of its branch; the rest is as without them."""
    tolerances = (1e-4, 1e-6, 1e-8)
    whole = ((LEAF, press("d", POINTS)),)
    for name, place in (("begin", BEGIN), ("end", END)):
        for off in (0.0, 1e-12, -1e-10, 1e-9, -1e-8, 1e-7, -1e-6, 3e-6, -1e-5, 1e-4, -1e-3):
            points = np.sort(np.append(POINTS, place + off * LEAF_RISE))
            added = (int(np.searchsorted(points, place + off * LEAF_RISE)),)
            yield Case(
                f"point beside {name} by {off:g}", LEAF, press("d", points), BUCKLES_AND_STRAIGHTENS,
                alone=whole, added=added, tolerances=tolerances,
            )  # fmt: skip
            if off in (0.0, 1e-9, 1e-4):
                yield Case(
                    f"point beside {name} by {off:g}, straight on", LEAF, press("d", points), BUCKLES_AND_STRAIGHTENS,
                    alone=whole, added=added, control={"branch": "primary"},
                )  # fmt: skip
    yield Case("last point at begin", LEAF, press("d", [0.5 * BEGIN, BEGIN]), changes(0, 1), (BEGIN,))
    yield Case("last point at end", LEAF, press("d", [0.5 * BEGIN, LEAF_RISE, END]), changes(0, 1, 0), (BEGIN, END))
    for offs in ((-1e-7, 0.0), (0.0, 1e-7), (-1e-7, 1e-7), (-1e-6, -1e-7, 0.0, 1e-7, 1e-6)):
        for behind in ((), (2.1,)):
            points = LEAF_RISE * np.array([1.0, *(END / LEAF_RISE + off for off in offs), *behind])
            yield Case(f"points by {offs} at end, then {behind}", LEAF, press("d", points), BUCKLES_AND_STRAIGHTENS)
    sways = ((arch(), press("t", [1e-3, 3e-3, 5e-3])),)
    for branch in ("primary", "stable"):
        place = el.trace(*sways[0], el.Control(branch=branch)).events[0].drive  # type: ignore[arg-type]
        for off in (1e-7, 1e-6, 1e-5):
            yield Case(
                f"point beside an arch's bifurcation by {off:g}, {branch}", arch(),
                press("t", [1e-3, place + off, 3e-3, 5e-3]), changes(0, 1), control={"branch": branch},
                alone=sways, added=(1,),
            )  # fmt: skip


def drives_that_turn() -> Iterator[Case]:
    """Points turn round: what was passed is met again, and a branch is left by either end."""
    b, e, nearly = BEGIN / LEAF_RISE, END / LEAF_RISE, BEGIN / LEAF_RISE - 1e-6
    rows = (
        ((1, 0.06, 1), (b, b, b), "bpb"),
        ((1, b, 1), (b,), ""),
        ((1, e, 1), (b,), ""),
        ((1, nearly, 0.5), (b, b, b), ""),
        ((1, 2.1, 1, 0.03), (b, e, e, b), "bpbp"),
        ((1, 2.1, 1, 2.1), (b, e, e, e), "bpbp"),
        ((1, 0.05, 1, 1.5, 0.5, 2, 1, 0), (b, b, b, e, e, e, e, b), "bpbpbpbp"),
    )
    for points, at, branches in rows:
        events = changes(*(k % 2 for k in range(len(at) + 1)))
        for sign in SIGNS:
            yield Case(
                f"to {points}, {sign:+d}", LEAF, press("d", LEAF_RISE * np.array(points)), events,
                LEAF_RISE * np.array(at), branches=branches, control={"sign": sign},
            )  # fmt: skip
    for count in (1, 2):
        loading_and_unloading = [*POINTS, *POINTS[-2::-1], 0]
        yield Case(
            f"{count} leaves down and up", leaves((1.0,) * count), press("d", loading_and_unloading),
            changes(0, count, 0, count, 0), (BEGIN, END, END, BEGIN),
            alone=((LEAF, press("d", loading_and_unloading)),) * count,
        )  # fmt: skip
    yield Case(
        "a path that ends in a stretch does not begin the next", arch(), load("t", [0.3, 2.0, 0.3]), changes(0, 1),
        status="JUMPS", check=lambda path, _: _equal(path.requested[path.at_requested].tolist(), [0]),
    )  # fmt: skip


def _equal(value: Any, expected: Any) -> None:
    assert value == expected


def dense_and_coarse_points() -> Iterator[Case]:
    """Thousands of points, or steps over several bifurcations at once."""
    stocky = leaves(thickness=1e-3, angle=7.0, shear=True, poisson_ratio=0.3)
    for count in (120, 480, 600, 960):  # among them points 0.0002 mm before it straightens and after it buckles
        for sign in SIGNS:
            yield Case(
                f"{count} points, {sign:+d}", stocky, press("d", 6e-3 * np.linspace(0, 1, count + 1)[1:]),
                BUCKLES_AND_STRAIGHTENS, (0.912302e-3, 4.750175e-3), 10.0, {"sign": sign}, tolerances=(1e-7,),
            )  # fmt: skip
    many = press("d", np.linspace(0.05, 2.1, 2500) * LEAF_RISE)
    yield Case("2500 points", LEAF, many, BUCKLES_AND_STRAIGHTENS, tolerances=(1e-5,))
    for step in (0.3, 0.1, 0.01):
        yield Case(
            f"first step {step}", LEAF, press("d", POINTS), BUCKLES_AND_STRAIGHTENS, control={"first_step": step},
            alone=((LEAF, press("d", POINTS)),),
        )  # fmt: skip
    straight_on = {"branch": "primary"}
    in_and_out = changes(0, 1, 2, 3, 2, 1, 0)
    for count in (9, 61):
        yield Case(
            f"six bifurcations of a V with {count} points", toggle(3e-3, el.Section(2e9, 6e-3, 0.5e-3), 40e-3),
            press("t", np.linspace(0, 9.3e-3, count)[1:]), in_and_out,
            1e-3 * np.array([0.144709, 0.296103, 0.540543, 1.769872, 3.704185, 4.519626]), 10.0, straight_on,
        )  # fmt: skip
    for rise, thickness, travel, count in (
        (4.6943915, 0.50606212, 9.6913175, 16),
        (4.881, 0.4587, 12.586, 7),
        (4.190, 0.33341, 10.933, 18),
        (4.1598965, 0.3633672, 11.4588855, 19),
    ):
        yield Case(
            f"V of {rise} mm with {count} coarse points",
            toggle(1e-3 * rise, el.Section(2e9, 6e-3, 1e-3 * thickness), 40e-3),
            press("t", np.linspace(0, 1e-3 * travel, count)[1:]), in_and_out, control=straight_on,
            check=lambda path, _: _equal(bool(np.abs(path.motion("t")[:, 2]).max() < 1e-6), True),
        )  # fmt: skip
    thin = leaves(thickness=2.3904131510924884e-4, angle=float(np.degrees(0.0796134409080207)))
    yield Case(
        "one step back to the primary path", thin, press("d", [5.051286820682658e-3]), changes(0, 1, 0),
        control={"sign": -1}, branches="p", tolerances=(1.0623860005428965e-6,),
    )  # fmt: skip


def several_modes() -> Iterator[Case]:
    """Equal or nearly equal structures side by side bear what each bears alone, and buckle to one side together."""

    def one_side(path: el.Path, _: float) -> None:
        at = path.at_requested[4]
        moments = np.array([path.end_force(name, 1)[at, 2] for name in path.network.beams])
        assert (np.sign(moments) == -int(path.branch[at][-2:])).all()
        assert np.abs(moments) == pytest.approx(np.full(len(moments), np.abs(moments).mean()), rel=0.05)

    def row(
        factors: tuple[float, ...], thickness: float, angle: float, tolerance: float, count: int, **more: Any
    ) -> Case:
        drive = press("d", np.linspace(0.05, 2.1, count) * 35e-3 * np.sin(np.radians(angle)))
        alone = tuple((leaves((factor,), thickness, angle), drive) for factor in factors)
        stated = {"events": changes(0, len(factors), 0), "check": one_side, "tolerances": (tolerance,), **more}
        name = f"leaves {factors} of {thickness:g} m at {angle:g} deg, {count} points"
        return Case(
            f"{name} {more.get('control', '')}", leaves(factors, thickness, angle), drive, alone=alone, **stated
        )

    for sign in SIGNS:
        for many, tolerance in ((2, 1e-9), (5, 1e-5), (8, 1e-3)):
            yield row((1.0,) * many, 7e-4, 8.0, tolerance, 15, control={"sign": sign})
        for many, count in ((2, 11), (2, 20), (4, 51)):  # no rounded corner hides the bifurcation
            yield row((1.0,) * many, 5.66e-4, 4.6, 1e-6, count, control={"sign": sign})
    for factors, thickness, angle, tolerance in (
        ((1, 1 + 1e-7), 7e-4, 8.0, 1e-5),
        ((1, 1 + 1e-6), 7e-4, 8.0, 1e-3),
        ((1, 1 + 1e-4), 7e-4, 8.0, 1e-7),
        ((1, 1 + 1e-5, 1 + 1e-4), 7e-4, 8.0, 1e-6),
        ((1, 1), 1e-4, 9.4, 1e-3),
        ((1, 1), 2e-4, 9.4, 1e-5),
        ((1, 1), 5e-4, 9.4, 1e-9),
    ):
        yield row(factors, thickness, angle, tolerance, 15, at_error=2.0 + 0.3 * (max(factors) - 1.0) / tolerance)
    # they buckle together and straighten one after the other: several ends of branches
    yield row(tuple(1 + 1e-3 * k for k in range(5)), 7e-4, 8.0, 1e-5, 15, events="any")
    # every shorter step came a little nearer to the bifurcation and not past it
    yield row((1.0,) * 5, 6.034841487544531e-4, 5.047877770936848, 6.665797876563091e-08, 29)
    several = leaves((1.0,) * 2, 5.66e-4, 4.6)
    stopped = press("d", np.linspace(0.05, 2.1, 20) * 35e-3 * np.sin(np.radians(4.6)))
    yield Case(
        "stop where two modes", several, stopped, status="JUMPS", control={"branch": "stop"}, check=_lost,
        message="the path ends there",
    )  # fmt: skip
    bent = press("d", np.linspace(0.05, 2.1, 15) * LEAF_RISE)
    yield Case("three leaves bent by 1e-5", leaves((1.0,) * 3), bent, control={"imperfection": 1e-5}, check=_bend_alike)


def _bend_alike(path: el.Path, _: float) -> None:
    moments = np.array([path.end_force(name, 1)[path.at_requested[4], 2] for name in path.network.beams])
    alone = el.trace(LEAF, press("d", POINTS))
    assert moments == pytest.approx(np.full(3, moments.mean()), rel=0.05)
    assert moments.mean() == pytest.approx(alone.end_force("b0", 1)[alone.at_requested[4], 2], rel=0.05)


def imperfections_and_sides() -> Iterator[Case]:
    """A buckling mode as an imperfection, and the side that a sign means, do not depend on the mesh."""
    yield Case(
        "a thin leaf bent by 0.08 mm",
        leaves(thickness=1.718747248202898e-4, angle=float(np.degrees(0.043669063665053666))),
        press("d", [6.1176e-4, 1.22353e-3, 1.83529e-3]), control={"imperfection": 8.164652e-5},
        tolerances=(1e-3, 1e-4, 4.65e-5, 1e-5),
    )  # fmt: skip
    clamped = {"end": el.CLAMPED_SUPPORT}
    yield Case(
        "an arch bent by 0.03 mm", arch(0.012, 0.06, el.Section(2e9, 8e-3, 1e-3), **clamped),
        press("t", np.linspace(0, 1.2 * 0.012, 7)[1:]), control={"imperfection": 3e-5},
        tolerances=(1e-3, 1e-4, 1.7e-5, 1e-6),
    )  # fmt: skip
    meshes = (1e-3, 1e-5, 5e-6, 1e-6, 1e-8)
    for sign in SIGNS:

        def moment_at_shuttle(path: el.Path, _: float, sign: int = sign) -> None:
            assert path.end_force("b0", 1)[path.at_requested[-1], 2] == pytest.approx(-0.01141 * sign, rel=1e-2)

        def turn_of_top(path: el.Path, _: float, sign: int = sign) -> None:
            turn = path.motion("t")[path.at_requested[-1], 2]
            assert turn == pytest.approx(TURN_OF_ARCH * sign, rel=1e-2)

        yield Case(
            f"side of a leaf, {sign:+d}", leaves(thickness=1e-3, angle=7.0), press("d", [1e-3, 2e-3]), changes(0, 1),
            control={"sign": sign}, tolerances=meshes, check=moment_at_shuttle,
        )  # fmt: skip
        yield Case(
            f"side of an arch, {sign:+d}", arch(0.006, 0.03, el.Section(2e9, 8e-3, 0.6e-3), **clamped),
            press("t", np.linspace(0, 0.006, 7)[1:]), changes(0, 1), control={"sign": sign}, tolerances=meshes,
            check=turn_of_top,
        )  # fmt: skip


TURN_OF_ARCH = -0.3803154
"""Rotation of the top of the clamped arch at the end of its path [rad], where its sign is +1."""


def endings() -> Iterator[Case]:
    """Each status with a network that ends that way, or that once did and should not."""
    push = load("t", np.linspace(0.05, 2.0, 40))
    yield Case("an arch sways off", arch(), push, changes(0, 1), status="JUMPS")
    yield Case(
        "an arch is stopped", arch(), push, status="JUMPS", control={"branch": "stop"}, check=_lost,
        message="the path ends there",
    )  # fmt: skip
    through = changes(0, 1) + ", limit point 1>2, bifurcation 2>1, limit point 1>0"
    for branch in ("stable", "primary"):
        for count in (4, 30):
            yield Case(
                f"an arch snaps through {count} loads, {branch}", arch(),
                load("t", np.linspace(0, 2, count + 1)[1:]), through,
                control={"branch": branch, "through_folds": True},
            )  # fmt: skip
    yield Case(
        "half an arch is pulled as hard behind", half_arch(2e-3, 2e-4), load("t", [3e-4, 1e-3]), "any",
        status="OUTSIDE", control={"branch": "primary", "through_folds": True}, check=_goes_behind_its_start,
    )  # fmt: skip
    yield Case(
        "no more points", cantilever(), el.Displacement("t", UP, np.array([1e-3, 0.05])), status="FULL",
        control={"most_points": 2}, check=lambda path, _: _equal(1 < len(path) <= 4, True),
    )  # fmt: skip
    for axial in (True, False):
        strip = {"x": el.Beam("a", "t", el.Section(2e9, 8e-3, 1e-3, axial=axial))}
        spring = (el.TorsionSpring("a", "t", 1.0, 0.1),)
        for support, springs in ((el.FREE_SUPPORT, ()), (el.PINNED_SUPPORT, ()), (el.PINNED_SUPPORT, spring)):
            loose = el.Network({"a": el.Node(0, 0, support), "t": el.Node(0.1, 0)}, strip, springs=springs)
            for drive in (load("t", [1.0], fy=1.0), el.Displacement("t", 0.0, np.array([1e-3]))):
                name = f"nothing holds it: {type(drive).__name__}, {axial}, {support.along}, {len(springs)}"
                yield Case(
                    name, loose, drive, status="NO_START", message="nothing holds the network", tolerances=(1e-7,)
                )
    steel = el.Section(2e11, 8e-3, 3.46e-3)
    nodes = {"a": el.Node(0, 0, el.CLAMPED_SUPPORT), "m": el.Node(0.04, 0), "b": el.Node(0.1, 0, el.CLAMPED_SUPPORT)}
    beam = el.Network(nodes, {"x": el.Beam("a", "m", steel), "y": el.Beam("m", "b", steel)})
    for name, network, drive in (  # forces only grow; the mesh is too coarse for a beam drawn taut
        ("a leaf pulled off its wall", LEAF, el.Displacement("d", UP, np.linspace(0.1, 1, 10) * 4.87e-3)),
        ("a beam pushed sideways", beam, el.Displacement("m", UP, np.linspace(2e-3, 0.02, 10))),
    ):
        yield Case(name, network, drive, tolerances=(0.1, 0.05, 1e-3))
    for steps in (3, 4, 10, 17):
        drive = load("t", np.linspace(0, 1.5, steps + 1)[1:], fy=-FORCE_OF_TRUSS)
        yield Case(
            f"a truss of stiff beams in {steps} steps", TRUSS, drive, changes(0, 1), (1.0,), 10.0, status="JUMPS",
            tolerances=(1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8), check=_ends_where_it_buckles,
        )  # fmt: skip
    shuttle = leaves((1.0,) * 4, turns=True)  # one mode turns the shuttle, three do not: their branch has a limit point
    for sign, tolerance in ((1, 1e-3), (-1, 1e-6)):
        for count in (5, 43):
            yield Case(
                f"leaves on a shuttle that turns, {count} points, {sign:+d}", shuttle,
                press("d", np.linspace(0.05, 2.1, count) * LEAF_RISE), changes(0, 4), status="LIMIT_POINT",
                control={"sign": sign}, tolerances=(tolerance,),
                check=lambda path, t: _equal(float(path.drive[-1]), pytest.approx(6.294452e-3, rel=max(1e-6, t**2))),
            )  # fmt: skip
    for force in (0.2, 0.24):  # it sways off at 0.257 N: until then there is an equilibrium
        heavy = toggle(0.01, end=el.PINNED_SUPPORT, loads=(el.PointLoad("t", fy=-force),))
        yield Case(f"constant loads of {force} N on long segments", heavy, el.Displacement("t", 0.0, np.array([1e-5])))


ANGLE_OF_TRUSS = np.radians(8)
TRUSS = toggle(0.05 * np.sin(ANGLE_OF_TRUSS), STIFF_STRIP, 0.05 * np.cos(ANGLE_OF_TRUSS))
FORCE_OF_TRUSS = 2 * np.sin(ANGLE_OF_TRUSS) * 4.493409457909064**2 * 2e9 * 8e-3 * 1e-9 / 12 / 0.05**2
"""Its beams buckle as columns clamped at one end, pinned at the other: 20.1907 EI / L^2 (tan u = u) [N]."""


def _ends_where_it_buckles(path: el.Path, tolerance: float) -> None:
    points = path.load_case.points
    assert path.drive[-1] <= 1.0 + 10 * tolerance
    assert len(path.at_requested) in (int((points < 1.0).sum()), int((points <= 1.0).sum()))


def _lost(path: el.Path, _: float) -> None:
    bifurcation = el.trace(path.network, path.load_case).events[0].drive
    assert path.stable[:-1].all()
    assert not path.stable[-1]
    assert path.drive[-2] < bifurcation < path.drive[-1]


def _goes_behind_its_start(path: el.Path, _: float) -> None:
    assert "limit point" in [event.kind for event in path.events]
    assert path.drive.max() < 1e-3
    assert path.drive[-1] < -0.5e-3 < path.drive[-2]


def closed_forms() -> Iterator[Case]:
    """Bifurcations of shallow arches and leaves in closed form, nearly."""
    for ratio in (2.33, 4.0, 6.0, 10.0, 20.0):  # two modes; the second is straightened where its coefficient vanishes
        root = np.sqrt((8 / 9) ** 2 + 6 * (np.pi**2 / 9 - 2 * np.pi**2 / (3 * ratio**2)))
        end = 2e-3 * (4 / 3 - (8 / 9 - root) / 3)

        def closes(path: el.Path, _: float, end: float = end) -> None:
            assert path.events[1].drive == pytest.approx(end, abs=2e-6)
            assert (path.branch[path.drive > end + 2e-5] == "primary").all()

        yield Case(
            f"half an arch of {ratio} thicknesses", half_arch(2e-3, 2e-3 / ratio),
            press("t", np.arange(0.02, 1.99, 0.02) * 2e-3),
            BUCKLES_AND_STRAIGHTENS, check=closes, tolerances=(1e-6,),
        )  # fmt: skip
    for length, slenderness in ((80, 3.3), (192, 5), (192, 3.6), (35, 3.15)):
        rise = 4.265e-3  # buckles and straightens at 2h/3 (1 -/+ sqrt(1 - (pi/Q)^2)), Q = rise / thickness
        places = 2 / 3 * rise * (1 + np.array([-1, 1]) * np.sqrt(1 - (np.pi / slenderness) ** 2))

        def flat(path: el.Path, _: float, places: Any = places) -> None:
            assert [event.drive for event in path.events] == pytest.approx(places, abs=6.4e-5)

        nodes = {
            "w": el.Node(0, 0, el.CLAMPED_SUPPORT),
            "d": el.Node(np.sqrt((1e-3 * length) ** 2 - rise**2), rise, el.slider_support(UP)),
        }
        leaf = el.Network(nodes, {"v": el.Beam("w", "d", el.Section(1477e6, 6e-3, rise / slenderness))})
        drive = press("d", np.linspace(0.02, 1.4, 70) * rise)
        yield Case(f"leaf of {length} mm, Q = {slenderness}", leaf, drive, BUCKLES_AND_STRAIGHTENS, check=flat)


TABLES = (
    points_near_bifurcations, drives_that_turn, dense_and_coarse_points, several_modes, imperfections_and_sides,
    endings, closed_forms,
)  # fmt: skip
CASES = [case for table in TABLES for case in table()]


@pytest.mark.parametrize(
    ("case", "tolerance"), [(case, t) for case in CASES for t in case.tolerances],
    ids=[f"{case.name}-{t:g}" for case in CASES for t in case.tolerances],
)  # fmt: skip
def test_a_path_is_that_of_its_row(case: Case, tolerance: float) -> None:
    path = el.trace(case.network, case.drive, el.Control(**{**case.control, "tolerance": tolerance}))
    reference = case.reference
    at, size = path.at_requested, float(np.abs(case.drive.points).max())
    assert path.status.name == case.status, path.message
    assert case.message in path.message
    seen = ", ".join(f"{event.kind} {event.before}>{event.after}" for event in path.events)
    assert case.events in (seen, "any")
    if case.events != "any":
        places = [event.drive for event in reference[0].events] if case.at is None else case.at
        assert [event.drive for event in path.events] == pytest.approx(places, abs=case.at_error * tolerance * size)
    assert case.control.get("branch", "stable") != "stable" or "through_folds" in case.control or path.stable.all()
    assert path.imperfection == reference[0].imperfection
    case.check(path, tolerance)
    if case.status != "COMPLETE":
        if len(path) and not case.message:
            last = path.events[0].drive if case.status == "JUMPS" else path.drive[-1]
            assert f"{last:.6g}" in path.message
        return
    assert path.error <= tolerance
    if "through_folds" not in case.control:
        assert path.requested[at].tolist() == list(range(len(case.drive.points)))
        assert path.drive[at] == pytest.approx(case.drive.points, rel=1e-12, abs=1e-12 * size)
    on_primary = path.branch[at] == "primary"
    assert not case.branches or "".join("p" if primary else "b" for primary in on_primary) == case.branches
    assert all(
        name.endswith(f"sign {case.control.get('sign', 1):+d}") for name in path.branch[at] if "bifurcated" in name
    )
    _compare_forces(case, path, reference, tolerance)


def _compare_forces(case: Case, path: el.Path, reference: tuple[el.Path, ...], tolerance: float) -> None:
    """Forces are the sum of those of the reference; those of one place on one branch are equal."""
    at = path.at_requested
    kept = [k for k in range(len(at)) if k not in case.added]
    expected = sum(alone.effort[alone.at_requested] for alone in reference)
    largest = np.abs(expected).max()
    np.testing.assert_allclose(path.effort[at[kept]], expected, rtol=0, atol=20 * tolerance * largest + 1e-12)
    for k in case.added:
        between = np.interp(path.drive[at[k]], reference[0].drive, reference[0].effort)
        assert path.effort[at[k]] == pytest.approx(between, abs=0.05 * largest)
    forces: dict[tuple[float, str], float] = {}
    if "through_folds" not in case.control:
        for k in at:
            known = forces.setdefault((float(path.drive[k]), str(path.branch[k])), float(path.effort[k]))
            assert path.effort[k] == pytest.approx(known, abs=20 * tolerance * largest)
