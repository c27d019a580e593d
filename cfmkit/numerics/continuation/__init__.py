"""Equilibria of a structure under one growing quantity, the drive: followed, with bifurcations and limit points.

It knows no beams and no solids: a structure is a `problem.ContinuationProblem`, which gives its residual, its
tangent and the number of its unstable directions. `follow.follow` is an iterator of the points and events of a path.

References
----------
[Ri] E. Riks, Int. J. Solids Structures 15 (1979) 529: the arc length as the parameter.
[Ke] H. B. Keller, in: Applications of Bifurcation Theory, Academic Press, 1977, 359: bordered systems, branches.
"""

from cfmkit.numerics.continuation.path import Options, PathBranch, PathEvent, PathStop, Point, WhyStopped
from cfmkit.numerics.continuation.problem import Border, ContinuationProblem, PathEquilibrium

__all__ = [
    "Border",
    "ContinuationProblem",
    "Options",
    "PathBranch",
    "PathEquilibrium",
    "PathEvent",
    "PathStop",
    "Point",
    "WhyStopped",
]
