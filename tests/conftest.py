"""What all tests share."""

import os
import signal
import sys
from pathlib import Path
from zlib import crc32

import pytest
from hypothesis import settings

from palpate.interruption import forget
from palpate.one_thread import LINEAR_ALGEBRA

WIRE = Path(__file__).parent / "wire"

# No deadline: the first example may compile, and the machines that run this are shared. The same examples every
# time: a change is judged, not a draw; `--hypothesis-profile=default` draws anew.
settings.register_profile("palpate", deadline=None, derandomize=True)
settings.load_profile("palpate")

# As in `palpate` itself, and before anything loads numpy: with two processes at it on two cores, threads of linear
# algebra wait for one another, and maps take ten times as long.
assert "numpy" not in sys.modules or os.environ.get("OPENBLAS_NUM_THREADS") == "1"
for name, value in LINEAR_ALGEBRA.items():
    os.environ.setdefault(name, value)

# Under nohup a process inherits that hang-ups are ignored, in the background of a script that Ctrl-C is; tests of
# closed terminals and interrupted runs need both.
signal.signal(signal.SIGHUP, signal.SIG_DFL)
signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.hookimpl(tryfirst=True)  # before fixtures
def pytest_runtest_setup():
    """Each test is a process of its own as far as signals go: one that sent itself Ctrl-C ends no other."""
    forget()


def pytest_addoption(parser):
    parser.addoption(
        "--part", metavar="K/N", help="of the slow tests only the K-th of N parts: CI runs one a time"
    )


@pytest.hookimpl(tryfirst=True)  # before xdist looks for groups
def pytest_collection_modifyitems(config, items):
    """Take a part, if one is asked for; say what runs in one worker (`--dist loadgroup`).

    All tests of a file, so that they share their runs; and all of devices on wires, one after the other: two at a
    time would share ports and processors.
    """
    for item in items:
        if item.get_closest_marker("xdist_group") is None:
            group = "wire" if WIRE in item.path.parents else item.location[0]
            item.add_marker(pytest.mark.xdist_group(group))
    if part := config.getoption("part"):
        k, n = map(int, part.split("/"))
        taken = [item for item in items if crc32(f"{item.location[0]}::{item.originalname}".encode()) % n == k % n]
        config.hook.pytest_deselected(items=list(set(items) - set(taken)))
        items[:] = taken
