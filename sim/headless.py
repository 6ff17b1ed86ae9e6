"""MuJoCo, imported whatever `MUJOCO_GL` says.

mujoco reads that variable when it is imported, and fails where it names what the machine does not have: even a
physics run would end there. Only pictures need OpenGL; `palpate.sim.render.gl` then says what is missing.
"""

import ctypes.util
import os

LIBRARIES = {"egl": "EGL", "osmesa": "OSMesa"}
"""What each platform without a screen needs."""

OTHERS = ("", "glfw", "glx", "on", "enable", "enabled", "true", "1", "off", "disable", "disabled", "false", "0")
"""Values that mujoco 4.0 takes besides on Linux (mujoco/rendering/classic/gl_context.py)."""


def importable(asked: str) -> bool:
    """Return whether mujoco can be imported with that value of `MUJOCO_GL`."""
    name = asked.lower().strip()
    if name in LIBRARIES:
        return ctypes.util.find_library(LIBRARIES[name]) is not None
    return name in OTHERS


_asked = os.environ.get("MUJOCO_GL", "")
if not importable(_asked):
    os.environ["MUJOCO_GL"] = "disable"
    try:
        import mujoco as mujoco
    finally:
        os.environ["MUJOCO_GL"] = _asked  # rendering then reports why there are no pictures
