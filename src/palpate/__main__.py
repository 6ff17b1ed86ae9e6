"""`palpate`, and `python -m palpate`."""

import os
import sys
from contextlib import suppress

from palpate.commands import start_up
from palpate.interruption import exit_code
from palpate.one_thread import LINEAR_ALGEBRA


def main() -> int:
    """Run the command line; returns its exit code."""
    start_up.begin()
    for name, value in LINEAR_ALGEBRA.items():
        os.environ.setdefault(name, value)
    from palpate.cli import main as command  # only now: it loads numpy

    try:
        code = command()
    except KeyboardInterrupt:  # another one, after the line about the first
        code = exit_code()
    with suppress(OSError):
        sys.stdout.flush()
    start_up.leave()
    return code


if __name__ == "__main__":
    sys.exit(main())
