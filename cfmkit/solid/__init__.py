"""Planar finite elements on the outline of a part: nodes, fillets and the true boundary, which beams leave out."""
