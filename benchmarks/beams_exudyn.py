"""The cantilever of `benchmarks/beams_engine.py` by exudyn: planar cable elements of the absolute nodal coordinates.

Run: python benchmarks/beams_exudyn.py (exudyn must be installed). Its best integration rule and just enough elements
for the tolerance; both are built anew each time, and timed in turn.
"""

from __future__ import annotations

import sys
import warnings
from typing import TYPE_CHECKING, Any

import numpy as np
from beams_engine import best, cantilever

from cfmkit.elastica import Control, Loading, PointLoad, trace

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray

LENGTH, RIGIDITY, STRETCH = 0.4, 0.02, 2.4e5  # [m], [N m2], [N]: the real one, softer joints of forces converge better
STEPS, LARGEST = 10, 10.0  # steps, P L^2 / EI


def exudyn_cantilever(exudyn: Any, count: int) -> FloatArray:
    """Return the deflections of the tip [m] at all steps with so many elements."""
    from exudyn import itemInterface as item

    system = exudyn.SystemContainer().AddSystem()
    size = LENGTH / count
    nodes = [
        system.AddNode(item.NodePoint2DSlope1(referenceCoordinates=[size * k, 0.0, 1.0, 0.0])) for k in range(count + 1)
    ]
    stiff = {"bendingStiffness": RIGIDITY, "axialStiffness": STRETCH, "massPerLength": 1.0, "length": size}
    for k in range(count):
        ends = [nodes[k], nodes[k + 1]]
        system.AddObject(item.ObjectANCFCable2D(nodeNumbers=ends, useReducedOrderIntegration=2, **stiff))
    ground = system.AddNode(item.NodePointGround())
    fixed = system.AddMarker(item.MarkerNodeCoordinate(nodeNumber=ground, coordinate=0))
    for coordinate in (0, 1, 3):  # place and direction of the root
        held = system.AddMarker(item.MarkerNodeCoordinate(nodeNumber=nodes[0], coordinate=coordinate))
        system.AddObject(item.ObjectConnectorCoordinate(markerNumbers=[fixed, held]))
    tip = system.AddMarker(item.MarkerNodePosition(nodeNumber=nodes[-1]))
    force = LARGEST * RIGIDITY / LENGTH**2
    system.AddLoad(item.LoadForceVector(markerNumber=tip, loadVector=[0.0, -force, 0.0]))
    kind = exudyn.OutputVariableType.Displacement
    sensor = item.SensorNode(nodeNumber=nodes[-1], outputVariableType=kind, storeInternal=True, writeToFile=False)
    number = system.AddSensor(sensor)
    system.Assemble()
    settings = exudyn.SimulationSettings()
    settings.solutionSettings.writeSolutionToFile = False
    settings.solutionSettings.sensorsWritePeriod = 1e-9
    settings.linearSolverType = exudyn.LinearSolverType.EigenSparse
    settings.staticSolver.numberOfLoadSteps = STEPS
    settings.staticSolver.newton.relativeTolerance = 1e-10
    settings.staticSolver.newton.absoluteTolerance = 1e-12
    settings.staticSolver.newton.maxIterations = 50
    settings.staticSolver.verboseMode = 0
    system.SolveStatic(settings)
    return np.asarray(-system.GetSensorStoredData(number)[1:, 2])


def main() -> None:
    """Print the cantilever's times at three tolerances."""
    try:
        import exudyn
    except ImportError as error:
        sys.exit(f"exudyn cannot be used here: {error}")
    warnings.simplefilter("ignore", DeprecationWarning)
    factors = np.linspace(1 / STEPS, 1, STEPS) * LARGEST * RIGIDITY / LENGTH**2
    drive = Loading((PointLoad("tip", fy=-1.0),), factors)
    path = trace(cantilever(), drive, Control(tolerance=1e-10))
    exact = path.effort[path.at_requested]
    for tolerance in (1e-3, 1e-4, 1e-5):
        control = Control(tolerance=tolerance)
        for count in range(4, 41):
            found = exudyn_cantilever(exudyn, count)
            error = np.inf if len(found) != STEPS else float(np.abs(found - exact).max() / exact.max())
            if error <= tolerance:
                break
        else:
            print(f"exudyn cantilever: not within {tolerance:.0e} with {count} elements")
            continue
        theirs, ours = [], []
        for _ in range(6):
            theirs.append(best(lambda count=count: exudyn_cantilever(exudyn, count), 5))
            ours.append(best(lambda control=control: trace(cantilever(), drive, control).effort, 20))
        ratio = min(theirs) / min(ours)
        print(
            f"exudyn cantilever {count} elements {min(theirs):6.2f} ms  error {error:.1e}; "
            f"engine at {tolerance:.0e} {min(ours):6.2f} ms: {ratio:.0f} times"
        )


if __name__ == "__main__":
    main()
