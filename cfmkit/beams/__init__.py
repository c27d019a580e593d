"""Planar networks of slender beams in large deflection: one engine for all families that bend.

`Network` says what it is, a `Displacement`, `Rotation` or `Loading` what is done to it, `trace` follows the
equilibria, `Path` answers questions about them. Compiled code is loaded, and compiled once, when something is solved.

References
----------
[LL] C.-C. Lan, K.-M. Lee, ASME J. Mech. Des. 128 (2006) 765: the generalised (multiple) shooting method.
[R] E. Reissner, Z. angew. Math. Phys. 23 (1972) 795: the beam theory.
[D] M. Redheffer's star product, used to chain segments: J. Math. Phys. 41 (1962) 1.
"""

from __future__ import annotations

from cfmkit.beams.batch import Outcome, trace_many
from cfmkit.beams.beam import Beam
from cfmkit.beams.drive import Control, Displacement, Loading, Rotation
from cfmkit.beams.gradient import Gradient, gradient
from cfmkit.beams.network import (
    CLAMPED,
    FREE,
    PINNED,
    LineLoad,
    LineSpring,
    Link,
    Network,
    Node,
    PointLoad,
    SlideSpring,
    Support,
    TorsionSpring,
    guided,
)
from cfmkit.beams.path import Event, Path, PathStatus
from cfmkit.beams.section import Section, Taper
from cfmkit.beams.shapes import STRAIGHT, CosineArch, Polyline, Polynomial, Spline, arc
from cfmkit.beams.tracing import trace

__all__ = [
    "CLAMPED",
    "FREE",
    "PINNED",
    "STRAIGHT",
    "Beam",
    "Control",
    "CosineArch",
    "Displacement",
    "Event",
    "Gradient",
    "LineLoad",
    "LineSpring",
    "Link",
    "Loading",
    "Network",
    "Node",
    "Outcome",
    "Path",
    "PathStatus",
    "PointLoad",
    "Polyline",
    "Polynomial",
    "Rotation",
    "Section",
    "SlideSpring",
    "Spline",
    "Support",
    "Taper",
    "TorsionSpring",
    "arc",
    "gradient",
    "guided",
    "trace",
    "trace_many",
]
