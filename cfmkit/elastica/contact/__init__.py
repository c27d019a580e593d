"""Contact of beam networks: exact, by an active set, with located events.

The force f of a contact is an unknown, and the functional P of the network becomes P - f g - f^2/(2 k): its stationary
points have the gap g = -f/k (0 where the contact is rigid) where a contact is closed; where it is open its force is 0.
Both at once are the complementarity f >= 0, g + f/k >= 0, f (g + f/k) = 0.

References
----------
[W] P. Wriggers, Computational Contact Mechanics (2006), sec. 5: active sets, Lagrange multipliers.
[HIK] M. Hintermueller, K. Ito, K. Kunisch, SIAM J. Optim. 13 (2003) 865: an active set as Newton's method.
"""
