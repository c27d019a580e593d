"""Planar finite elements on the outline of a part: nodes, fillets and the true boundary, which beams leave out."""

from cfmkit.lazy_names import lazy_names

__getattr__, __all__ = lazy_names(
    __name__,
    {
        "adaptive_solution": "DrivenPart",
        "equilibrium": "SolidProblem",
        "meshed_part": "HeldOrDriven Part rings_of",
        "path_following": "PathEnd",
        "plane_stress_law": "MATERIAL_LAWS",
        "stress_along_fillets": "FilletArc",
    },
)
