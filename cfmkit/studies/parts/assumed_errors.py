"""Errors of a part that says nothing but how it is made: assumed of the process, each with its reason.

Beside the tolerances of a process (`stock.processes`) stands the spread of the modulus that `show materials` has a
source for.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from cfmkit.families import family
from cfmkit.specs.study_spec import Tolerance
from cfmkit.stock.materials import MATERIALS_BY_NAME
from cfmkit.stock.processes import PROCESSES_BY_NAME, SPRING_RATE, usual

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cfmkit.specs.spec import Spec
    from cfmkit.stock.material_and_part_spec import MaterialSpec, PartProcess
    from cfmkit.stock.processes import ProcessAccuracy

OF_PLATES = "laser"
"""How links and cams are made that say nothing of a material: as the prototype of Sanchez-Salinas et al. (2022)."""
MODULUS_KEY = "mechanism.material.youngs_modulus"


@dataclass(frozen=True)
class Assumed:
    """Errors that are assumed of a part."""

    process: ProcessAccuracy  # how it is made
    kinds: Mapping[str, str]  # path -> in what it errs, "thickness" or "position"
    modulus: tuple[float, float] | None  # range of the modulus at `MODULUS_KEY` [Pa]; None if no source says it
    # whether beams have materials of their own whose moduli are found in a range, too: they are taken as stated
    as_stated: bool = False
    # path of a spring's rate -> its nominal value [N/m or N m/rad]: found within `SPRING_RATE` of it
    rates: Mapping[str, float] = field(default_factory=dict)

    @property
    def deviations(self) -> dict[str, float]:
        """Path -> standard deviation [m]."""
        return {path: getattr(self.process, kind) for path, kind in self.kinds.items()}


def assume_errors(spec: Spec, process: str | None = None) -> Assumed | None:
    """Return what is assumed of a part, by a process, the one that the specification names, or the usual one.

    None of what is no part.
    """
    errors = family(spec.family).errors(spec)
    kinds = {path: kind for path, kind in errors.items() if kind != "friction"}  # of which nothing is assumed
    if not kinds:
        return None
    accuracy, (shared, owned) = accuracy_of(spec, process), _materials(spec)
    band = next((found for one in shared if (found := _band(one))), None)
    rates = {path: float(spec.get_value(path)) for path, kind in kinds.items() if kind == "rate"}
    made = {path: kind for path, kind in kinds.items() if kind != "rate"}
    return Assumed(accuracy, made, band, any(map(_band, owned)), rates)


def accuracy_of(spec: Spec, process: str | None = None) -> ProcessAccuracy:
    """Return what is held by a process, by the one that the specification names, or by the usual one."""
    named = process or getattr(getattr(spec, "design", None), "process", None)
    if named:
        return PROCESSES_BY_NAME[named]
    usually = [usual(entry.name, entry.modulus) for group in _materials(spec) for entry in group]
    # one process makes the whole part: that of the material that is made least exactly
    accuracy = max(usually, key=lambda entry: entry.thickness, default=PROCESSES_BY_NAME[OF_PLATES])
    private = process_of_part(spec)
    return accuracy if private is None else private.accuracy(accuracy)


def tolerances(spec: Spec, process: str | None = None) -> dict[str, Any]:
    """Return the same in the words of `design.tolerances`; nothing of no part."""
    found = assume_errors(spec, process)
    if found is None:
        return {}
    stated: dict[str, Any] = {
        path: Tolerance(normal=f"{1e3 * sigma:.9g} mm") for path, sigma in found.deviations.items()
    }
    if found.modulus is not None:
        low, high = found.modulus
        stated[MODULUS_KEY] = (f"{low / 1e6:.9g} MPa", f"{high / 1e6:.9g} MPa")
    return stated | {path: Tolerance(uniform=f"{100.0 * SPRING_RATE:g} %") for path in found.rates}


def _materials(spec: Spec) -> tuple[tuple[MaterialSpec, ...], tuple[MaterialSpec, ...]]:
    """Return the material of a mechanism, where something is made of it, and those that its beams have of their own."""
    mechanism = getattr(spec, "mechanism", None)
    material: MaterialSpec | None = getattr(mechanism, "material", None)
    beams = getattr(mechanism, "beams", None)
    own = [getattr(beam, "material", None) for beam in beams.values()] if isinstance(beams, dict) else []
    shared = () if material is None or (own and None not in own) else (material,)
    return shared, tuple(one for one in own if one is not None)


def _band(material: MaterialSpec) -> tuple[float, float] | None:
    """Return the range of the modulus of a material [Pa], if it is that of its name."""
    known = MATERIALS_BY_NAME.get(material.name or "")
    return known.scatter.youngs_modulus if known and material.modulus == known.youngs_modulus else None


def process_of_part(spec: Spec) -> PartProcess | None:
    """Return how a part is made, as `mechanism.part.process` says; None: unsaid."""
    mechanism = getattr(spec, "mechanism", None)
    blocks = (getattr(mechanism, name, None) for name in ("part", "plate"))
    return next((one for block in blocks if (one := getattr(block, "process", None))), None)
