"""Material, process and screws that are written into the file of a proposal."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from cfmkit.errors import CfmError
from cfmkit.export.fixing_holes import NO_HOLES
from cfmkit.stock.processes import PROCESSES_BY_NAME

if TYPE_CHECKING:
    from cfmkit.families.base import Family
    from cfmkit.families.suggestion_request import Request
    from cfmkit.specs.spec import Spec

USUAL_SCREWS = ("M4", "M3", "M2.5", "M2", "M1.6")  # screws that hold small parts, the first one that fits


def add_process_and_materials(spec: Spec, request: Request) -> Spec:
    """Return a specification whose material is as stated, and whose part says by which process it is made if one is.

    Its inside corners are as round as before, or as round as the process makes them: a smaller radius has more stress.
    """
    mechanism = spec.get_value("mechanism")
    owners = {"mechanism": mechanism, "mechanism.contact": getattr(mechanism, "contact", None)}
    for path, owner in owners.items():
        if (material := getattr(owner, "material", None)) is not None:
            block = material.model_dump(exclude_unset=True)
            if (stated := request.stated_material(block)) != block:
                spec = spec.replace({f"{path}.material": dict(stated)})
    if request.process is None:
        return spec
    radius = PROCESSES_BY_NAME[request.process].least_radius
    fillet = getattr(spec.get_value("mechanism"), "fillet", 0.0)
    changes: tuple[dict[str, Any], ...] = (
        {"mechanism.part.process": request.process, "mechanism.part.fillet": max(radius, fillet)},
        {"mechanism.part.process": request.process},
        {"mechanism.plate.process": request.process},
    )
    for one in changes:
        try:
            return spec.replace(one)
        except CfmError:  # another kind of part
            continue
    return spec


def add_screws(record: Family, spec: Spec) -> Spec:
    """Return a part with holes for screws of usual sizes whose heads fit everywhere; without if none do."""
    if record.outline is None:
        return spec
    for screw in USUAL_SCREWS:
        try:
            fastened = spec.replace({"mechanism.part.screws": screw})
            drawing = record.outline(fastened)
        except CfmError:  # another kind of part, or none that can be cut
            return spec
        if not any(NO_HOLES in note for note in drawing.notes):
            return fastened
    return spec
