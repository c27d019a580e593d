"""Springs that can be bought: own lists, and a generic series that is computed from wire, coil and turns."""

from cfmkit.stock.springs.wire_materials import WIRES_BY_NAME

__all__ = ["WIRES_BY_NAME"]
