"""What all tests share."""

from hypothesis import settings

# No deadline: the first example may compile, and the machines that run this are shared. The same examples every
# time: a change is judged, not a draw; `--hypothesis-profile=default` draws anew.
settings.register_profile("palpate", deadline=None, derandomize=True)
settings.load_profile("palpate")
