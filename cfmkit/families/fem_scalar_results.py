"""Values that every family gives of a part that is solved as a solid: errors of its mesh, stress concentration."""

from __future__ import annotations

from cfmkit.results import Quantity

DEFINITIONS = {
    "mesh_force_difference": (
        "ratio",
        "largest difference of the force on a coarser mesh, relative to the largest force",
    ),
    "mesh_stress_difference": (
        "ratio",
        "largest difference of a pose's largest stress on a coarser mesh, relative to the largest of all poses",
    ),
    "mesh_force_error": (
        "ratio",
        "discretisation error of the force, relative to the largest force: that difference, at least 1e-4, times a "
        "factor that covers 95 % of the parts in docs/solid.md",
    ),
    "mesh_stress_error": ("ratio", "the same for the largest stress, with a difference of at least 2 %"),
    "curve_error": (
        "ratio",
        "difference between the interpolated curve and poses solved between its poses, where it is expected to be "
        "largest, relative to the largest force; poses are added, up to twice as many, until it is at most 5e-4",
    ),
    "stress_concentration_max": (
        "factor",
        "largest stress of a fillet over that of beams in large deflection at the same displacement: bending and axial "
        "stress of the section where the fillet ends, at its edge; of the fillets where that is at least a tenth of "
        "the beams' largest",
    ),
}
"""Name -> dimension and definition; `cfmkit.solid.two_meshes` and `nominal_stress_beside_fillets` compute them."""


def unknown_to_beams() -> dict[str, Quantity]:
    """Return them without values, for models that are no solid."""
    return {
        name: Quantity(None, *about, "only the model of the part as a solid has it")
        for name, about in DEFINITIONS.items()
    }
