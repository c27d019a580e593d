"""Results of equilibria of the functional: states, section forces and stresses along beams, the path of a drive.

Arrays have the points of the path as first axis; functions of equilibria take complex steps, so that their derivatives
by design variables need no code of their own.
"""
