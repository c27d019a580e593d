"""Planar networks of slender beams in large deflection: equilibria, contacts, stresses, derivatives, frequencies.

`Network` says what it is, a `Displacement`, `Rotation` or `Loading` what is done to it, `trace` follows the
equilibria, `Path` answers questions about them.

References
----------
[R] E. Reissner, Z. angew. Math. Phys. 23 (1972) 795: the beam theory.
[Re] E. Reissner, J. Math. Phys. 29 (1950) 90: the mixed functional.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from cfmkit.lazy_names import lazy_names

if TYPE_CHECKING:
    from cfmkit.elastica.mechanics.march import engine
    from cfmkit.elastica.model.beam import Beam, fit
    from cfmkit.elastica.model.contact import (
        BeamOnBeam,
        BeamOnObstacle,
        BeamSide,
        NodeOnBeam,
        NodeOnObstacle,
        ObstacleEdge,
        Stop,
        arc_edge,
        circle_edge,
        line_edge,
        polyline_edge,
    )
    from cfmkit.elastica.model.drive import Control, Displacement, Loading, Rotation
    from cfmkit.elastica.model.network import (
        CLAMPED_SUPPORT,
        FREE_SUPPORT,
        PINNED_SUPPORT,
        LineLoad,
        LineSpring,
        Link,
        Network,
        Node,
        PointLoad,
        SlideSpring,
        Support,
        TorsionSpring,
        slider_support,
    )
    from cfmkit.elastica.model.section import Section, Taper
    from cfmkit.elastica.model.shapes import STRAIGHT_SHAPE, Bent, CosineArch, Polyline, Polynomial, Spline, arc
    from cfmkit.elastica.results.curling_stiffening import HinderedCurling, hindered_curling
    from cfmkit.elastica.results.path import EquilibriumPath as Path
    from cfmkit.elastica.results.path import Event, PathStatus
    from cfmkit.elastica.sensitivity import Gradient, gradient
    from cfmkit.elastica.tracing.trace import trace
    from cfmkit.elastica.tracing.trace_many import NetworkOutcome, trace_many
    from cfmkit.elastica.vibration import NetworkMasses, frequencies

__getattr__, _ = lazy_names(
    __name__,
    {
        "mechanics.march": "engine",
        "model.beam": "Beam fit",
        "model.contact": (
            "BeamOnBeam BeamOnObstacle BeamSide NodeOnBeam NodeOnObstacle ObstacleEdge Stop arc_edge circle_edge "
            "line_edge polyline_edge"
        ),
        "model.drive": "Control Displacement Loading Rotation",
        "model.network": (
            "CLAMPED_SUPPORT FREE_SUPPORT PINNED_SUPPORT LineLoad LineSpring Link Network Node PointLoad "
            "SlideSpring Support TorsionSpring slider_support"
        ),
        "model.section": "Section Taper",
        "model.shapes": "STRAIGHT_SHAPE Bent CosineArch Polyline Polynomial Spline arc",
        "results.curling_stiffening": "HinderedCurling hindered_curling",
        "sensitivity": "Gradient gradient",
        "results.path": "Event Path PathStatus",
        "tracing.trace": "trace",
        "tracing.trace_many": "NetworkOutcome trace_many",
        "vibration": "NetworkMasses frequencies",
    },
)

__all__ = [
    "CLAMPED_SUPPORT",
    "FREE_SUPPORT",
    "PINNED_SUPPORT",
    "STRAIGHT_SHAPE",
    "Beam",
    "BeamOnBeam",
    "BeamOnObstacle",
    "BeamSide",
    "Bent",
    "Control",
    "CosineArch",
    "Displacement",
    "Event",
    "Gradient",
    "HinderedCurling",
    "LineLoad",
    "LineSpring",
    "Link",
    "Loading",
    "Network",
    "NetworkMasses",
    "NetworkOutcome",
    "Node",
    "NodeOnBeam",
    "NodeOnObstacle",
    "ObstacleEdge",
    "Path",
    "PathStatus",
    "PointLoad",
    "Polyline",
    "Polynomial",
    "Rotation",
    "Section",
    "SlideSpring",
    "Spline",
    "Stop",
    "Support",
    "Taper",
    "TorsionSpring",
    "arc",
    "arc_edge",
    "circle_edge",
    "engine",
    "fit",
    "frequencies",
    "gradient",
    "hindered_curling",
    "line_edge",
    "polyline_edge",
    "slider_support",
    "trace",
    "trace_many",
]
