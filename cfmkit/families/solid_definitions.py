"""Values that every family gives of a part that is solved as a solid: errors of its mesh, stress concentration."""

from __future__ import annotations

DEFINITIONS = {
    "mesh_force_difference": ("ratio", "largest difference of the force on a coarser mesh, in parts of the largest"),
    "mesh_stress_difference": (
        "ratio",
        "largest difference of a pose's largest stress on a coarser mesh, in parts of the largest of all poses",
    ),
    "mesh_force_error": (
        "ratio",
        "error of the force by the mesh, in parts of the largest: that difference, 1e-4 at least, times a factor below "
        "which 95 % of the errors of the parts in docs/solid.md are",
    ),
    "mesh_stress_error": ("ratio", "the same of the largest stress, whose difference counts as 2 % at least"),
    "curve_error": (
        "ratio",
        "largest difference of the curve between poses and of poses solved there, where it is expected to be largest, "
        "in parts of the largest force; poses are added until it is 5e-4 at most, twice as many at most",
    ),
    "stress_concentration_max": (
        "factor",
        "largest stress of a fillet over that of beams in large deflection at the same displacement: bending and axial "
        "stress of the section where the fillet ends, at its edge; of the fillets where that is at least a tenth of "
        "the beams' largest",
    ),
}
"""Name -> dimension and definition; `cfmkit.solid.two_meshes` and `nominal_stress` compute them."""
