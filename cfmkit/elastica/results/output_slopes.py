"""Derivatives of any output of equilibria by design variables: a complex step through the function that computes it.

The unknowns' derivatives come from the tangent (`unknown_slopes`); what an output depends on besides, the network and
its arrays, has a complex step already. So an output is differentiated by computing it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.elastica.mechanics.design_derivatives import Equilibria, unknown_slopes
from cfmkit.elastica.mechanics.designs import design_of
from cfmkit.elastica.mechanics.equations import COMPLEX_STEP

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.mechanics.designs import NetworkDesigns
    from cfmkit.elastica.model.network import Network

    Output = Callable[[Network, Equilibria], Any]


def output_slopes(
    at: Equilibria, designs: NetworkDesigns, outputs: Mapping[str, Output], slopes: FloatArray | None = None
) -> dict[str, FloatArray]:
    """Return the derivatives of outputs by variables, each (..., k) for an output (...).

    Parameters
    ----------
    at : Equilibria
        Of the designs' template, at p points.
    designs : NetworkDesigns
        A complex step of `COMPLEX_STEP` in each of k variables.
    outputs : mapping
        Functions of a model and its equilibria, analytic in both: `beam_states`, `node_motion`, `strain_energy`.
    slopes : (p, k, size) array, optional
        Derivatives of the unknowns, if they are known.

    Raises
    ------
    numpy.linalg.LinAlgError
        If a tangent is singular.
    """
    known = unknown_slopes(at, designs) if slopes is None else slopes
    found: dict[str, list[Any]] = {name: [] for name in outputs}
    for number, (network, _) in enumerate(designs.networks):
        moved = Equilibria(design_of(designs, number), at.z + 1j * COMPLEX_STEP * known[:, number], at.drive)
        for name, output in outputs.items():
            found[name].append(np.imag(output(network, moved)) / COMPLEX_STEP)
    return {name: np.stack(columns, axis=-1) for name, columns in found.items()}
