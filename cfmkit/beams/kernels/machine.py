"""Machine code that was compiled before, called without the compiler: that alone takes longer to import than most runs.

Only LLVM's linker is needed, which llvmlite brings.
"""

from __future__ import annotations

import ctypes
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable

SYMBOL = "cfmkit_door"
"""The function in an object file that is called: (block, out) -> status, see `cfmkit.beams.kernels.build`."""


@dataclass(frozen=True)
class Code:
    """Compiled code.

    Attributes
    ----------
    needs : tuple of str
        Functions of other libraries that it calls.
    content : bytes
        An object file of this machine's kind.
    """

    needs: tuple[str, ...]
    content: bytes


class Strange(Exception):
    """The code cannot be used in this process."""


def processor() -> str:
    """Return the kind of machine that code is compiled for: system, processor, and what it can do."""
    import llvmlite.binding as llvm

    return " ".join((llvm.get_process_triple(), llvm.get_host_cpu_name(), llvm.get_host_cpu_features().flatten()))


_engines: list[Any] = []  # code lives as long as its engine


def loaded(code: Code) -> Callable[[bytes, Any], int]:
    """Return a function that calls the code, without Python's lock.

    Raises
    ------
    Strange
        If a function that it calls is nowhere to be found.
    """
    import llvmlite.binding as llvm

    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    target = llvm.Target.from_triple(llvm.get_process_triple()).create_target_machine()
    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), target)
    missing = [name for name in code.needs if not llvm.address_of_symbol(name)]
    if missing:  # the linker would end the process
        raise Strange(f"no function {missing[0]} in this process")
    engine.add_object_file(llvm.ObjectFileRef.from_data(code.content))
    engine.finalize_object()
    address = engine.get_function_address(SYMBOL)
    if not address:
        raise Strange("no way into this code")
    _engines.append(engine)
    return callable_at(address)


def callable_at(address: int) -> Callable[[bytes, Any], int]:
    """Return a function that calls code, without Python's lock."""
    return ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_char_p, ctypes.c_void_p)(address)
