"""Materials of mechanisms: the library of named materials, and how a specification names or describes one."""

from cfmkit.stock.materials import MATERIALS, Material, UnknownMaterial, material

__all__ = ["MATERIALS", "Material", "UnknownMaterial", "material"]
