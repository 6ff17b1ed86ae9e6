"""numba's `njit`, with a log message where compiling takes a while.

Compiled kernels are kept on disk (`cache=True`), so that only the first run after an install waits. Each file
begins with a digest of its content: damaged kernels are compiled again, where numba itself would crash. Messages
go to the logger `palpate`, which writes to standard error by default.
"""

import hashlib
import io
import logging
import os
import pickle
import re
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Any

import numba
from numba.core import event as events
from numba.core.caching import FunctionCache, IndexDataCacheFile
from numba.core.dispatcher import Dispatcher

from palpate.atomic_file import replacing

FIRST_MESSAGE_AFTER = 2.0
"""Time of compiling until the first message [s]."""

NEXT_MESSAGE_AFTER = 10.0
"""Time of compiling until the next message [s], where one kernel follows another."""

ONCE = "once: it is kept; `palpate warm-up` compiles everything"
EACH_TIME = "each time: it is not kept"
NOWHERE = "each time: no folder to keep it in can be written; set NUMBA_CACHE_DIR to one that can"
"""Words for the number of compilations of a kernel."""

_DIGEST_SIZE = hashlib.sha256().digest_size
"""Length of the digest at the start of each file [bytes]."""

KEPT_KERNELS: list[str] = []
"""Names of the kernels that this process has compiled and kept, in order."""

_unkept: set[Any] = set()
_log = logging.getLogger("palpate")


def _njit(function: Callable[..., Any] | None = None, *, cache: bool = False, **options: Any) -> Any:
    """Compile as `numba.njit` does, and where no folder can be written, without keeping the result."""

    def decorated(function: Callable[..., Any]) -> Any:
        kernel = numba.njit(**options)(function)
        if cache and isinstance(kernel, Dispatcher):  # with NUMBA_DISABLE_JIT it is not
            _keep(kernel, _KernelCache)
        return kernel

    return decorated if function is None else decorated(function)


if TYPE_CHECKING:
    from numba import njit as njit
else:
    njit = _njit


def _keep(kernel: Any, cache: Callable[[Callable[..., Any]], Any]) -> None:
    try:
        kernel._cache = cache(kernel.py_func)
    except RuntimeError:  # no folder that can be written: numba itself would refuse to go on
        _unkept.add(kernel)


def machine_code(kernel: Any, *examples: object) -> Any:
    """Return the compiled form of a kernel for arguments like these, compiling it if need be.

    The compiled form takes arguments of these types only, in this order, and does not check them: a check takes as
    long as a small kernel. A read-only array may stand for an array that the kernel does not write.
    """
    if not isinstance(kernel, Dispatcher):  # with NUMBA_DISABLE_JIT
        return kernel
    types = tuple(numba.typeof(example) for example in examples)  # type: ignore[no-untyped-call]
    return _compiled(kernel, types)


@lru_cache(maxsize=256)
def _compiled(kernel: Any, types: tuple[Any, ...]) -> Any:
    return kernel.compile(types)


def keep_closure(kernel: Any, name: str) -> Any:
    """Keep a compiled closure over other compiled functions; numba itself compiles it again in every process.

    Args:
        kernel: Closure compiled by `njit`; its qualified name differs for different enclosed functions.
        name: Unique name of the enclosed functions, see `kept_name`.
    """
    _keep(kernel, lambda function: _ClosureCache(function, name))
    return kernel


def cache_folder() -> Path:
    """Return palpate's folder in the user's cache: $XDG_CACHE_HOME/palpate, by default below ~/.cache."""
    named = os.environ.get("XDG_CACHE_HOME", "")
    base = Path(named) if os.path.isabs(named) else Path.home() / ".cache"
    return base / "palpate"


def kept_in(kernel: Any) -> str | None:
    """Return the folder that keeps a compiled function; None if it is not kept, or is no compiled function."""
    return kernel.stats.cache_path if isinstance(kernel, Dispatcher) else None


def kept_name(kernel: Any) -> str:
    """Return a name of a kept function that changes with its source; "" for any other function."""
    if kept_in(kernel) is None:
        return ""
    function = kernel.py_func
    source = hashlib.sha256(Path(function.__code__.co_filename).read_bytes()).hexdigest()
    return f"{function.__module__}.{function.__qualname__} {source}"


class _CheckedFiles(IndexDataCacheFile):
    """Index and machine code on disk as numba has them, each behind a digest."""

    def _load_index(self) -> dict[Any, str]:
        try:
            file = io.BytesIO(self._checked(self._index_path))
        except OSError:
            return {}
        if pickle.load(file) != self._version:  # then the rest may not even unpickle
            return {}
        stamp, overloads = pickle.load(file)
        return overloads if stamp == self._source_stamp else {}

    def _load_data(self, name: str) -> Any:
        return pickle.loads(self._checked(self._data_path(name)))  # type: ignore[no-untyped-call]

    def _checked(self, path: str) -> bytes:
        """Read a file.

        Raises:
            OSError: If the file cannot be read, or is damaged.
        """
        kept = Path(path).read_bytes()
        if hashlib.sha256(kept[_DIGEST_SIZE:]).digest() != kept[:_DIGEST_SIZE]:
            raise OSError(f"{path}: damaged")
        return kept[_DIGEST_SIZE:]

    @contextmanager
    def _open_for_write(self, filepath: str) -> Iterator[Any]:
        content = io.BytesIO()
        yield content
        with replacing(filepath) as file:
            file.write(hashlib.sha256(content.getvalue()).digest() + content.getvalue())


class _KernelCache(FunctionCache):
    """The cache of numba, with a check of loaded files."""

    def __init__(self, function: Callable[..., Any]) -> None:
        super().__init__(function)  # type: ignore[no-untyped-call]
        self._cache_file = _CheckedFiles(  # type: ignore[no-untyped-call]
            self._cache_path, self._impl.filename_base, self._impl.locator.get_source_stamp()
        )


class _ClosureCache(_KernelCache):
    """A cache that finds a closure by the name of its enclosed functions; numba uses a random number for each."""

    def __init__(self, function: Callable[..., Any], kept_as: str) -> None:
        super().__init__(function)
        self._kept_as = kept_as

    def _index_key(self, sig: Any, codegen: Any) -> tuple[Any, ...]:
        return (sig, codegen.magic_tuple(), self._kept_as)


@contextmanager
def compiling(what: str, how: str = ONCE, *, warn_after: float = FIRST_MESSAGE_AFTER) -> Iterator[None]:
    """Log a message if compiling takes longer than a time.

    Args:
        what: Name of the compiled code.
        how: `ONCE`, `EACH_TIME` or `NOWHERE`.
        warn_after: Time until the message [s].
    """
    timer = threading.Timer(warn_after, _log.warning, (f"palpate: compiling {what} ({how})",))
    timer.daemon = True
    timer.start()
    try:
        yield
    finally:
        timer.cancel()
    if how == ONCE:
        KEPT_KERNELS.append(what)


def name_for_people(function: Callable[..., Any]) -> str:
    """Return the purpose of a kernel from its module's docstring; for other packages, its qualified name."""
    name = f"{function.__module__}.{function.__qualname__}"
    documented = sys.modules[function.__module__].__doc__ if function.__module__ in sys.modules else None
    if not documented or not name.startswith("palpate."):
        return name
    first: str = re.split(r"[,.:;(]\s", documented.strip() + " ", maxsplit=1)[0]
    return f"code for {first[:1].lower()}{first[1:]}"


class _Kernels(events.Listener):
    """Listens to numba's compilations; functions that a kernel calls count as part of the kernel."""

    def __init__(self) -> None:
        self._depth, self._began, self._left = 0, 0.0, FIRST_MESSAGE_AFTER
        self._warning: Any = None

    def on_start(self, event: events.Event) -> None:
        self._depth += 1
        if self._depth == 1:
            data: Any = event.data
            kernel = data["dispatcher"]
            self._began = monotonic()
            self._warning = compiling(name_for_people(kernel.py_func), _how(kernel), warn_after=self._left)
            self._warning.__enter__()

    def on_end(self, event: events.Event) -> None:
        self._depth -= 1
        if self._depth == 0:
            self._warning.__exit__(None, None, None)
            left = self._left - (monotonic() - self._began)
            self._left = left if left > 0.0 else NEXT_MESSAGE_AFTER


def _how(kernel: Any) -> str:
    if kept_in(kernel) is not None:
        return ONCE
    return NOWHERE if kernel in _unkept else EACH_TIME


events.register("numba:compile", _Kernels())  # type: ignore[no-untyped-call] # numba compiles under a lock: one thread at a time
