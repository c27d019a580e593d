"""Springs that can be bought: own lists, and a generic series that is computed from wire, coil and turns."""
