"""Exact derivatives of a path's outputs by design variables: implicit differentiation, complex steps of the geometry.

At an equilibrium R(z, x) = 0, so dz/dx = -(dR/dz)^-1 dR/dx, in compiled code (`kernels.design_derivatives`); how
the network changes with x comes from complex steps of the function that builds it (`complex_steps`).
Variables may change positions, shapes, sections, materials, offsets, links' arms, springs, loads, support displacements
and directions; not the number of anything. The drive keeps its values; a support that turns takes its drive with it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.arrays import read_only
from cfmkit.elastica.model.drive import Loading
from cfmkit.elastica.sensitivity import output_derivatives
from cfmkit.elastica.sensitivity.output_derivatives import Slopes

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.model.network import Network
    from cfmkit.elastica.outcome.path import Path
    from cfmkit.elastica.sensitivity.output_derivatives import SectionSlopes


@dataclass(frozen=True, eq=False)
class Gradient(Slopes):
    """Derivatives at p chosen points of a path by k design variables; each output is computed when first needed."""

    @cached_property
    def effort(self) -> FloatArray:
        """Derivatives of `Path.effort`, (p, k)."""
        layout = self.path.layout
        if isinstance(layout.drive, Loading):
            return read_only(output_derivatives.load_displacement(self, layout.drive))
        dof, sense = layout.driven  # type: ignore[misc]
        unit = layout.scales.moment if dof == layout.first[layout.drive.node] + 2 else layout.scales.force
        if self.path.solver.model.load_follows.any():
            return read_only(-sense * unit * self.held[:, dof])
        return read_only(-unit * self.push)

    @property
    def motion(self) -> Mapping[str, FloatArray]:
        """Node -> (p, 3, k) derivatives of `Path.motion`, of linked nodes too."""
        return _Lookup(self, output_derivatives.motion)

    @property
    def reaction(self) -> Mapping[str, FloatArray]:
        """Node -> (p, 3, k) derivatives of `Path.reaction`."""
        return _Lookup(self, output_derivatives.reaction)

    def end_force(self, beam: str, end: int) -> FloatArray:
        """Return the derivatives of `Path.end_force`, (p, 3, k)."""
        s, scales = self.path.solver, self.path.layout.scales
        index = list(self.path.layout.network.beams).index(beam)
        at = s.n_free + 3 * index if end == 1 else s.n + 6 * int(s.cut.beam_segment[index]) + 3
        units = np.array([scales.force, scales.force, scales.moment])
        return read_only(self.unknowns[:, at : at + 3] * units[:, None])

    @cached_property
    def energy(self) -> FloatArray:
        """Derivatives of `Path.energy`, (p, k)."""
        return read_only(output_derivatives.energy(self))

    def shape(self, beam: str) -> FloatArray:
        """Return the derivatives of `Path.shape`, (p, n, 2, k): of material points of the beam."""
        return read_only(output_derivatives.shape(self, beam))

    def sections(self, beam: str) -> SectionSlopes:
        """Return the derivatives of `Path.sections`; arrays (p, n, k)."""
        return output_derivatives.sections(self, beam)

    def stress_extremes(self, beam: str, axial: bool = True) -> FloatArray:
        """Return the derivatives of the values of `Path.stress_extremes`, (p, 2, 2, k).

        An extreme inside a beam stays one while its place moves, so that its place needs no derivative (envelope
        theorem).
        """
        return read_only(output_derivatives.stress_extremes(self, beam, axial))


class _Lookup(Mapping[str, Any]):
    """Derivatives by node, computed when needed."""

    def __init__(self, gradient: Gradient, output: Callable[[Gradient, str], FloatArray]) -> None:
        self.gradient, self.output = gradient, output

    def __getitem__(self, node: str) -> FloatArray:
        return read_only(self.output(self.gradient, node))

    def __iter__(self) -> Iterator[str]:
        return iter(self.gradient.path.layout.network.nodes)

    def __len__(self) -> int:
        return len(self.gradient.path.layout.network.nodes)


def gradient(path: Path, build: Callable[[Any], Network], variables: Any, points: Any = None) -> Gradient:
    """Return the derivatives of a path's outputs by design variables.

    Parameters
    ----------
    path : Path
        A path of ``build(variables)``.
    build : callable
        From the design variables (real or complex) to the network, or to the network and its drive where variables
        change loads or direction of the drive.
    variables : (k,) array
        Where to differentiate: the variables that the path was traced for.
    points : sequence of int, optional
        Points of the path; all those requested by default.

    Raises
    ------
    cfmkit.errors.InputError
        If a variable changes how the network is made up, moves a corner of a beam and a step of its thickness past
        each other, or moves one side of a step only. Outputs raise it where the tangent is singular at a point.
    """
    from cfmkit.elastica.sensitivity.complex_steps import ComplexSteps

    solver = path.solver
    complex_steps = ComplexSteps(path.layout, build, variables)
    design = complex_steps.arrays(solver.model, solver.cut)
    chosen = np.asarray(path.at_requested if points is None else points, dtype=np.int64)
    return Gradient(path, read_only(chosen, np.int64), complex_steps, design)
