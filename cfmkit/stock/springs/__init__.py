"""Springs that can be bought: own lists, and a generic series that is computed from wire, coil and turns."""

from cfmkit.stock.springs.helical_spring_formulas import HelicalSpring
from cfmkit.stock.springs.wire_materials import WIRES_BY_NAME

__all__ = ["WIRES_BY_NAME", "HelicalSpring"]
