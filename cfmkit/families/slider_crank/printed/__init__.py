"""From springs to a part that can be printed: small flexures at the joints, or one strip of varying thickness.

Both are planar beam networks: what the springs of the rigid-link model stand for, bent exactly, with its stresses.

[B] P. Bilancia, A. Geraci, G. Berselli, SMASIS2019-5519, sec. 2.2 and 3.
[LH] B. Li, G. Hao, Chin. J. Mech. Eng. 32 (2019) 10.1186/s10033-019-0369-z, sec. 7.
"""

from importlib import import_module
from typing import Any

_NAMES_BY_MODULE = {
    "equilibrium_path": "Chain PressingEnd",
    "flexure_sizing": "rotations",
    "flexures_as_beam_network": (
        "FLEXURE_BEAMS STRIP_BEAM Elasticity Flexure Strip flexure_ends flexure_network joints spread"
    ),
}
_MODULE_BY_NAME = {name: f"{__name__}.{module}" for module, names in _NAMES_BY_MODULE.items() for name in names.split()}
__all__ = [*_MODULE_BY_NAME]


def __getattr__(name: str) -> Any:
    """Import a name when it is first needed."""
    if name not in _MODULE_BY_NAME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_MODULE_BY_NAME[name]), name)
