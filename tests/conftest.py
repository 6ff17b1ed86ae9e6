"""What all tests share."""

import os
import signal
import sys

from hypothesis import settings

from palpate.one_thread import LINEAR_ALGEBRA

# No deadline: the first example may compile, and the machines that run this are shared. The same examples every
# time: a change is judged, not a draw; `--hypothesis-profile=default` draws anew.
settings.register_profile("palpate", deadline=None, derandomize=True)
settings.load_profile("palpate")

# As in `palpate` itself, and before anything loads numpy: with two processes at it on two cores, threads of linear
# algebra wait for one another, and maps take ten times as long.
assert "numpy" not in sys.modules
for name, value in LINEAR_ALGEBRA.items():
    os.environ.setdefault(name, value)

# Under nohup a process inherits that hang-ups are ignored; tests of a closed terminal need them.
signal.signal(signal.SIGHUP, signal.SIG_DFL)
