"""How functions are compiled: division as in IEEE arithmetic (a solver checks its results, not its divisors)."""

from __future__ import annotations

import contextlib
import sys
from typing import Any

import numba

_ARRAYS = "numba.np.arraymath"


def _leave_blas_out() -> None:
    """Load the compiler's array functions without the BLAS that they ask for and that nothing here uses.

    It would be scipy's, a quarter of a second to import. Whoever does use it still gets it, on first use.
    """
    if _ARRAYS in sys.modules or "scipy.linalg" in sys.modules:
        return
    with contextlib.suppress(ImportError, AttributeError):  # another version of the compiler: then with it
        from numba.np import linalg

        ask, linalg.ensure_blas = linalg.ensure_blas, lambda: None
        try:
            from numba.np import arraymath
        finally:
            linalg.ensure_blas = ask
        vars(arraymath)["ensure_blas"] = ask


_leave_blas_out()


def _uncounted() -> dict[str, Any]:
    """Return the option that leaves out the counting of references to arrays, where the compiler has it.

    Counting is atomic, and a function counts every array of a model that it is handed: that took longer than the
    arithmetic. Without it a function cannot make arrays; those that it is handed are held by its caller.
    """
    try:
        from numba.core.options import DefaultOptions
    except ImportError:
        return {}
    return {"_nrt": False} if hasattr(DefaultOptions, "_nrt") else {}


_MATH: dict[str, Any] = {"error_model": "numpy", "fastmath": {"contract"}}  # fused multiply and add: NaN stays NaN
_INNER: dict[str, Any] = {**_MATH, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
_UNCOUNTED = _uncounted()
_DOOR: dict[str, Any] = {**_MATH, "no_cfunc_wrapper": True, "cache": True, "nogil": True}

kernel: Any = numba.njit(**_INNER, **_UNCOUNTED)
"""For functions that others call, compiled into the doors of `cfmkit.beams.kernels.entry`; they make no arrays.

They have no way in from Python (that halves the time to compile): calling one from Python ends the process.
"""

_COUNTED: dict[str, Any] = dict.fromkeys(_UNCOUNTED, True)

maker: Any = numba.njit(**_INNER, **_COUNTED)
"""For kernels that make arrays of their own."""


inlined: Any = numba.njit(**_INNER, **_UNCOUNTED, forceinline=True)
"""For small functions in the innermost loops: a call with arrays costs more than they do."""


def door(stamp: str) -> Any:
    """Return a decorator for functions called from Python: kept on disk, in files named after the stamp.

    The compiler's own check looks at the time stamp of the file that a function stands in, which says nothing of the
    functions that it calls, and what was kept by older sources cannot always be read.
    """

    def decorate(function: Any) -> Any:
        function.__qualname__ = f"{function.__name__}_{stamp[:16]}"
        return numba.njit(**_DOOR)(function)

    return decorate
