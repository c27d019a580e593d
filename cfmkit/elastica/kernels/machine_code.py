"""Machine code that was compiled before, called without the compiler: that alone takes longer to import than most runs.

Code is an object file. Where the system has a C compiler it is linked to a shared library, which the system loads; else
LLVM links it in memory, for which llvmlite is imported.
"""

from __future__ import annotations

import ctypes
import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable

SYMBOL = "cfmkit_door"
"""The function in an object file that is called: (block, out) -> status, see `cfmkit.elastica.kernels.build`."""

_LINKERS = ("cc", "gcc", "clang")
_LONGEST = 60.0  # seconds for a linker that takes a tenth of one
_VARYING = ("processor", "cpu MHz", "physical id", "siblings", "core id", "apicid", "initial apicid", "bogomips")


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
    """Return the kind of machine that code is compiled for: its processor, and what that can do."""
    try:
        first = Path("/proc/cpuinfo").read_text(errors="replace").split("\n\n")[0]
    except OSError:  # not on Linux
        import llvmlite.binding as llvm

        return " ".join((llvm.get_process_triple(), llvm.get_host_cpu_name(), llvm.get_host_cpu_features().flatten()))
    import platform

    lines = [line for line in first.split("\n") if not line.startswith(_VARYING)]
    return "\n".join((platform.machine(), *lines))


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


def linked(code: Code, folder: Path) -> bytes | None:
    """Return the code as a shared library, None where there is no C compiler that makes one.

    Parameters
    ----------
    code : Code
        To be linked.
    folder : Path
        For files on the way; nobody else can write to it.
    """
    import subprocess

    linker = next(filter(None, map(shutil.which, _LINKERS)), None)
    if linker is None:
        return None
    source, target = folder / "code.o", folder / "code.so"
    source.write_bytes(code.content)
    command = [linker, "-shared", "-o", str(target), str(source), "-lm"]
    try:
        subprocess.run(command, check=True, capture_output=True, timeout=_LONGEST)
        return target.read_bytes()
    except (OSError, subprocess.SubprocessError):
        return None


def in_library(path: Path) -> Callable[[bytes, Any], int]:
    """Return a function that calls the code in a shared library, without Python's lock.

    Raises
    ------
    Strange
        If it is no library of this system, or calls what is nowhere to be found.
    """
    if "$" in str(path):  # the system's loader replaces $LIB and the like, and would open another file
        raise Strange(f"{path}: a path with a $")
    try:
        door: Any = ctypes.CDLL(str(path))[SYMBOL]
    except (OSError, AttributeError) as error:
        raise Strange(str(error)) from error
    door.argtypes, door.restype = (ctypes.c_char_p, ctypes.c_void_p), ctypes.c_int
    called: Callable[[bytes, Any], int] = door
    return called
