"""How functions are compiled: division as in IEEE arithmetic (a solver checks its results, not its divisors)."""

from __future__ import annotations

import contextlib
import sys
from typing import Any

import numba
from numba.core.compiler import Compiler

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


class _Pipeline(Compiler):
    """Numba's passes over a function but those for what no kernel has: closures, expressions of whole arrays, None."""

    def define_pipelines(self) -> Any:
        """Return the passes."""
        (passes,) = super().define_pipelines()
        passes.passes = [each for each in passes.passes if each[0].__name__ not in _NEEDLESS]
        passes.finalize()
        return [passes]


_NEEDLESS = {
    "WithLifting",
    "InlineClosureLikes",
    "DeadBranchPrune",
    "RewriteDynamicRaises",
    "MakeFunctionToJitFunction",
    "LiteralUnroll",
    "LiteralPropagationSubPipelinePass",
    "NopythonRewrites",
    "DumpParforDiagnostics",
}


OPTIONS: dict[str, Any] = {
    "pipeline_class": _Pipeline,
    "error_model": "numpy",
    "fastmath": {"contract"},  # fused multiply and add: NaN stays NaN
    "no_cpython_wrapper": True,
    "no_cfunc_wrapper": True,
    **_uncounted(),
}

KERNELS: list[Any] = []
"""All functions that are compiled; each holds what has been made of it."""


def kernel(function: Any) -> Any:
    """Return the function, to be compiled when it is used; for all functions, which make no arrays.

    They have no way in from Python (that halves the time to compile): calling one from Python ends the process.
    """
    KERNELS.append(numba.njit(**OPTIONS)(function))
    return KERNELS[-1]


def inlined(function: Any) -> Any:
    """As `kernel`, for small functions in the innermost loops: a call with arrays costs more than they do."""
    KERNELS.append(numba.njit(**OPTIONS, forceinline=True)(function))
    return KERNELS[-1]
