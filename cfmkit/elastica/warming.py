"""Compiling the engine ahead of its first use: for images, caches of pipelines, and whoever does not want to wait."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.elastica.continuation.trace_to_tolerance import trace
from cfmkit.elastica.model.beam import Beam
from cfmkit.elastica.model.drive import Displacement
from cfmkit.elastica.model.network import CLAMPED, Network, Node
from cfmkit.elastica.model.section import Section
from cfmkit.elastica.sensitivity.output_derivatives import gradient

if TYPE_CHECKING:
    from collections.abc import Iterator


@dataclass(frozen=True)
class CompiledPart:
    """A part of the compiled code, and how long it took to get it [s]: hardly any time where it was there before."""

    name: str
    seconds: float


def warm() -> Iterator[CompiledPart]:
    """Load the engine's compiled code, part by part; what has not been compiled yet is, and is kept.

    Yields
    ------
    CompiledPart
        In the order in which a run needs them.
    """
    began = time.perf_counter()
    x = np.array([1e-3])
    path = trace(_pulled(x), Displacement("b", 0.0, np.array([1e-4])))
    yield CompiledPart("equilibria and paths", time.perf_counter() - began)
    for name, output in (
        ("states along beams", lambda: path.peak_stress()),
        ("derivatives of forces", lambda: gradient(path, _pulled, x).effort),
        ("derivatives of reactions", lambda: gradient(path, _pulled, x).held),
        ("derivatives of stresses", lambda: gradient(path, _pulled, x).stress_extremes("x")),
    ):
        began = time.perf_counter()
        output()
        yield CompiledPart(name, time.perf_counter() - began)


def _pulled(x: Any) -> Network:
    """Return a beam between a clamp and a free node; the variable is its thickness [m]."""
    nodes = {"a": Node(0.0, 0.0, CLAMPED), "b": Node(0.1, 0.0)}
    return Network(nodes, {"x": Beam("a", "b", Section(2e9, 1e-2, x[0]))})
