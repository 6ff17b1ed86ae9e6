"""A worker process ends when its parent does, however it came to die, and however busy the worker is."""

import os
import pickle
import signal
import sys

PR_SET_PDEATHSIG = 1
"""prctl(2)."""


def serve_until_orphaned(parent: int, served: bytes, *arguments: object) -> None:
    """Call what a worker is for; first see to it that it ends with its parent.

    Imports take seconds on a busy computer: this module has few, and what is served comes packed.

    Args:
        parent: Number of its process.
        served: A function, pickled.
        arguments: Of that.
    """
    if sys.platform == "linux":
        import ctypes

        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0)
    if os.name == "posix" and os.getppid() != parent:
        return  # it died before
    pickle.loads(served)(*arguments)
