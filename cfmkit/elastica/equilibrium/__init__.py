"""Equilibrium on a mesh: segments and steps, unknowns, single solutions and marches."""
