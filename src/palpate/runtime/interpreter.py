"""PLACEHOLDER by the lead so that imports work: helper "pacing" overwrites this file."""
from contextlib import contextmanager
@contextmanager
def undisturbed():
    import gc
    was = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was: gc.enable()
