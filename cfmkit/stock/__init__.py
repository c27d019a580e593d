"""Materials of mechanisms: the library of named materials, and how a specification names or describes one."""

from cfmkit.stock.materials import MATERIALS_BY_NAME, Material, UnknownMaterial, material

__all__ = ["MATERIALS_BY_NAME", "Material", "UnknownMaterial", "material"]
