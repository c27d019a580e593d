"""Numerical methods without a mechanism: interpolation, roots, quadrature, fits, optimisation, arcs, continuation."""

from cfmkit.lazy_names import lazy_names

__getattr__, __all__ = lazy_names(
    __name__,
    {
        "arc_chains": "ArcChain points_on",
        "interpolation": "ThroughPoints",
        "rigid_point_registration": "turn_points",
        "roots": "bracketed_root",
        "sqp": "Effort Optimum SearchEnding minimize",
        "unit_cube_samples": "SAMPLE_KINDS",
    },
)
