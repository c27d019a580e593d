"""How functions are compiled: division as in IEEE arithmetic (a solver checks its results, not its divisors)."""

from __future__ import annotations

import contextlib
import logging
import os
import sys
from typing import Any

import numba

from cfmkit.store.private import private_folder

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
        for options in (_DOOR, _DOOR):
            try:
                return numba.njit(**options)(function)
            except RuntimeError as error:  # neither the package nor the home of this user can be written
                if "cannot cache" not in str(error) or not _keep_among_temporary_files():
                    break
        return numba.njit(**{**_DOOR, "cache": False})(function)

    return decorate


def _keep_among_temporary_files() -> bool:
    """Let the compiler, and that of child processes, keep its code in a private folder; return whether there is one."""
    folder = private_folder("compiled")
    if folder is None:
        logging.getLogger("cfmkit.beams").info("no folder is writable: compiled code is not kept")
        return False
    os.environ["NUMBA_CACHE_DIR"] = str(folder)
    vars(numba.config)["CACHE_DIR"] = str(folder)
    logging.getLogger("cfmkit.beams").info(
        "neither the package nor the home folder is writable: compiled code is kept in %s", folder
    )
    return True
