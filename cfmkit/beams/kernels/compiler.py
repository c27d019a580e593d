"""How functions are compiled: division as in IEEE arithmetic (a solver checks its results, not its divisors)."""

from __future__ import annotations

from typing import Any

import numba

_INNER: dict[str, Any] = {"error_model": "numpy", "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
_DOOR: dict[str, Any] = {"error_model": "numpy", "no_cfunc_wrapper": True, "cache": True, "nogil": True}

kernel: Any = numba.njit(**_INNER)
"""For functions that others call, compiled into the doors of `cfmkit.beams.kernels.entry`.

They have no way in from Python (that halves the time to compile): calling one from Python ends the process.
"""

door: Any = numba.njit(**_DOOR)
"""For functions called from Python: kept on disk."""
