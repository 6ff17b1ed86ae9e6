"""`palpate`, and `python -m palpate`."""

import os
import sys

from palpate.commands import start_up
from palpate.one_thread import LINEAR_ALGEBRA


def main() -> int:
    """Run the command line; returns its exit code."""
    start_up.begin()
    for name, value in LINEAR_ALGEBRA.items():
        os.environ.setdefault(name, value)
    from palpate.cli import main as command  # only now: it loads numpy

    return command()


if __name__ == "__main__":
    sys.exit(main())
