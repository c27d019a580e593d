"""From a function in Python to machine code that is called by its address, with one block of words.

Numba types the functions and writes LLVM's code for each. On its way a library of its own is made, optimised and
translated for every function, of which the code of all that it calls is a part; here that is done once, for the
door, when all the code is there: half of the time.
"""

from __future__ import annotations

import contextlib
import gc
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numba
from llvmlite import ir
from numba import types
from numba.core import cgutils, codegen, compiler_lock, cpu, errors, event
from numba.core.registry import cpu_target
from numba.core.runtime.nrt import rtsys
from numba.core.typing.context import Context

from cfmkit.elastica.kernels import functions_called_from_python
from cfmkit.elastica.kernels.compiler import KERNELS, OPTIONS
from cfmkit.elastica.kernels.machine_code import SYMBOL, Code
from cfmkit.elastica.kernels.passing_arrays_by_address import (
    AXES,
    DATA,
    DTYPE,
    DTYPES,
    ENTRIES,
    FLAGS,
    READY,
    REFUSED,
    SHAPE,
    TYPE,
    Kind,
)
from cfmkit.elastica.kernels.signatures import DOORS, REAL, WHOLE

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

_INTRINSIC = {"cos", "sin", "log", "floor", "memcpy", "memmove", "memset"}
"""What LLVM may call for operations of its own that are no instructions of the processor."""

_WORD = ir.IntType(64)
_STATUS = ir.IntType(32)


class _Draft(codegen.JITCodeLibrary):
    """The code of one function, neither optimised nor translated; whoever needs all of it gets it linked."""

    def _optimize_functions(self, ll_module: Any) -> None:
        ll_module.data_layout = self._codegen._data_layout

    def finalize(self) -> None:
        self._raise_if_finalized()
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        return 0


class _Drafting(codegen.JITCPUCodegen):
    _library_class = _Draft

    def _customize_tm_options(self, options: dict[str, Any]) -> None:
        super()._customize_tm_options(options)
        options |= {"reloc": "pic", "codemodel": "small"}  # for a shared library, which may lie anywhere

    def _add_module(self, module: Any) -> None:
        pass

    def set_env(self, env_name: str, env: Any) -> None:
        pass


def link(library: Any) -> Any:
    """Add to the module of a library those of all that it needs; return it."""
    seen, waiting = {library}, list(library._linking_libraries)
    while waiting:
        other = waiting.pop()
        if other in seen:
            continue
        seen.add(other)
        module = other._final_module if isinstance(other, _Draft) else other._get_module_for_linking()
        library._final_module.link_in(module, preserve=True)
        waiting += other._linking_libraries if isinstance(other, _Draft) else []
    library._linking_libraries = []
    return library._final_module


class _Inference(Context):
    """Numba's typing of calls, each done once.

    Constants count as numbers of their type: else a function is compiled once more for each constant argument.
    """

    def __init__(self) -> None:
        super().__init__()
        self.known: dict[Any, Any] = {}

    def resolve_function_type(self, func: Any, args: Any, kws: Any) -> Any:
        """Return the signature of a call."""
        if isinstance(func, types.Dispatcher):
            args = tuple(map(types.unliteral, args))
        return super().resolve_function_type(func, args, kws)


def _call_type(function: Any, context: Any, args: Any, kws: Any) -> Any:
    """Return the signature of a call of one of numba's own functions, operators among them.

    To find it numba tries a dozen templates, for the sum of two numbers as well, and several times for each sum.
    """
    usual = super(types.Function, function).get_call_type
    if kws or not isinstance(context, _Inference):
        return usual(context, args, kws)
    key = function, *args
    if key not in context.known:
        try:
            context.known[key] = usual(context, args, kws)
        except errors.TypingError as error:
            context.known[key] = error
    if isinstance(context.known[key], Exception):
        raise context.known[key]
    return context.known[key]


@dataclass
class _World:
    """What compilations have in common: the contexts of numba, and what has been made of each kernel."""

    target: Any
    typing: Any
    kernels: list[Any]

    @classmethod
    def present(cls) -> _World:
        """Return that of all compilations now."""
        return cls(cpu_target.target_context, cpu_target.typing_context, [each.overloads for each in KERNELS])

    def enter(self) -> None:
        """Make it that of all compilations."""
        cpu_target._toplevel_target_context, cpu_target._toplevel_typing_context = self.target, self.typing
        for kernel, overloads in zip(KERNELS, self.kernels, strict=True):
            kernel.overloads = overloads


@lru_cache(maxsize=1)
def _world_of_drafts() -> _World:
    rtsys.initialize(cpu_target.target_context)  # the first context that compiles makes it for the whole process
    types_known = _Inference()
    target = cpu.CPUContext(types_known, cpu_target.target_context.target_name)
    target._internal_codegen = _Drafting("cfmkit")
    return _World(target, types_known, [type(each.overloads)() for each in KERNELS])


@contextlib.contextmanager
def _drafting() -> Iterator[Any]:
    """Compile drafts, in a world of their own.

    Else they would be found by other functions of the process that use the same parts of numba, `min` and `max` among
    them, and drafts would find those that were optimised by themselves: then the last bits of a path would follow from
    what its process had compiled before, and would stay so, because the code is kept.
    """
    usual = _World.present()
    _world_of_drafts().enter()
    function: Any = types.Function
    function.get_call_type = _call_type
    try:
        yield _world_of_drafts().target.codegen()
    finally:
        del function.get_call_type
        usual.enter()


def _type(what: Any) -> Any:
    """Return the compiler's type for an argument."""
    if what in (WHOLE, REAL):
        return types.int64 if what == WHOLE else types.float64
    if isinstance(what, Kind):
        return types.Array(numba.from_dtype(what.dtype), what.ndim, "C")
    inner = [_type(each) for each in what]
    return types.NamedTuple(inner, type(what)) if hasattr(what, "_fields") else types.Tuple(inner)


class _Reader:
    """Writes code that reads words of a block and looks into NumPy's arrays; see `passing_arrays_by_address`."""

    def __init__(self, context: Any, builder: Any, block: Any) -> None:
        self.context, self.builder, self.block, self.at, self.arrays = context, builder, block, 0, 0
        self.type = self.word()
        self.entries = {numba.from_dtype(dtype): self.word() for dtype in DTYPES}

    def word(self) -> Any:
        """Return the next word."""
        place = self.builder.gep(self.block, [ir.Constant(_WORD, self.at)])
        self.at += 1
        return self.builder.load(place)

    def field(self, place: Any, offset: int, kind: Any = _WORD) -> Any:
        """Return what stands so many bytes after a place."""
        where = self.builder.add(place, ir.Constant(_WORD, offset))
        return self.builder.load(self.builder.inttoptr(where, kind.as_pointer()))

    def demand(self, found: Any, wanted: Any) -> None:
        """Return from the function unless two numbers are equal."""
        with self.builder.if_then(self.builder.icmp_unsigned("!=", found, wanted), likely=False):
            self.builder.ret(ir.Constant(_STATUS, REFUSED + self.arrays))

    def value(self, kind: Any) -> Any:
        """Return the next value."""
        if isinstance(kind, types.BaseTuple):
            inner: Any = kind
            return self.context.make_tuple(self.builder, kind, [self.value(each) for each in inner])
        if isinstance(kind, types.Array):
            return self.array(kind)
        word = self.word()
        return word if kind == types.int64 else self.builder.bitcast(word, self.context.get_value_type(kind))

    def array(self, kind: Any) -> Any:
        """Return an array that nobody owns."""
        given = self.word()
        self.demand(self.field(given, TYPE), self.type)
        self.demand(self.field(self.field(given, DTYPE), ENTRIES), self.entries[kind.dtype])
        self.demand(self.field(given, AXES, _STATUS), ir.Constant(_STATUS, kind.ndim))
        flags = self.builder.and_(self.field(given, FLAGS, _STATUS), ir.Constant(_STATUS, READY))
        self.demand(flags, ir.Constant(_STATUS, READY))
        self.arrays += 1
        array = self.context.make_array(kind)(self.context, self.builder)
        item = self.context.get_data_type(kind.dtype)
        size = ir.Constant(_WORD, self.context.get_abi_sizeof(item))
        data = self.builder.inttoptr(self.field(given, DATA), item.as_pointer())
        lengths = self.field(given, SHAPE)
        shape = [self.field(lengths, 8 * axis) for axis in range(kind.ndim)]
        strides: list[Any] = []
        count: Any = ir.Constant(_WORD, 1)
        for length in reversed(shape):
            strides.insert(0, self.builder.mul(count, size))
            count = self.builder.mul(count, length)
        array.meminfo, array.parent = (cgutils.get_null_value(each.type) for each in (array.meminfo, array.parent))
        array.nitems, array.itemsize, array.data = count, size, data
        array.shape = cgutils.pack_array(self.builder, shape, ty=_WORD)
        array.strides = cgutils.pack_array(self.builder, strides, ty=_WORD)
        return array._getvalue()


def _way_in(context: Any, done: Any) -> Any:
    """Return a module with a function (block, out) that calls a compiled one and stores the integers it returns."""
    module = ir.Module("way in")
    module.triple, pointer = context.codegen()._llvm_module.triple, _WORD.as_pointer()
    own = ir.Function(module, ir.FunctionType(_STATUS, [pointer, pointer]), SYMBOL)
    builder = ir.IRBuilder(own.append_basic_block())
    reader = _Reader(context, builder, own.args[0])
    takes, gives = done.fndesc.argtypes, done.fndesc.restype
    values = [reader.value(kind) for kind in takes]
    inner = ir.Function(module, context.call_conv.get_function_type(gives, takes), done.fndesc.llvm_func_name)
    status, result = context.call_conv.call_function(builder, inner, gives, takes, values)
    for k, each in enumerate(cgutils.unpack_tuple(builder, result, len(gives))):
        builder.store(each, builder.gep(own.args[1], [ir.Constant(_WORD, k)]))
    builder.ret(status.code)
    return module


@contextlib.contextmanager
def _optimising() -> Iterator[None]:
    """Compile with one set of optimisations, whatever the process has set: paths are then the same to the last bit.

    Loops over the variables are what derivatives spend their time in. Putting the four components of a state side by
    side as well would spare the solver a tenth of its time, but it changes last bits, and two of the networks in the
    tests that are requested points exactly at a bifurcation were then told an event that is unresolved.
    """
    settings: Any = numba.config
    before = settings.LOOP_VECTORIZE, settings.SLP_VECTORIZE
    settings.LOOP_VECTORIZE, settings.SLP_VECTORIZE = 1, 0
    try:
        yield
    finally:
        settings.LOOP_VECTORIZE, settings.SLP_VECTORIZE = before


@contextlib.contextmanager
def _uncollected() -> Iterator[None]:
    """Compile without looking for garbage: of millions of objects that numba makes most are in use to the end."""
    before = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if before:
            gc.enable()


class _Listener(event.Listener):
    """Tells the share of a compilation that is done, by the functions that are typed."""

    def __init__(self, name: str, report: Callable[[float], None]) -> None:
        self.all, self.done, self.report = _FUNCTIONS.get(name, 20), 0, report

    def on_start(self, _event: Any) -> None:
        pass

    def on_end(self, _event: Any) -> None:
        self.done += 1
        self.report(_TYPED * min(1.0, self.done / self.all))


_FUNCTIONS = {"solver": 91, "slopes": 68}  # compiled for each, about
_TYPED = 0.55  # share of the time until all functions are typed; then they are optimised and translated as a whole
_OPTIMISED = 0.85  # share of the time until they are optimised: 0.82 to 0.87 of the solver's, 0.86 of the slopes'


def compiled(name: str, report: Callable[[float], None] = lambda _share: None) -> Code:
    """Return the machine code of a door; `report` is told the share that is done."""
    with compiler_lock.global_compiler_lock, _uncollected(), _optimising(), _drafting() as drafting:
        with event.install_listener("numba:compile", _Listener(name, report)):
            done = _typed(name)
        library = done.library
        library.add_ir_module(_way_in(cpu_target.target_context, done))
        module = link(library)
        for own in (*module.functions, *module.global_variables):
            if not own.is_declaration and own.name != SYMBOL:
                own.linkage, own.name = "internal", ""  # numba's names count what the process compiled before
        module.verify()
        passes, builder = drafting._module_pass_manager()
        report(_TYPED)
        passes.run(module, builder)
        report(_OPTIMISED)
        calls = {each.name for each in module.functions if each.is_declaration and not each.name.startswith("llvm.")}
        return Code((*sorted(calls | _INTRINSIC),), drafting._tm.emit_object(module))


def called(name: str) -> int:
    """Return the address of a door that numba compiles and keeps for this process alone, in its own way.

    It takes several times as long; for versions of numba that the short way does not know, and for tests of it.
    """
    with compiler_lock.global_compiler_lock, _optimising():
        context, done = cpu_target.target_context, _typed(name)
        library = context.codegen().create_library(name)
        library.add_linking_library(done.library)
        library.add_ir_module(_way_in(context, done))
        library.finalize()
        _libraries.append(library)
        address: int = library.get_pointer_to_function(SYMBOL)
        return address


_libraries: list[Any] = []  # code lives as long as its library


def _typed(name: str) -> Any:
    signature = tuple(_type(each) for each in DOORS[name])
    dispatcher = numba.njit(**OPTIONS)(getattr(functions_called_from_python, name))
    dispatcher.compile(signature)
    return dispatcher.overloads[signature]
