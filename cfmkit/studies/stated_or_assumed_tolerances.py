"""The tolerances that a design block states or a process is assumed to hold, and the parts that are drawn from them.

Parts are drawn as `cfmkit sensitivity --method tolerance` draws them, with the same grammar.

The tolerances of a part that says nothing but how it is made: assumed, each with its reason (`stock.processes`).
Beside them stands the spread of the modulus that `show materials` has a source for.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.errors import SpecError
from cfmkit.families import family
from cfmkit.families.base import function_named
from cfmkit.specs.spec import Sensitivity, Tolerance
from cfmkit.stock.materials import MATERIALS
from cfmkit.stock.processes import PROCESSES, SPRING_RATE, usual
from cfmkit.studies.sensitivity.distributions import draw, values_at
from cfmkit.studies.sensitivity.parameters import correlations, groups, parameters_of

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from cfmkit.arrays import FloatArray
    from cfmkit.specs.spec import DesignBlock, Spec
    from cfmkit.stock.material_and_part_spec import MaterialSpec, PartProcess
    from cfmkit.stock.processes import ProcessAccuracy
    from cfmkit.studies.sensitivity.parameters import Parameter


NO_TOLERANCE = "no value of this part is known to err by its process: state 'design.tolerances'"


@dataclass(frozen=True)
class DesignTolerances:
    """The tolerances of a `design` block on one specification."""

    spec: Spec  # what is made
    block: Sensitivity  # the tolerances in the block that studies know
    parameters: tuple[Parameter, ...]  # what varies, lists taken apart
    # samples, seed: how many parts are drawn, and from where
    samples: int
    seed: int

    @property
    def paths(self) -> tuple[str, ...]:
        """Paths of the values that vary."""
        return tuple(one.path for one in self.parameters)

    @property
    def nominal(self) -> FloatArray:
        """The values of a perfect part [SI]."""
        return np.array([one.spread.nominal for one in self.parameters])

    def drawn(self, samples: int | None = None, seed: int | None = None) -> FloatArray:
        """Return the values of made parts, (n, d) [SI]; of another seed those that no search has seen."""
        generator = np.random.default_rng(self.seed if seed is None else seed)
        unit = draw(correlations(self.block, self.paths), samples or self.samples, generator)
        return values_at([one.spread for one in self.parameters], unit)

    def joined(self) -> list[tuple[int, ...]]:
        """Return the parameters that deviate as one: those correlated by 1 together, each other one alone."""
        many = [members for members, correlation in groups(self.block, self.paths) if correlation == 1.0]
        taken = {k for members in many for k in members}
        return [*many, *((k,) for k in range(len(self.parameters)) if k not in taken)]


def tolerances_of(spec: Spec, design: DesignBlock, seed: int) -> DesignTolerances | None:
    """Return the tolerances of a `design` block on a specification, or those of its process; None if it has none.

    Raises
    ------
    cfmkit.errors.SpecError
        If a path is not in the specification, at ``design.tolerances`` and the path.
    """
    stated = stated_tolerances(spec, design)
    if not stated:
        return None
    block = Sensitivity.model_construct(method="tolerance", parameters=stated, correlated=design.correlated, metrics=())
    try:
        parameters = parameters_of(spec, block)
    except SpecError as error:
        raise SpecError([replace(one, path=_renamed(one.path)) for one in error.problems]) from None
    chosen = seed if design.seed is None else design.seed
    return DesignTolerances(spec, block, parameters, design.tolerances_of(spec)[1], chosen)


def stated_tolerances(spec: Spec, design: DesignBlock) -> dict[str, Any]:
    """Return the tolerances that a `design` block gives, else those of the process that it or the part names."""
    stated = design.tolerances_of(spec)[0]
    if stated or not is_made(spec, design):
        return dict(stated)

    return tolerances(spec)


def is_made(spec: Spec, design: DesignBlock) -> bool:
    """Return True if it is said how parts are made: by a block `design`, or of a part whose yield is requested."""
    if design.tolerances_of(spec)[0] or design.process is not None:
        return True

    asked = getattr(design, "yield") is not None or len(spec.part_requirements) < len(spec.requirements)
    return asked and process_of_part(spec) is not None


def errs_nowhere(spec: Spec, design: DesignBlock) -> bool:
    """Return True if no value of a part that `is_made` errs; of a solid that is seen only once it is drawn."""
    return spec.fidelity != "solid" and not stated_tolerances(spec, design)


def _renamed(path: str) -> str:
    """Return where a fault of a block `sensitivity` stands in a block `design`."""
    head, _, rest = path.partition(".parameters.")
    return f"design.tolerances.{rest}" if rest else head.replace("sensitivity", "design", 1)


def faults(spec: Spec, design: DesignBlock) -> Iterator[tuple[tuple[str | int, ...], str]]:
    """Yield what is wrong with a block's keys on made parts as far as that can be seen before anything is designed."""
    from cfmkit.studies.variable_paths import CannotVary, leaf

    for path in design.tolerances or ():
        try:
            found = leaf(type(spec), path.replace(".*", ".0"))
        except CannotVary as problem:
            yield ("design", "tolerances", path), str(problem)
            continue
        if found.kind not in ("quantity", "number"):
            yield ("design", "tolerances", path), f"{path!r} does not vary continuously"
    for path in design.free:
        try:
            leaf(type(spec), path)
        except CannotVary as problem:
            yield ("design", "free", path), str(problem)
    if design.robust is not None and getattr(design, "yield") is None:
        yield ("design", "robust"), "says how a yield is reached: give 'design.yield', too"
    if getattr(design, "yield") is not None and not is_made(spec, design):
        yield (
            ("design", "yield"),
            "a yield is a share of manufactured parts: state their tolerances in 'design.tolerances'",
        )
    elif getattr(design, "yield") is not None and errs_nowhere(spec, design):
        yield ("design", "yield"), NO_TOLERANCE
    if design.tolerances and not spec.part_requirements:
        reported = "whether a part is good is what 'requirements' decide: give at least one beside that on the yield"
        yield ("design", "tolerances"), reported


OF_PLATES = "laser"
"""How links and cams are made that say nothing of a material: as the prototype of Sanchez-Salinas et al. (2022)."""

MODULUS = "mechanism.material.youngs_modulus"


@dataclass(frozen=True)
class Assumed:
    """Tolerances that are assumed of a part."""

    process: ProcessAccuracy  # how it is made
    kinds: Mapping[str, str]  # path -> in what it errs, "thickness" or "position"
    # from where to where the modulus at `MODULUS` is found [Pa]; None if no source says it
    modulus: tuple[float, float] | None
    # whether beams have materials of their own whose moduli are found in a range, too: they are taken as stated
    as_stated: bool = False
    # path of a spring's rate -> its nominal value [N/m or N m/rad]: found within `SPRING_RATE` of it
    rates: Mapping[str, float] = field(default_factory=dict)

    @property
    def deviations(self) -> dict[str, float]:
        """Path -> standard deviation [m]."""
        return {path: getattr(self.process, kind) for path, kind in self.kinds.items()}

    @property
    def ranges(self) -> dict[str, tuple[float, float]]:
        """Path of a value whose every value in a range is equally likely -> that range: modulus and springs' rates."""
        found = {} if self.modulus is None else {MODULUS: self.modulus}
        ends = 1.0 - SPRING_RATE, 1.0 + SPRING_RATE
        return found | {path: (ends[0] * rate, ends[1] * rate) for path, rate in self.rates.items()}


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
    named = process or getattr(getattr(spec, "design", None), "process", None)
    shared, owned = _materials(spec)
    usually = [usual(one.name, one.modulus) for one in (*shared, *owned)]
    # one process makes the whole part: that of the material that is made least exactly
    accuracy = max(usually, key=lambda one: one.thickness, default=PROCESSES[OF_PLATES])
    own = process_of_part(spec)
    if named:
        accuracy = PROCESSES[named]
    elif own is not None:
        accuracy = own.accuracy(accuracy)
    band = next((found for one in shared if (found := _band(one))), None)
    rates = {path: float(spec.at(path)) for path, kind in kinds.items() if kind == "rate"}
    made = {path: kind for path, kind in kinds.items() if kind != "rate"}
    return Assumed(accuracy, made, band, any(map(_band, owned)), rates)


def _materials(spec: Spec) -> tuple[tuple[MaterialSpec, ...], tuple[MaterialSpec, ...]]:
    """Return the material of a mechanism, where something is made of it, and those that its beams have of their own."""
    mechanism = getattr(spec, "mechanism", None)
    material: MaterialSpec | None = getattr(mechanism, "material", None)
    beams = getattr(mechanism, "beams", None)
    own = [getattr(beam, "material", None) for beam in beams.values()] if isinstance(beams, dict) else []
    shared = () if material is None or (own and None not in own) else (material,)
    return shared, tuple(one for one in own if one is not None)


def _band(material: MaterialSpec) -> tuple[float, float] | None:
    """Return from where to where the modulus of a material is found [Pa], if it is that of its name."""
    known = MATERIALS.get(material.name or "")
    return known.scatter.youngs_modulus if known and material.modulus == known.youngs_modulus else None


def process_of_part(spec: Spec) -> PartProcess | None:
    """Return how a part is made, as `mechanism.part.process` says; None: unsaid."""
    mechanism = getattr(spec, "mechanism", None)
    blocks = (getattr(mechanism, name, None) for name in ("part", "plate"))
    return next((one for block in blocks if (one := getattr(block, "process", None))), None)


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
    return stated | {path: Tolerance(uniform=f"{100.0 * SPRING_RATE:g} %") for path in found.rates}
