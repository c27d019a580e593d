"""The tolerances of a part that says nothing but how it is made: assumed, each with its reason (`stock.processes`).

Beside them stands the spread of the modulus that `show materials` has a source for.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from cfmkit.families import family
from cfmkit.families.base import function_named
from cfmkit.specs.spec import Tolerance
from cfmkit.stock.materials import MATERIALS
from cfmkit.stock.processes import PROCESSES, usual
from cfmkit.stock.spec import PartProcess

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cfmkit.specs.spec import Spec
    from cfmkit.stock.processes import ProcessAccuracy

OF_PLATES = "laser"
"""How links and cams are made that say nothing of a material: as the prototype of Sanchez-Salinas et al. (2022)."""

MODULUS = "mechanism.material.youngs_modulus"


@dataclass(frozen=True)
class Assumed:
    """Tolerances that are assumed of a part.

    Attributes
    ----------
    process : ProcessAccuracy
        How it is made.
    kinds : mapping of str to str
        Path -> in what it errs, "thickness" or "position".
    modulus : (float, float) or None
        From where to where the modulus is found [Pa]; None where no source says it.
    """

    process: ProcessAccuracy
    kinds: Mapping[str, str]
    modulus: tuple[float, float] | None

    @property
    def deviations(self) -> dict[str, float]:
        """Path -> standard deviation [m]."""
        return {path: getattr(self.process, kind) for path, kind in self.kinds.items()}


def assumed(spec: Spec, process: str | None = None) -> Assumed | None:
    """Return what is assumed of a part, by a process, the one that the specification names, or the usual one.

    None of what is no part.
    """
    errors = family(spec.family).errors
    if errors is None:
        return None
    kinds: Mapping[str, str] = function_named(errors)(spec)
    if not kinds:
        return None
    material = getattr(getattr(spec, "mechanism", None), "material", None)
    named = process or getattr(getattr(spec, "design", None), "process", None)
    accuracy = PROCESSES[OF_PLATES] if material is None else usual(material.name, material.modulus)
    own = process_of_part(spec)
    if named:
        accuracy = PROCESSES[named]
    elif own is not None:
        accuracy = own.accuracy(accuracy)
    band = None
    if material is not None and (known := MATERIALS.get(material.name)) and material.modulus == known.youngs_modulus:
        band = known.scatter.youngs_modulus
    return Assumed(accuracy, kinds, band)


def process_of_part(spec: Spec) -> PartProcess | None:
    """Return how a part is made, as `mechanism.part.process` or its old name `mechanism.process` says; None: unsaid."""
    mechanism = getattr(spec, "mechanism", None)
    said: PartProcess | None = getattr(getattr(mechanism, "part", None), "process", None)
    old = getattr(mechanism, "process", None)
    if said is None and old is not None:
        return PartProcess(position=old.layer, least_feature=old.thinnest)
    return said


def tolerances(spec: Spec, process: str | None = None) -> dict[str, Any]:
    """Return the same in the words of `design.tolerances`; nothing of no part."""
    found = assumed(spec, process)
    if found is None:
        return {}
    stated: dict[str, Any] = {
        path: Tolerance(normal=f"{1e3 * sigma:.9g} mm") for path, sigma in found.deviations.items()
    }
    if found.modulus is not None:
        low, high = found.modulus
        stated[MODULUS] = (f"{low / 1e6:.9g} MPa", f"{high / 1e6:.9g} MPa")
    return stated
