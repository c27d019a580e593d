"""What solved equilibria of the functional say: states, section forces and stresses along beams, the `Path` of a drive.

Arrays have the points of the path as first axis; functions of equilibria take complex steps, so that their derivatives
by design variables need no code of their own (`cfmkit.elastica.results.output_slopes`).
"""
