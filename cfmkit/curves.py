"""Force-displacement curves as values: ordered by path, read-only, in SI units.

A curve keeps the order in which the mechanism passes through its states. It is
never sorted and never interpolated across a fold.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from cfmkit.arrays import FloatArray, LazyMapping, Named, ShortRepr, read_only

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from numpy.typing import NDArray

Kind = Literal["force", "torque"]


@dataclass(frozen=True, repr=False)
class Column(ShortRepr):
    """One more column of a curve: values in SI and the dimension that names their unit.

    `dimension` is a name of `cfmkit.specs.units` ("force", "length", "ratio", ...), or "text" for labels.
    """

    values: NDArray[Any]
    dimension: str

    def __post_init__(self) -> None:
        dtype: Any = np.str_ if self.dimension == "text" else np.float64
        object.__setattr__(self, "values", read_only(self.values, dtype))


@dataclass(frozen=True)
class Curve(ShortRepr):
    """A force over a displacement, or a torque over an angle.

    Parameters
    ----------
    motion : (n,) array
        Displacement [m] or angle [rad], in the order of the path.
    effort : (n,) array
        Force [N] or torque [N m] at those places.
    branch : (n,) array of str
        Name of the branch each point belongs to ("load", "unload", ...); one name for all points is enough.
    stable : (n,) array of bool
        Whether the equilibrium is stable under the drive; one value for all points is enough.
    extra : mapping
        Further columns by name, e.g. ``contact_force``; those of a `LazyMapping` are computed when they are read.
    kind : {"force", "torque"}
        Which pair `motion` and `effort` are.
    label : mapping
        The value that distinguishes this curve from others of the same run,
        name -> (SI value, dimension), e.g. ``{"preload": (0.0025, "length")}``,
        or a word: ``{"fidelity": ("dynamic", "text")}``.
    """

    motion: FloatArray
    effort: FloatArray
    branch: NDArray[np.str_] = "load"  # type: ignore[assignment]  # an array as soon as there is a curve
    stable: NDArray[np.bool_] = True  # type: ignore[assignment]
    extra: Mapping[str, Column] = field(default_factory=dict)
    kind: Kind = "force"
    label: Mapping[str, tuple[float | str, str]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name, dtype in (("motion", float), ("effort", float), ("branch", np.str_), ("stable", bool)):
            values = getattr(self, name)
            value = np.full(len(self.motion), values) if isinstance(values, str | bool) else values
            object.__setattr__(self, name, read_only(value, dtype))
        object.__setattr__(self, "label", MappingProxyType(dict(self.label)))
        lengths = {self.motion.shape, self.effort.shape, self.branch.shape, self.stable.shape}
        if not isinstance(self.extra, LazyMapping):
            object.__setattr__(self, "extra", MappingProxyType(Named(self.extra)))
            lengths |= {column.values.shape for column in self.extra.values()}
        if len(lengths) != 1 or self.motion.ndim != 1:
            raise ValueError(f"columns of one curve must have one length, got {sorted(map(str, lengths))}")

    def __reduce__(self) -> tuple[Any, ...]:
        """Return what pickling needs (mapping proxies do not pickle)."""
        extra, label = dict(self.extra), dict(self.label)
        return type(self), (self.motion, self.effort, self.branch, self.stable, extra, self.kind, label)

    def __len__(self) -> int:
        return len(self.motion)

    @property
    def displacement(self) -> FloatArray:
        """Displacement of a force curve [m]."""
        return self._require_kind("force", self.motion, "displacement")

    @property
    def force(self) -> FloatArray:
        """Force of a force curve [N]."""
        return self._require_kind("force", self.effort, "force")

    @property
    def angle(self) -> FloatArray:
        """Angle of a torque curve [rad]."""
        return self._require_kind("torque", self.motion, "angle")

    @property
    def torque(self) -> FloatArray:
        """Torque of a torque curve [N m]."""
        return self._require_kind("torque", self.effort, "torque")

    def _require_kind(self, kind: Kind, values: FloatArray, name: str) -> FloatArray:
        if self.kind != kind:
            raise AttributeError(f"this is a {self.kind} curve: it has no {name}")
        return values

    @property
    def motion_name(self) -> str:
        """The name of the motion column: ``displacement`` or ``angle``."""
        return "displacement" if self.kind == "force" else "angle"

    @property
    def motion_dimension(self) -> str:
        """The dimension of the motion column: ``length`` or ``angle``."""
        return "length" if self.kind == "force" else "angle"

    @property
    def branches(self) -> tuple[str, ...]:
        """The names of the branches, in the order in which they first occur."""
        return tuple(dict.fromkeys(self.branch.tolist()))

    def columns(self) -> Iterator[tuple[str, Column]]:
        """Yield every column of the curve by name, in the order of the CSV."""
        yield "branch", Column(self.branch, "text")
        yield self.motion_name, Column(self.motion, self.motion_dimension)
        yield self.kind, Column(self.effort, self.kind)
        yield "stable", Column(np.where(self.stable, "true", "false"), "text")
        yield from self.extra.items()

    def __repr__(self) -> str:
        low, high = (f"{float(end(self.motion)):.4g}" for end in (np.min, np.max)) if len(self.motion) else ("", "")
        reach = f"{low} ... {high} {'m' if self.kind == 'force' else 'rad'}, " if low else ""
        names = ", ".join(self.branches[:10])
        return f"<Curve of {self.kind} over {self.motion_name}: {len(self.motion)} points, {reach}branches {names}>"

    def take(self, keep: NDArray[Any]) -> Curve:
        """Return the curve at the points that `keep` (indices or a mask) selects."""
        extra = LazyMapping(self.extra, lambda name: Column(self.extra[name].values[keep], self.extra[name].dimension))
        return Curve(
            self.motion[keep], self.effort[keep], self.branch[keep], self.stable[keep], extra, self.kind, self.label
        )

    def select_branch(self, branch: str) -> Curve:
        """Return the points of one branch, in path order."""
        return self.take(self.branch == branch)
