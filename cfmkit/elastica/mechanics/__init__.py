"""The mechanics of a network as one functional: elements, their energy with gradient and Hessian, inertia.

A mixed (Hellinger-Reissner) spectral element: the rotation of its sections is a polynomial, the force on its last
section two multipliers,

    P = sum_e { int EI phi'^2 / 2 ds + n1 . (X1 - X0) - q . X0 l - int V(theta, n(s)) ds } + springs - loads,
    V = N + (N^2 / EA + Q^2 / GA) / 2,    theta = eta + phi,    n(s) = n1 + q (l - s),

stationary in the rotations and in n. Beams that neither stretch nor shear have 1/EA = 1/GA = 0 and are no special
case. The Hessian is symmetric unless loads follow; its negative pivots, less two an element, are the unstable
directions, on any mesh.

References
----------
[R] E. Reissner, Z. angew. Math. Phys. 23 (1972) 795: the beam theory.
[Re] E. Reissner, J. Math. Phys. 29 (1950) 90: the mixed functional.
[Ha] E. V. Haynsworth, Linear Algebra Appl. 1 (1968) 73: the inertia of a partitioned matrix.
"""
