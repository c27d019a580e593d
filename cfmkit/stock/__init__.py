"""Materials of mechanisms: the library of named materials, and how a specification names or describes one."""

from cfmkit.stock.materials import MATERIALS_BY_NAME, Material, UnknownMaterial, material
from cfmkit.stock.processes import PROCESSES_BY_NAME
from cfmkit.stock.stock_series import series_of

__all__ = ["MATERIALS_BY_NAME", "PROCESSES_BY_NAME", "Material", "UnknownMaterial", "material", "series_of"]
