"""What all tests share."""

import os
import signal
import sys
from pathlib import Path

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


@pytest.hookimpl(tryfirst=True)  # before xdist looks for groups
def pytest_collection_modifyitems(items):
    """Mark groups of tests that run in one worker (`--dist loadgroup`).

    The tests of a file are a group, so that they share their runs. All tests of devices on wires are one group:
    two at a time would share ports and processors.
    """
    for item in items:
        if WIRE in item.path.parents:
            item.add_marker(pytest.mark.wire)
        if item.get_closest_marker("wire"):
            item.add_marker(pytest.mark.xdist_group("wire"))
        elif item.get_closest_marker("xdist_group") is None:
            item.add_marker(pytest.mark.xdist_group(item.location[0]))
