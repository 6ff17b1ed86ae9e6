"""What all tests share."""

import signal

from hypothesis import settings

# No deadline: the first example may compile, and the machines that run this are shared. The same examples every
# time: a change is judged, not a draw; `--hypothesis-profile=default` draws anew.
settings.register_profile("palpate", deadline=None, derandomize=True)
settings.load_profile("palpate")

# Under nohup a process inherits that hang-ups are ignored; tests of a closed terminal need them.
signal.signal(signal.SIGHUP, signal.SIG_DFL)
