"""`make demo` and the fast tests on every CPython of this machine but the one that is already tried.

    python tests/install/every_python.py     # with the Python that needs no further trial

Looks on the PATH and among what pyenv has installed. Where there is no other, it says so.
"""

import os
import shutil
import subprocess
import sys
from pathlib import Path

from choose_python import OLDEST, version

NEWEST = 20
"""Minor version up to which it looks."""


def others(tried: tuple[int, int]) -> dict[tuple[int, int], str]:
    """Return the other CPythons that palpate supports, by version."""
    names = [f"python3.{minor}" for minor in range(OLDEST[1], NEWEST)]
    pyenv = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv")) / "versions"
    candidates = [*filter(None, map(shutil.which, names)), *map(str, sorted(pyenv.glob("3.*/bin/python")))]
    found = {told[0]: python for python in candidates if (told := version(python))}
    return {each: python for each, python in sorted(found.items()) if each >= OLDEST and each != tried}


def main() -> None:
    """Try them one after the other; the first that fails ends it."""
    found = others(sys.version_info[:2])
    if not found:
        print(
            "No other CPython from 3.11 on was found: nothing more was tried. pyenv install 3.12 3.13 gives some."
        )
    for (major, minor), python in found.items():
        name = f"{major}.{minor}"
        given = [f"PYTHON={python}", f"VENV=.venv-{name}", f"OUT=runs/demo-{name}"]
        print(f"CPython {name} ({python}): the demo and the fast tests", flush=True)
        subprocess.run(["make", "--no-print-directory", "demo", "test", *given], check=True)


if __name__ == "__main__":
    main()
