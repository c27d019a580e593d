"""The symmetric splitting that beams are integrated by: drifts, in which only the rotation changes, and kicks.

A Reissner beam is a Hamiltonian system over its arc length s, with the rotation phi and the place (x, y) as coordinates
and the moment M and the force (h, v) as momenta: H = M^2/2B(s) + V(phi, h, v, s). In a drift phi grows by M times the
integral of ds/B, in a kick M, x and y change at a fixed rotation. The composition is symmetric and symplectic: the
stiffness of a beam is symmetric to rounding on any mesh, however coarse, and a symmetric network stays symmetric. An
explicit Runge-Kutta method has neither property, and its errors act on a bifurcation as an imperfection does.

Along the parameter t of a shape ds/dt, eta (the angle at rest) and B may vary: drifts carry t along and are
integrated exactly, kicks take what they find there. The order, six, is kept since [V, [V, [V, T]]] = 0 whatever
depends on t.

Reference
---------
[BM] S. Blanes, P. C. Moan, J. Comput. Appl. Math. 142 (2002) 313: the method SRKN14, order 6, drift first.
"""

from __future__ import annotations

import numpy as np

_DRIFTS = (
    0.0378593198406116,
    0.102635633102435,
    -0.0258678882665587,
    0.314241403071447,
    -0.130144459517415,
    0.106417700369543,
    -0.00879424312851058,
)
_KICKS = (
    0.09171915262446165,
    0.183983170005006,
    -0.05653436583288827,
    0.004914688774712854,
    0.143761127168358,
    0.328567693746804,
)

DRIFTS = np.array([*_DRIFTS, 1.0 - 2.0 * sum(_DRIFTS), *reversed(_DRIFTS)])
"""Shares of a step that the drifts take, the closing one last; some go backwards."""

KICKS = np.array([*_KICKS, 0.5 - sum(_KICKS), 0.5 - sum(_KICKS), *reversed(_KICKS), 0.0])
"""Shares of a step that the kicks take; in the row of the closing drift there is none."""

ROWS = len(DRIFTS)
"""Rows of a step: a drift and the kick after it, and the closing drift."""

NODES = np.cumsum(DRIFTS)
NODES[-1] = 1.0
"""Places of the kicks within a step, and its end."""
