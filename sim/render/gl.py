"""An OpenGL context without a screen, where the machine has one.

`MUJOCO_GL` decides when mujoco is imported, and only for `mujoco.Renderer`; a context that is made directly needs
no such setting. EGL and OSMesa exclude each other in one process (PyOpenGL loads one platform), so which of them
there is gets looked up before either is loaded.
"""

import ctypes.util
import importlib
import os
from enum import Enum
from typing import Protocol

from palpate.errors import PalpateError

REMEDY = (
    "install EGL (Debian: apt install libegl1 libegl-mesa0 libgl1 libgl1-mesa-dri), or OSMesa (libosmesa6), and "
    "start again; where both are, MUJOCO_GL=egl or MUJOCO_GL=osmesa in the environment chooses. Everything but "
    "off-screen pictures works without"
)
"""What to do where nothing renders. Packages tried on Debian 12."""


class NoRendererError(PalpateError, RuntimeError):
    """This machine cannot draw off screen: the message says why, and what to install."""


class GlContext(Protocol):
    """As mujoco's own contexts."""

    def make_current(self) -> None:
        """Make OpenGL calls of this thread go here."""
        ...

    def free(self) -> None:
        """Give it back."""
        ...


class Platform(Enum):
    """Ways to OpenGL without a screen: library, and mujoco's module for it."""

    EGL = ("EGL", "mujoco.egl")
    OSMESA = ("OSMesa", "mujoco.osmesa")


def offscreen_context(width: int, height: int) -> GlContext:
    """Return a context for pictures up to a size [pixels].

    Raises:
        NoRendererError: There is none.
    """
    asked = os.environ.get("MUJOCO_GL", "").upper()
    reasons = []
    for platform in [Platform[asked]] if asked in Platform.__members__ else Platform:
        library, module = platform.value
        if ctypes.util.find_library(library) is None:
            reasons.append(f"{library}: no such library")
            continue
        try:
            context: GlContext = importlib.import_module(module).GLContext(width, height)
            context.make_current()
        # whatever a driver does: ImportError, AttributeError and OpenGL's own were seen
        except Exception as error:
            reasons.append(f"{library}: {type(error).__name__}: {error}")
            continue
        return context
    raise NoRendererError(f"no off-screen rendering ({'; '.join(reasons)}): {REMEDY}")
