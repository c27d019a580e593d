"""A fifth family as somebody else would write it, with as little as there can be: a spring, and nothing that draws."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import numpy as np

from cfmkit.curves import Curve
from cfmkit.families import Family
from cfmkit.results import Result, Status
from cfmkit.specs import Analysis, Model, Spec
from cfmkit.specs.units import Stiffness  # noqa: TC001  pydantic reads the annotation

if TYPE_CHECKING:
    from cfmkit import Run

TEXT = """
cfmkit: 1
family: spare
mechanism: {stiffness: 2 N/mm}
"""


class Mechanism(Model):
    stiffness: Stiffness


class SpareSpec(Spec):
    family: Literal["spare"]
    mechanism: Mechanism
    analysis: Analysis = Analysis(points=5)


def analyze(spec: SpareSpec, run: Run) -> Result:
    travel = np.linspace(0.0, 0.01, spec.analysis.points)
    load = np.repeat("load", len(travel))
    curve = Curve(travel, spec.mechanism.stiffness * travel, load, np.ones(len(travel), dtype=bool))
    return Result(spec, Status.COMPLETE, "", curves=(curve,))


FAMILY_RECORD = Family("spare", "a spring", SpareSpec, {"only": analyze})
