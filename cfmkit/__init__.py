"""cfmkit: design and analysis of constant-force mechanisms.

    import cfmkit

    spec = cfmkit.load("cam.yaml")
    result = cfmkit.analyze(spec)
    result.curve.force

Arrays are read-only and in SI units. The names below are imported when they are
first used, so that ``import cfmkit`` itself costs nothing.
"""

from __future__ import annotations

import sys
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING, Any

from cfmkit._version import __version__
from cfmkit.lazy_names import lazy_names

if TYPE_CHECKING:
    from cfmkit.api import (
        analyze,
        check,
        design,
        drawing,
        dumps,
        evaluate,
        export,
        figures,
        load,
        loads,
    )
    from cfmkit.curves import Curve
    from cfmkit.errors import (
        CfmError,
        DataError,
        ExitCode,
        FolderInUse,
        GeometryError,
        InputError,
        OutputError,
        Problem,
        QuantityError,
        SolutionError,
        SpecError,
        UsageError,
    )
    from cfmkit.experiment.measurement_and_calibration_outputs import MeasureReport
    from cfmkit.experiment.reading import Recording
    from cfmkit.families.run_control import Run
    from cfmkit.results import Design, Finding, Quantity, Result, Status
    from cfmkit.runs.batch import BatchResult, batch
    from cfmkit.runs.measure_and_calibrate_api import calibrate, correct, measure
    from cfmkit.runs.notebook_result import AnalysisView
    from cfmkit.runs.register import metric, register
    from cfmkit.runs.shipped_files import Example, examples
    from cfmkit.runs.suggest import suggest
    from cfmkit.runs.sweep_and_sensitivity_api import StudyResult, sensitivity, sweep
    from cfmkit.specs.spec import Spec

__getattr__, _ = lazy_names(
    __name__,
    {
        "api": "analyze check design drawing dumps evaluate export figures load loads",
        "runs.batch": "BatchResult batch",
        "runs.shipped_files": "Example examples",
        "curves": "Curve",
        "errors": (
            "CfmError DataError ExitCode FolderInUse GeometryError InputError OutputError Problem QuantityError "
            "SolutionError SpecError UsageError"
        ),
        "experiment.reading": "Recording",
        "experiment.measurement_and_calibration_outputs": "MeasureReport",
        "families.run_control": "Run",
        "runs.measure_and_calibrate_api": "calibrate correct measure",
        "runs.notebook_result": "AnalysisView",
        "results": "Design Finding Quantity Result Status",
        "specs.spec": "Spec",
        "runs.register": "metric register",
        "runs.sweep_and_sensitivity_api": "StudyResult sensitivity sweep",
        "runs.suggest": "suggest",
    },
)

__all__ = [
    "AnalysisView",
    "BatchResult",
    "CfmError",
    "Curve",
    "DataError",
    "Design",
    "Example",
    "ExitCode",
    "Finding",
    "FolderInUse",
    "GeometryError",
    "InputError",
    "MeasureReport",
    "OutputError",
    "Problem",
    "Quantity",
    "QuantityError",
    "Recording",
    "Result",
    "Run",
    "SolutionError",
    "Spec",
    "SpecError",
    "Status",
    "StudyResult",
    "UsageError",
    "__version__",
    "analyze",
    "batch",
    "calibrate",
    "check",
    "correct",
    "design",
    "drawing",
    "dumps",
    "evaluate",
    "examples",
    "export",
    "figures",
    "load",
    "loads",
    "measure",
    "metric",
    "register",
    "sensitivity",
    "suggest",
    "sweep",
]


class _Package(ModuleType):
    """The package `cfmkit`, whose `export` stays a function when the package of that name is imported."""

    @property
    def export(self) -> Any:
        """The function `cfmkit.api.export`."""
        return import_module("cfmkit.api").export

    @export.setter
    def export(self, package: ModuleType) -> None:
        """Ignore the package: the import system sets it as an attribute, but it is found without that."""


sys.modules[__name__].__class__ = _Package


def __dir__() -> list[str]:
    """Return the public names, imported or not."""
    return sorted({*globals(), *__all__})
