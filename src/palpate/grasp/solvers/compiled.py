"""CasADi functions as machine code, where the machine has a compiler.

C code is generated, compiled once, and kept in the user's cache folder. Its name has the digest of what went in,
so that the next program starts at once, and that of the file itself, so that a damaged one is made anew instead of
ending the process. The compiler may not contract or reorder floating-point operations: the numbers are those of
CasADi's virtual machine, bit for bit but for the mathematics library.
"""

from __future__ import annotations

import hashlib
import os
import platform
import shutil
import subprocess
import tempfile
import time
from pathlib import Path
from threading import RLock
from typing import Any

import casadi

from palpate.atomic_file import replacing
from palpate.compiling import cache_folder, compiling
from palpate.errors import FloatArray

__all__ = ["BUILDING", "in_place", "machine_code"]

FLAGS = ("-O3", "-ffp-contract=off", "-fno-math-errno", "-fno-semantic-interposition", "-fPIC", "-shared")
"""None of them changes a bit. Without the third and the fourth every square and square root is a call through the
library's table, which costs a sixth. -march=native gained 8 %, but what is cached for one machine might crash
another."""

ROOM = "compiling-"
"""Begins the names of folders where a compiler works."""

BUILDING = RLock()
"""CasADi's symbols are counted without locks: graphs are built, and shared, by one thread at a time."""

COMPILER_TIMEOUT = 120.0
"""Seconds after which a compiler is taken to hang; it needs two."""


def machine_code(function: Any, compiler: str | None = None) -> Any:
    """Return a CasADi function compiled by the system's C compiler; where that fails, as it is, 20 times slower.

    Args:
        function: Of CasADi.
        compiler: Its name, by default $CC, cc, gcc or clang, whichever there is.
    """
    names = (compiler,) if compiler is not None else (os.environ.get("CC") or "cc", "gcc", "clang")
    found = next(filter(None, map(shutil.which, names)), None)
    if found is None or platform.system() == "Windows":
        return function
    try:
        library = _library(function, found)
        with BUILDING:
            return casadi.external(function.name(), str(library))
    except (OSError, RuntimeError, subprocess.SubprocessError):
        return function


def _library(function: Any, compiler: str) -> Path:
    with BUILDING:
        generator = casadi.CodeGenerator("grasp.c", {"with_header": False})
        generator.add(function)
        code = generator.dump()
    made_of = "\n".join(
        (casadi.CasadiMeta.version(), compiler, *FLAGS, platform.system(), platform.machine(), code)
    )
    name = _digest(made_of.encode())
    folder = cache_folder() / "grasp"
    for library in folder.glob(f"{name}-*.so"):
        if library.name == f"{name}-{_digest(library.read_bytes())}.so":
            return library
        library.unlink(missing_ok=True)  # to load it might end this process
    folder.mkdir(parents=True, exist_ok=True, mode=0o700)
    for left in folder.glob(f"{ROOM}*"):
        if time.time() - left.stat().st_mtime > COMPILER_TIMEOUT:  # whoever made it was killed
            shutil.rmtree(left, ignore_errors=True)
    with tempfile.TemporaryDirectory(prefix=ROOM, dir=folder) as room:
        source, made = Path(room) / "grasp.c", Path(room) / "grasp.so"
        source.write_text(code)
        command = [compiler, *FLAGS, str(source), "-o", str(made), "-lm"]
        with compiling("an objective of grasp forces"):
            subprocess.run(
                command, check=True, capture_output=True, timeout=COMPILER_TIMEOUT, stdin=subprocess.DEVNULL
            )
        machine_code = made.read_bytes()
    library = folder / f"{name}-{_digest(machine_code)}.so"
    with replacing(library) as file:  # two programs that do this at once write the same
        file.write(machine_code)
    return library


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()[:32]


def in_place(function: Any, given: list[FloatArray], wanted: list[FloatArray]) -> Any:
    """Return what calls a function on arrays that stay where they are."""
    buffer, call = function.buffer()
    for i, array in enumerate(given):
        if array.size:
            buffer.set_arg(i, array.data)
    for i, array in enumerate(wanted):
        if array.size:
            buffer.set_res(i, array.data)
    # it keeps bare pointers: buffer and arrays must live as long as the call does
    call.kept = (buffer, given, wanted)
    return call
