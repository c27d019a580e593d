"""Planar finite elements on the outline of a part: nodes, fillets and the true boundary, which beams leave out."""

from cfmkit.solid.adaptive_solution import DrivenPart
from cfmkit.solid.meshed_part import HeldOrDriven, Part, rings_of
from cfmkit.solid.path_following import PathEnd
from cfmkit.solid.plane_stress_law import MATERIAL_LAWS

__all__ = ["MATERIAL_LAWS", "DrivenPart", "HeldOrDriven", "Part", "PathEnd", "rings_of"]
