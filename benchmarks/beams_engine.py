"""Speed of the beam engine: Lan's network, a cantilever, a V-beam through its bifurcations, gradients, a batch.

Run: python benchmarks/beams_engine.py [--peer]. With --peer the same curves are traced by openseespy in the same run,
interleaved, if it can be imported (Debian: libblas3, liblapack3 and libgfortran5 must be there), with as many elements
as the tolerance asks for; it follows the unstable branch of the V-beam. Minima of repeats after warm-up; networks are
built anew for each, and forces (or displacements under forces) read out; the error is against the finest engine mesh.
"""

from __future__ import annotations

import sys
import time
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.elastica import (
    CLAMPED_SUPPORT,
    Beam,
    Control,
    Displacement,
    Loading,
    Network,
    Node,
    PointLoad,
    Polynomial,
    Section,
    gradient,
    slider_support,
    trace,
    trace_many,
)

if TYPE_CHECKING:
    from collections.abc import Callable

MM = 1e-3
SHAPE = np.array([3.05, 1.877, 1.244, 2.40, 1.3092, -1.5707, -0.7560, 1.5707, 0.3013, 1.5707, 0.226, -1.148, 3.45])


def lan(x: Any = SHAPE) -> Network:
    section = Section(2e9, 10 * MM, 1 * MM, axial=False)
    cm = 1e-2
    nodes = {
        "n1": Node(0.25 * cm, 0, CLAMPED_SUPPORT),
        "n2": Node(x[12] * cm, 0, CLAMPED_SUPPORT),
        "n3": Node(x[0] * cm, x[1] * cm),
        "n4": Node(x[2] * cm, x[3] * cm),
        "n5": Node(0.25 * cm, 4 * cm, slider_support(np.pi / 2)),
    }
    ends = [("n1", "n3", 0.4592), ("n2", "n3", 1.6382), ("n3", "n4", -4.081), ("n4", "n5", 2.394)]
    beams = {
        f"b{k}": Beam(a, b, section, Polynomial((c, x[4 + 2 * k], x[5 + 2 * k]))) for k, (a, b, c) in enumerate(ends)
    }
    return Network(nodes, beams)


def cantilever() -> Network:
    section = Section(2.4e9, 0.1, 1e-3, axial=False)
    return Network({"root": Node(0, 0, CLAMPED_SUPPORT), "tip": Node(0.4, 0)}, {"x": Beam("root", "tip", section)})


def v_beam() -> Network:
    length, angle = 35 * MM, np.radians(7)
    section = Section(1477e6, 6 * MM, 1 * MM)
    nodes = {
        "wall": Node(0, 0, CLAMPED_SUPPORT),
        "d": Node(length * np.cos(angle), length * np.sin(angle), slider_support(np.pi / 2)),
    }
    return Network(nodes, {"v": Beam("wall", "d", section)})


def best(work: Callable[[], Any], repeats: int = 15) -> float:
    """Return the shortest processor time of several runs [ms], after one to warm up."""
    work()
    times = []
    for _ in range(repeats):
        start = time.process_time()
        work()
        times.append(time.process_time() - start)
    return 1e3 * min(times)


def report(name: str, build: Callable[[], Network], drive: Any) -> None:
    exact = trace(build(), drive, Control(tolerance=1e-11))
    truth = exact.effort[exact.at_requested]
    for tolerance in (1e-3, 1e-4, 1e-5, 1e-6, 1e-8):
        control = Control(tolerance=tolerance)
        path = trace(build(), drive, control)
        error = np.abs(path.effort[path.at_requested] - truth).max() / np.abs(truth).max()
        took = best(lambda control=control: trace(build(), drive, control).effort)
        print(f"{name:12s} tolerance {tolerance:.0e}  {took:8.2f} ms  error {error:.1e}  {len(path)} points")


def main() -> None:
    curve = Displacement("n5", -np.pi / 2, np.arange(1, 33) * 0.5 * MM)
    bend = Loading((PointLoad("tip", fy=-1.0),), np.linspace(0.1, 1, 10) * 10 * 2e-2 / 0.4**2)
    snap = Displacement("d", -np.pi / 2, np.linspace(0.02, 1, 50) * 7 * MM)
    report("lan", lan, curve)
    report("cantilever", cantilever, bend)
    report("v-beam", v_beam, snap)
    gradients(curve)
    for workers in (1, 2):
        print(f"batch        {batch(curve, workers):8.0f} designs a second, {workers} processes")
    if "--peer" in sys.argv:
        peer(curve, bend, snap)


def gradients(curve: Displacement) -> None:
    """Print how long the derivatives of the efforts by 13 variables take, next to the curve, in turn."""
    for tolerance in (1e-4, 1e-5):
        control = Control(tolerance=tolerance)
        path, ours, curves = trace(lan(), curve, control), [], []
        for _ in range(5):
            ours.append(best(lambda path=path: gradient(path, lan, SHAPE).effort, 5))
            curves.append(best(lambda control=control: trace(lan(), curve, control), 5))
        ratio = min(ours) / min(curves)
        print(f"13 gradients {min(ours):8.2f} ms for 32 points at {tolerance:.0e}: {ratio:.2f} times the curve")


def batch(curve: Displacement, workers: int, count: int = 4000) -> float:
    """Return the designs traced in a second, after the first 640: starts and ends of processes do not count."""
    rng = np.random.default_rng(0)
    some = (partial(lan, SHAPE * (1 + 1e-3 * rng.standard_normal(13))) for _ in range(count + 640))
    outcomes = trace_many(some, curve, Control(tolerance=1e-5), workers=workers)
    for _ in range(640):
        next(outcomes)
    done, start = 0, time.perf_counter()
    for outcome in outcomes:
        done += outcome.value is not None
        end = time.perf_counter()
    return done / (end - start)


def peer(curve: Displacement, bend: Loading, snap: Displacement) -> None:
    """Trace the three curves by corotational elements of openseespy (mm, N), in turn with the engine."""
    try:
        import openseespy.opensees as ops
    except (ImportError, RuntimeError) as error:
        print(f"peer         openseespy cannot be used here: {error}")
        return
    # Young's modulus, area, second moment [MPa, mm]; beams that do not stretch: 1e4 times their area
    compare(ops, "lan", lan, curve, (2000.0, 10.0 * 1e4, 10.0 / 12), (1e-3, 1e-4))
    compare(ops, "cantilever", cantilever, bend, (2400.0, 100.0 * 1e4, 100.0 / 12), (1e-4, 1e-5))
    compare(ops, "v-beam", v_beam, snap, (1477.0, 6.0, 0.5), (1e-3, 1e-4, 5e-5))


def compare(ops: Any, name: str, build: Any, drive: Any, section: Any, tolerances: tuple[float, ...]) -> None:
    """Print times of both, interleaved, and their ratio; the peer stays on the path that it starts on."""
    path = trace(build(), drive, Control(tolerance=1e-9, branch="primary"))
    exact = path.effort[path.at_requested]

    def error(count: int) -> float:
        return float(np.abs(_opensees(ops, path, drive, count, section) - exact).max() / np.abs(exact).max())

    rough = error(20)
    for tolerance in tolerances:
        count = int(np.ceil(20 * np.sqrt(rough / tolerance)))  # second order in the element
        theirs, ours = [], []
        for _ in range(6):
            theirs.append(best(lambda count=count: _opensees(ops, path, drive, count, section), 1))
            control = Control(tolerance=tolerance)
            ours.append(best(lambda control=control: trace(build(), drive, control).effort, 20))
        print(
            f"peer {name:10s} {count} elements a beam  {min(theirs):8.2f} ms  error {error(count):.1e}; "
            f"engine at {tolerance:.0e} {min(ours):8.2f} ms: {min(theirs) / min(ours):.0f} times"
        )


def _opensees(ops: Any, path: Any, drive: Any, count: int, section: tuple[float, float, float]) -> Any:
    ops.wipe()
    ops.model("basic", "-ndm", 2, "-ndf", 3)
    network, tags = path.network, {}
    for tag, (name, node) in enumerate(network.nodes.items(), 1):
        tags[name] = tag
        ops.node(tag, 1e3 * node.x, 1e3 * node.y)
    for name, node in network.nodes.items():
        if node.support.across:
            ops.fix(tags[name], 1, int(node.support.along), 1)
    ops.geomTransf("Corotational", 1)
    tag, element = 100, 0
    young, area, inertia = section
    for name, beam in network.beams.items():
        fitted, fine = path.fits[name], np.linspace(0, 1, 20 * count + 1)
        angle = fitted.angle(0.5 * (fine[1:] + fine[:-1]), 0.5)
        step = 1e3 * fitted.length / (20 * count)
        x = 1e3 * network.nodes[beam.start].x + np.concatenate([[0], np.cumsum(np.cos(angle))]) * step
        y = 1e3 * network.nodes[beam.start].y + np.concatenate([[0], np.cumsum(np.sin(angle))]) * step
        before = tags[beam.start]
        for k in range(1, count + 1):
            after = tags[beam.end] if k == count else (tag := tag + 1)
            if k < count:
                ops.node(after, float(x[20 * k]), float(y[20 * k]))
            element += 1
            ops.element("elasticBeamColumn", element, before, after, area, young, inertia, 1)
            before = after
    loaded = isinstance(drive, Loading)
    node = tags[drive.loads[0].node if loaded else drive.node]
    ops.timeSeries("Linear", 1)
    ops.pattern("Plain", 1, 1)
    ops.load(node, 0.0, -1.0, 0.0)
    ops.constraints("Plain")
    ops.numberer("RCM")
    ops.system("BandGeneral")
    ops.test("NormDispIncr", 1e-8, 50)
    ops.algorithm("Newton")
    if loaded:
        ops.integrator("LoadControl", float(drive.points[0]))
    else:
        ops.integrator("DisplacementControl", node, 2, -1e3 * float(drive.points[0]))
    ops.analysis("Static")
    found = []
    for _ in drive.points:
        if ops.analyze(1) != 0:
            raise RuntimeError("openseespy did not converge")
        found.append(-1e-3 * ops.nodeDisp(node, 2) if loaded else ops.getTime())
    return np.array(found)


if __name__ == "__main__":
    main()
