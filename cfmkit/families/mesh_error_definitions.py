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
    "mesh_stress_error": ("ratio", "the same of the largest stress, whose difference counts as 1 % at least"),
}
"""Name -> dimension and definition; `cfmkit.solid.two_meshes` computes them."""
