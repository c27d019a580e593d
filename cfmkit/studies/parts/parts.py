"""Parts as they are made of a specification: what errs, by how much, and parts drawn at random.

Errors are those that a block `design` or `sensitivity` states, else those that the process is assumed to cause, each
with its reason: the tolerances of a process (`stock.processes`), and the spread of the modulus that `show materials`
has a source for. Whoever draws parts, a study, a design or a proposal, draws the same ones from the same seed.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.errors import SpecError
from cfmkit.families import family
from cfmkit.specs.spec import DesignKeys
from cfmkit.specs.study_spec import Sensitivity, Tolerance
from cfmkit.stock.materials import MATERIALS_BY_NAME
from cfmkit.stock.processes import PROCESSES_BY_NAME, SPRING_RATE, usual_process
from cfmkit.studies.parts.uncertain_values import correlations, draw, groups, parameters_of, values_at
from cfmkit.studies.variations import CannotVary, leaf

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from cfmkit.arrays import FloatArray
    from cfmkit.specs.spec import DesignBlock, Spec
    from cfmkit.stock.material_and_part_spec import MaterialSpec, PartProcess
    from cfmkit.stock.processes import ProcessAccuracy
    from cfmkit.studies.parts.uncertain_values import Parameter


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
    band = next((known_band for block in shared if (known_band := _band(block))), None)
    rates = {path: float(spec.get_value(path)) for path, kind in kinds.items() if kind == "rate"}
    made = {path: kind for path, kind in kinds.items() if kind != "rate"}
    return Assumed(accuracy, made, band, any(map(_band, owned)), rates)


def accuracy_of(spec: Spec, process: str | None = None) -> ProcessAccuracy:
    """Return what is held by a process, by the one that the specification names, or by the usual one."""
    named = process or getattr(getattr(spec, "design", None), "process", None)
    if named:
        return PROCESSES_BY_NAME[named]
    usually = [usual_process(entry.name, entry.modulus) for group in _materials(spec) for entry in group]
    # one process makes the whole part: that of the material that is made least exactly
    accuracy = max(usually, key=lambda entry: entry.thickness, default=PROCESSES_BY_NAME[OF_PLATES])
    private = process_of_part(spec)
    return accuracy if private is None else private.accuracy(accuracy)


def tolerances(spec: Spec, process: str | None = None) -> dict[str, Any]:
    """Return the same in the words of `design.tolerances`; nothing of no part."""
    assumed = assume_errors(spec, process)
    if assumed is None:
        return {}
    stated: dict[str, Any] = {
        path: Tolerance(normal=f"{1e3 * sigma:.9g} mm") for path, sigma in assumed.deviations.items()
    }
    if assumed.modulus is not None:
        low, high = assumed.modulus
        stated[MODULUS_KEY] = (f"{low / 1e6:.9g} MPa", f"{high / 1e6:.9g} MPa")
    return stated | {path: Tolerance(uniform=f"{100.0 * SPRING_RATE:g} %") for path in assumed.rates}


def _materials(spec: Spec) -> tuple[tuple[MaterialSpec, ...], tuple[MaterialSpec, ...]]:
    """Return the material of a mechanism, where something is made of it, and those that its beams have of their own."""
    mechanism = getattr(spec, "mechanism", None)
    material: MaterialSpec | None = getattr(mechanism, "material", None)
    beams = getattr(mechanism, "beams", None)
    materials = [getattr(beam, "material", None) for beam in beams.values()] if isinstance(beams, dict) else []
    shared = () if material is None or (materials and None not in materials) else (material,)
    return shared, tuple(material for material in materials if material is not None)


def _band(material: MaterialSpec) -> tuple[float, float] | None:
    """Return the range of the modulus of a material [Pa], if it is that of its name."""
    listed = MATERIALS_BY_NAME.get(material.name or "")
    return listed.scatter.youngs_modulus if listed and material.youngs_modulus == listed.youngs_modulus else None


def process_of_part(spec: Spec) -> PartProcess | None:
    """Return how a part is made, as `mechanism.part.process` says; None: unsaid."""
    mechanism = getattr(spec, "mechanism", None)
    blocks = (getattr(mechanism, name, None) for name in ("part", "plate"))
    return next((process for block in blocks if (process := getattr(block, "process", None))), None)


NO_TOLERANCE = "no value of this part is known to err by its process: state 'design.tolerances'"

Seed = int | list[int]


@dataclass(frozen=True)
class Parts:
    """Parts of a specification, with the errors of their values."""

    spec: Spec  # what is made
    parameters: tuple[Parameter, ...]  # what errs, lists taken apart
    correlated: tuple[tuple[tuple[int, ...], float], ...]  # numbers of parameters, correlation of each two of them
    correlation: FloatArray  # (d, d) of the normal scores
    samples: int  # how many parts are drawn
    seed: int  # of the generator
    sampling: str | None = None  # one of `SAMPLE_KINDS`; None: at random

    @classmethod
    def from_block(cls, spec: Spec, block: Sensitivity, samples: int, seed: int) -> Parts:
        """Return the parts whose errors are the parameters of a block.

        Raises SpecError with every fault, at ``sensitivity.parameters`` and the path.
        """
        parameters = parameters_of(spec, block)
        paths = tuple(parameter.path for parameter in parameters)
        return cls(spec, parameters, groups(block, paths), correlations(block, paths), samples, seed, block.sampling)

    @classmethod
    def from_design(cls, spec: Spec, design: DesignBlock, seed: int) -> Parts | None:
        """Return the parts of a specification with the tolerances of a `design` block or of its process; None if none.

        Raises SpecError if a path is not in the specification, at ``design.tolerances`` and the path.
        """
        stated = stated_tolerances(spec, design)
        if not stated:
            return None
        try:
            return cls.from_block(spec, _make_block(stated, design.correlated), *_count_and_seed(spec, design, seed))
        except SpecError as error:
            raise SpecError(
                [replace(problem, path=_to_design_path(problem.path)) for problem in error.problems]
            ) from None

    @classmethod
    def from_expected_errors(cls, spec: Spec, seed: int) -> tuple[Parts | None, str]:
        """Return the parts that a shop will make, by stated or else by assumed errors, and in words whose errors."""
        design = getattr(spec, "design", None)
        if not isinstance(design, DesignKeys):
            return None, ""
        if design.tolerances_of(spec)[0]:
            return cls.from_design(spec, design, seed), "within design.tolerances"
        assumed = assume_errors(spec)
        if assumed is None:
            return None, ""
        return cls.from_assumed_errors(spec, seed), f"made by {assumed.process.name} (assumed tolerances)"

    @classmethod
    def from_assumed_errors(cls, spec: Spec, seed: int) -> Parts:
        """Return the parts that a process is assumed to make, for a specification some of whose values err by it."""
        design = getattr(spec, "design", None)
        count_and_seed = _count_and_seed(spec, design, seed) if isinstance(design, DesignKeys) else (0, seed)
        return cls.from_block(spec, _make_block(tolerances(spec)), *count_and_seed)

    @property
    def paths(self) -> tuple[str, ...]:
        """Paths of the values that err."""
        return tuple(parameter.path for parameter in self.parameters)

    @cached_property
    def nominal(self) -> FloatArray:
        """The values of a perfect part, (d,) [SI]."""
        return np.array([parameter.spread.nominal for parameter in self.parameters])

    @cached_property
    def deviations(self) -> FloatArray:
        """Standard deviations of the errors, (d,) [SI]."""
        return np.array([parameter.spread.standard_deviation for parameter in self.parameters])

    def unit(self, samples: int, seed: Seed) -> FloatArray:
        """Return the shares of all parts that lie below each value of drawn parts, (n, d)."""
        return draw(self.correlation, samples, seed, self.sampling)

    def draw(self, samples: int | None = None, seed: Seed | None = None) -> FloatArray:
        """Return the values of drawn parts, (n, d) [SI]; of another seed those that no search has seen."""
        unit = self.unit(samples or self.samples, self.seed if seed is None else seed)
        return values_at([parameter.spread for parameter in self.parameters], unit)

    def part(self, values: FloatArray) -> Spec:
        """Return the specification of one part, of its values (d,)."""
        return self.spec.replace(dict(zip(self.paths, values.tolist(), strict=True)), as_made=True)

    def remove_errors(self, values: FloatArray, members: tuple[int, ...]) -> FloatArray:
        """Return the values of the same parts without the errors of some parameters."""
        still = values.copy()
        still[:, members] = self.nominal[list(members)]
        return still

    @property
    def joined(self) -> list[tuple[int, ...]]:
        """Parameters that deviate as one: those correlated by 1 together, each other one alone."""
        many = [members for members, correlation in self.correlated if correlation == 1.0]
        taken = {k for members in many for k in members}
        return [*many, *((k,) for k in range(len(self.parameters)) if k not in taken)]


def _make_block(stated: dict[str, Any], correlated: tuple[Any, ...] = ()) -> Sensitivity:
    return Sensitivity.model_construct(method="tolerance", parameters=stated, correlated=correlated, metrics=())


def _count_and_seed(spec: Spec, design: DesignKeys, seed: int) -> tuple[int, int]:
    return design.tolerances_of(spec)[1], seed if design.seed is None else design.seed


def stated_tolerances(spec: Spec, design: DesignBlock) -> dict[str, Any]:
    """Return the tolerances that a `design` block gives, else those of the process that it or the part names."""
    stated = design.tolerances_of(spec)[0]
    return dict(stated) if stated or not is_made(spec, design) else tolerances(spec)


def is_made(spec: Spec, design: DesignBlock) -> bool:
    """Return True if it is said how parts are made: by a block `design`, or of a part whose yield is requested."""
    if design.tolerances_of(spec)[0] or design.process is not None:
        return True
    asked = getattr(design, "yield") is not None or len(spec.part_requirements) < len(spec.requirements)
    return asked and process_of_part(spec) is not None


def errs_nowhere(spec: Spec, design: DesignBlock) -> bool:
    """Return True if no value of a part that `is_made` errs; of a solid that is seen only once it is drawn."""
    return spec.fidelity != "solid" and not stated_tolerances(spec, design)


def _to_design_path(path: str) -> str:
    """Return the path in a block `design` that stands for a path in a block `sensitivity`."""
    head, _, rest = path.partition(".parameters.")
    return f"design.tolerances.{rest}" if rest else head.replace("sensitivity", "design", 1)


def faults(spec: Spec, design: DesignBlock) -> Iterator[tuple[tuple[str | int, ...], str]]:
    """Yield what is wrong with a block's keys on made parts as far as that can be seen before anything is designed."""
    for path in design.tolerances or ():
        try:
            place = leaf(type(spec), path.replace(".*", ".0"))
        except CannotVary as problem:
            yield ("design", "tolerances", path), str(problem)
            continue
        if place.kind not in ("quantity", "number"):
            yield ("design", "tolerances", path), f"{path!r} does not vary continuously"
    for path in design.free:
        try:
            leaf(type(spec), path)
        except CannotVary as problem:
            yield ("design", "free", path), str(problem)
    wanted = getattr(design, "yield") is not None
    if design.robust is not None and not wanted:
        yield ("design", "robust"), "says how a yield is reached: give 'design.yield', too"
    if wanted and not is_made(spec, design):
        lacking = "a yield is a share of manufactured parts: state their tolerances in 'design.tolerances'"
        yield ("design", "yield"), lacking
    elif wanted and errs_nowhere(spec, design):
        yield ("design", "yield"), NO_TOLERANCE
    if design.tolerances and not spec.part_requirements:
        reported = "whether a part is good is what 'requirements' decide: give at least one beside that on the yield"
        yield ("design", "tolerances"), reported
