"""Which computers can drive a UR arm: those that its client library has wheels for, on Linux."""

import os
import platform
from importlib.util import find_spec

from palpate.extras import MissingLibraryError

HAS_WHEELS = "CPython 3.11 and 3.12 on Linux x86-64"
"""Of ur_rtde 1.6.5, as far as palpate has a client process for it: that needs Linux."""

ENVIRONMENT = "python3.12 -m venv .venv-ur && .venv-ur/bin/pip install palpate"
"""Makes one; from a clone with `.` in place of `palpate`."""


def is_supported() -> bool:
    """Return whether this computer can drive a UR arm."""
    return find_spec("rtde_control") is not None and hasattr(os, "memfd_create")


def refuse_unsupported() -> None:
    """Refuse a UR arm where it cannot be driven, before anything is connected.

    Raises:
        MissingLibraryError: ur_rtde is not installed, or this is no Linux.
    """
    if is_supported():
        return
    here = f"{platform.python_implementation()} {platform.python_version()}"
    raise MissingLibraryError(
        f"a UR arm needs ur_rtde, which exists for {HAS_WHEELS}, and is not to be had here ({here} on "
        f"{platform.system()} {platform.machine()}); where it exists: {ENVIRONMENT} (in a clone: pip install .)",
        name="rtde_control",
    )
