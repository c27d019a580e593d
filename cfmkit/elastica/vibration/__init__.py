"""Linear vibration of networks about the equilibria of a path: frequencies, and flutter under loads that turn.

`frequencies` takes a `cfmkit.elastica.outcome.path.Path` and the `NetworkMasses` of its parts.

Assumes: small motions, no damping, what is held does not move.

References
----------
[Me] L. Meirovitch, Principles and Techniques of Vibrations (1997): the eigenvalue problem, Ritz's method.
[Be] M. Beck, Z. angew. Math. Phys. 3 (1952) 225: the column under a force that turns with its end.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from cfmkit.elastica.vibration.network_masses_type import NetworkMasses

if TYPE_CHECKING:
    from cfmkit.elastica.vibration.natural_frequencies import Frequencies, frequencies

__all__ = ["Frequencies", "NetworkMasses", "frequencies"]


def __getattr__(name: str) -> Any:
    """Import the eigenproblem when it is first needed: every network has masses, few are asked how they swing."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from cfmkit.elastica.vibration import natural_frequencies

    return getattr(natural_frequencies, name)
