"""The lift of the prototype (100 mm in 0.125 s, 201 points): three ways to the same force, error against time.

- direct: cfmkit's default, vectorised over time; mechanism built before, motion and forces timed (a copy of the machine
  each time: one machine remembers where its rollers are). Sides that are alike are solved once; with flanks that are
  turned (a slider that deviates by 2 deg) each is solved by itself, and has no closed form.
- nine coordinates: cfmkit's `method: multibody`, the formulation of the paper. It steps in Python; a compiled loop,
  bound by its 9 x 9 solves (four a step), would narrow the gap to an estimated one order of magnitude.
- exudyn, where it is installed: a general multibody code on the same bodies. It has no rolling
  on a given curve; rolling in the plane is integrable, so that the roller's spin is an inertia of m4 + I4/r^2 against
  acceleration, exactly. The roller's path is a constraint written in Python, which costs it most of its time.

Errors are relative to the largest force, against the direct solution, which agrees with nine coordinates at 4 000 steps
to rounding. Read ratios, not microseconds: each is the best of several runs on whatever machine this is.

Run: python benchmarks/cam_dynamics.py
"""

from __future__ import annotations

import time
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path

import numpy as np

import cfmkit
from cfmkit.families.cam.dynamics.inverse import respond
from cfmkit.families.cam.dynamics.machine_from_spec import build
from cfmkit.families.cam.dynamics.nine_coordinate_multibody import NineCoordinates, Scheme

CONFIG = Path(__file__).resolve().parent.parent / "configs" / "cam_dynamics.yaml"
POINTS = 201
GOAL_SECONDS, GOAL_RATIO, GOAL_ERROR = 0.2e-3, 20.0, 1e-9


def best(function, rounds, calls):
    """Return the best mean time of a call [s], and what it returns."""
    found, times = function(), []
    for _ in range(rounds):
        start = time.perf_counter()
        for _ in range(calls):
            function()
        times.append((time.perf_counter() - start) / calls)
    return min(times), found


A, X0, LENGTH, STIFFNESS, G = 9.058e-3, 0.068, 0.2, 1365.0, 9.80665
SLIDER, BRACE, BRACE_INERTIA, ROLLER, SPIN = 0.068, 0.077, 2.57e-4, 0.38, 4.61e-6 / 0.016**2
START, STROKE, DURATION = 0.22, 0.1, 0.125
FOOT = np.sqrt(LENGTH**2 - X0**2)


class Exudyn:
    """The prototype as a system of exudyn's."""

    def __init__(self):
        import exudyn
        from exudyn import itemInterface

        self.exu, self.item = exudyn, itemInterface
        self.system = exudyn.SystemContainer().AddSystem()
        ground = self.add(itemInterface.NodePointGround())
        self.ground = self.add(itemInterface.MarkerNodeCoordinates(nodeNumber=ground))
        self.zero = self.add(itemInterface.MarkerNodeCoordinate(nodeNumber=ground, coordinate=0))
        self.pin, self.force = self.slider()
        rollers = [self.side(hand) for hand in (-1.0, 1.0)]
        self.add(itemInterface.SpringDamper(markerNumbers=rollers, stiffness=STIFFNESS, referenceLength=2 * X0))
        self.system.Assemble()

    def add(self, thing):
        kind = type(thing).__name__
        for word, method in (
            ("Node", "AddNode"),
            ("Marker", "AddMarker"),
            ("Load", "AddLoad"),
            ("Sensor", "AddSensor"),
        ):
            if kind.startswith(word):
                return getattr(self.system, method)(thing)
        return self.system.AddObject(thing)

    def body(self, kind, node, mass, weight, **inertia):
        made = self.add(kind(nodeNumber=node, mass=mass, **inertia))
        marker = self.add(self.item.MarkerBodyPosition(bodyNumber=made))
        self.add(self.item.LoadForceVector(markerNumber=marker, loadVector=[0, -weight * G, 0]))
        return made, marker

    def slider(self):
        """Return the marker of the slider's pin and the sensor of the force that drives it."""
        node = self.add(self.item.NodePoint2D(referenceCoordinates=[0, START]))
        _, pin = self.body(self.item.ObjectMassPoint2D, node, SLIDER, SLIDER)
        across, along = (self.add(self.item.MarkerNodeCoordinate(nodeNumber=node, coordinate=i)) for i in (0, 1))
        self.add(self.item.CoordinateConstraint(markerNumbers=[self.zero, across]))
        drive = self.item.CoordinateConstraint(
            markerNumbers=[self.zero, along],
            offsetUserFunction=lambda _s, t, *_: STROKE * (t / DURATION - np.sin(2 * np.pi * t / DURATION) / 2 / np.pi),
            offsetUserFunction_t=lambda _s, t, *_: STROKE / DURATION * (1 - np.cos(2 * np.pi * t / DURATION)),
        )
        kind = self.exu.OutputVariableType.Force
        options = {"storeInternal": True, "writeToFile": False, "outputVariableType": kind}
        return pin, self.add(self.item.SensorObject(objectNumber=self.add(drive), **options))

    def side(self, hand):
        """Add a roller and its brace; return the marker of the roller's axis."""
        first = X0 + np.sqrt(2 * A * (START - FOOT))
        center = np.array([hand * first, START - np.sqrt(LENGTH**2 - first**2)])
        arm = center - [0, START]
        node = self.add(self.item.NodePoint2D(referenceCoordinates=center.tolist()))
        _, roller = self.body(self.item.ObjectMassPoint2D, node, ROLLER + SPIN, ROLLER)
        middle = [*(center - arm / 2), np.arctan2(arm[1], arm[0])]
        rod_node = self.add(self.item.NodeRigidBody2D(referenceCoordinates=middle))
        rod, _ = self.body(self.item.ObjectRigidBody2D, rod_node, BRACE, BRACE, inertia=BRACE_INERTIA)
        for end, other in ((-0.5, self.pin), (0.5, roller)):
            marker = self.item.MarkerBodyPosition(bodyNumber=rod, localPosition=[end * LENGTH, 0, 0])
            self.add(self.item.ObjectJointRevolute2D(markerNumbers=[other, self.add(marker)]))
        self.path(hand, node)
        return roller

    def path(self, hand, node):
        """Hold a roller's axis on its path."""

        def slope(q):
            x = hand * q[0]
            return hand * ((x - X0) / A + x / np.sqrt(LENGTH**2 - x**2))

        def constraint(_system, _t, _item, q, q_t, velocity_level):
            if velocity_level:
                return [q_t[1] - slope(q) * q_t[0]]
            x = hand * q[0]
            return [q[1] - ((x - X0) ** 2 / (2 * A) - np.sqrt(LENGTH**2 - x**2) + FOOT)]

        self.add(
            self.item.ObjectConnectorCoordinateVector(
                markerNumbers=[self.ground, self.add(self.item.MarkerNodeCoordinates(nodeNumber=node))],
                scalingMarker0=np.zeros((1, 3)),
                scalingMarker1=np.array([[0.0, 1.0]]),
                constraintUserFunction=constraint,
                jacobianUserFunction=lambda _s, _t, _i, q, *_: np.array([[-slope(q), 1.0]]),
            )
        )

    def run(self, steps):
        """Return times and force on the slider, and how long the integration took [s]."""
        settings = self.exu.SimulationSettings()
        scheme = settings.timeIntegration
        scheme.numberOfSteps, scheme.endTime, scheme.verboseMode = steps, DURATION, 0
        scheme.newton.useModifiedNewton = True
        scheme.newton.relativeTolerance, scheme.newton.absoluteTolerance = 1e-10, 1e-12
        scheme.generalizedAlpha.useIndex2Constraints = scheme.generalizedAlpha.useNewmark = True
        settings.solution.file.write = False
        settings.solution.sensors.writePeriod = DURATION / (POINTS - 1)
        begin = time.perf_counter()
        self.system.SolveDynamic(settings)
        seconds = time.perf_counter() - begin
        data = np.array(self.system.GetSensorStoredData(self.force))
        return data[:, 0], -data[:, 1], seconds


def line(way, steps, error, seconds, direct):
    print(f"{way:34s} {steps:6d} {error:9.1e} {seconds * 1e3:9.1f} ms {seconds / direct:8.0f}")


def main():
    parts = build(cfmkit.load(CONFIG))
    machine, motion = parts.machine, parts.motion
    times = motion.times(POINTS)
    direct, exact = best(
        lambda: respond(replace(machine), motion.evaluate(times)), 3000, 4
    )  # short runs dodge other processes
    sides = build(cfmkit.load(CONFIG).replace({"mechanism.errors.slider_deviation": "2 deg"})).machine
    turned, _ = best(lambda: respond(replace(sides), motion.evaluate(times)), 3000, 4)
    largest = np.abs(exact.force).max()
    print(f"{'way':34s} {'steps':>6s} {'error':>9s} {'time':>12s} {'ratio':>8s}")
    print(f"{'direct':34s} {'-':>6s} {'-':>9s} {direct * 1e3:9.3f} ms {1:8.0f}")
    print(f"{'direct, flanks turned by 2 deg':34s} {'-':>6s} {'-':>9s} {turned * 1e3:9.3f} ms {turned / direct:8.1f}")
    ratio = None
    for steps in (1, 2, 4, 20):
        seconds, path = best(lambda steps=steps: NineCoordinates(machine).run(motion, POINTS, Scheme(steps)), 2, 1)
        error = np.abs(path.force - exact.force).max() / largest
        if ratio is None and error <= GOAL_ERROR:
            ratio = seconds / direct
        line("nine coordinates", 200 * steps, error, seconds, direct)
    if find_spec("exudyn"):
        for steps in (200, 2000, 20000):
            when, force, seconds = Exudyn().run(steps)
            expected = respond(machine, motion.evaluate(np.minimum(when, motion.time))).force
            error = np.abs(force - expected).max() / largest
            line("exudyn, index 2, Newmark", steps, error, seconds, direct)
    else:
        print("exudyn is not installed: left out")
    print(f"direct at most {GOAL_SECONDS * 1e3:g} ms: {'yes' if direct <= GOAL_SECONDS else 'NO'}")
    print(
        f"at least {GOAL_RATIO:g} times faster at an error of {GOAL_ERROR:g}: {'yes' if ratio >= GOAL_RATIO else 'NO'}"
    )


if __name__ == "__main__":
    main()
