"""What a pure function must not do: ask a clock, print, open a file."""

import builtins
import gc
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import ModuleType
from typing import Any

CLOCKS = ("time", "monotonic", "perf_counter", "process_time", "time_ns", "monotonic_ns", "perf_counter_ns")
FORBIDDEN: tuple[tuple[ModuleType, str], ...] = (
    *((time, name) for name in CLOCKS),
    (time, "sleep"),
    *((builtins, name) for name in ("print", "open", "input")),
)
"""Where each of them is, and its name."""

AHEAD = 1e6
"""[s] by which clocks are ahead meanwhile, so that whoever looks at one computes something else."""


@contextmanager
def watched(calls: dict[str, str]) -> Iterator[None]:
    """Note which file and line calls what is forbidden, by what was called; clocks are wrong meanwhile.

    Modules that have imported a function under whatever name are changed, too. Those of the standard library, and
    other threads, go on as they are.
    """
    stand_ins = {id(getattr(owner, name)): _noting(owner, name, calls) for owner, name in FORBIDDEN}
    places = [
        (module, name, value)
        for key, module in list(sys.modules.items())
        if not _standard(key) or module in (time, builtins)
        for name, value in list(getattr(module, "__dict__", {}).items())
        if id(value) in stand_ins
    ]
    callbacks, gc.callbacks[:] = gc.callbacks[:], []  # a collection meanwhile is nobody's call
    for module, name, real in places:
        setattr(module, name, stand_ins[id(real)])
    try:
        yield
    finally:
        gc.callbacks[:] = callbacks
        for module, name, real in places:
            setattr(module, name, real)


def _standard(name: str) -> bool:
    return name.partition(".")[0] in sys.stdlib_module_names and name != "__main__"


def _noting(owner: ModuleType, name: str, calls: dict[str, str]) -> Callable[..., Any]:
    real, here = getattr(owner, name), threading.get_ident()
    ahead = AHEAD * (1e9 if name.endswith("_ns") else 1.0) if name in CLOCKS else 0.0

    def stand_in(*given: Any, **named: Any) -> Any:
        caller = sys._getframe(1)
        value = real(*given, **named)
        if threading.get_ident() != here or _standard(caller.f_globals.get("__name__", "")):
            return value
        calls.setdefault(f"{owner.__name__}.{name}", f"{caller.f_code.co_filename}:{caller.f_lineno}")
        return type(value)(value + ahead) if ahead else value

    return stand_in
