"""Values that every family gives of a part that is solved as a solid: how far its mesh can be trusted."""

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
}
"""Name -> dimension and definition; `cfmkit.solid.two_meshes` computes them."""
