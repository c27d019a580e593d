"""Imports that take place when what they name is first used, for the records of families.

Python 3.15 has ``lazy from MODULE import NAME`` for this. Until then a block does the same, which type checkers read as
plain imports::

    with deferred_imports():
        from cfmkit.families.cam.design import design

Here ``design`` stands for the function: it may be passed on, called and pickled, and its module is imported by the
first call. The block belongs in a module such as ``record.py``: in an ``__init__.py`` a name could hide a module.
"""

from __future__ import annotations

import builtins
from contextlib import contextmanager
from importlib import import_module
from threading import RLock, get_ident
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterator

_ONE_BLOCK_AT_A_TIME = RLock()


class Deferred:
    """Something in a module that is imported when it is first called, or an attribute of it is read."""

    def __init__(self, module: str, name: str) -> None:
        """Import nothing yet."""
        self._module, self._name = module, name

    def __call__(self, *args: Any, **kwargs: Any) -> Any:
        """Call it."""
        return self._load()(*args, **kwargs)

    def __getattr__(self, name: str) -> Any:
        """Return an attribute of it; what Python itself asks of any object is not there before it is imported."""
        if name.startswith("__"):
            raise AttributeError(name)
        return getattr(self._load(), name)

    def __reduce__(self) -> tuple[type[Deferred], tuple[str, str]]:
        """Return what another process makes it of."""
        return Deferred, (self._module, self._name)

    def __repr__(self) -> str:
        """Return where it is."""
        return f"<{self._name} of {self._module}, imported when used>"

    def _load(self) -> Any:
        return getattr(import_module(self._module), self._name)


def load_deferred(value: Any) -> Any:
    """Return what a deferred import stands for, which is imported for it; anything else as it is."""
    return value._load() if isinstance(value, Deferred) else value


class _NotImported:
    """A module of which names are wanted later."""

    def __init__(self, module: str) -> None:
        self._module = module

    def __getattr__(self, name: str) -> Deferred:
        return Deferred(self._module, name)


@contextmanager
def deferred_imports() -> Iterator[None]:
    """Let every ``from MODULE import NAME`` of the block bind a `Deferred`; other threads import as ever."""
    with _ONE_BLOCK_AT_A_TIME:
        usual, thread = builtins.__import__, get_ident()

        def defer(name: str, scope: Any = None, inner: Any = None, names: Any = (), level: int = 0) -> Any:
            if get_ident() != thread:
                return usual(name, scope, inner, names, level)
            if not names or level:
                raise ImportError("a block of deferred imports has lines `from MODULE import NAME` only")
            return _NotImported(name)

        builtins.__import__ = defer  # type: ignore[assignment]  # import statements give all five by place
        try:
            yield
        finally:
            builtins.__import__ = usual
