"""Make an environment of a Python that can do everything, where one is installed, and say which and why.

    python3 tests/install/choose_python.py ENVIRONMENT [PYTHON]

A PYTHON that is named is taken as it is. Runs on Python 3.6, too, for that may be what `python3` is.
"""

import platform
import subprocess
import sys

OLDEST = (3, 11)
UR = ((3, 11), (3, 12))
"""Versions that the client library of UR arms has wheels for, on x86-64."""

NAMES = ["python3", "python3.12", "python3.11", "python3.14", "python3.13"]
ASK = "import platform, sys; print(sys.version_info[0], sys.version_info[1], platform.python_version())"

EVERYTHING = "it can do everything"
NO_UR = "all but real and emulated UR arms: ur_rtde has wheels for CPython 3.11 and 3.12 on x86-64"


def version(python):
    """Return (major, minor) and the whole version of a Python; None if there is none of that name."""
    try:
        told = subprocess.check_output([python, "-c", ASK], stderr=subprocess.DEVNULL).decode().split()
    except (OSError, subprocess.CalledProcessError):
        return None
    return (int(told[0]), int(told[1])), told[2]


def best(found):
    """Return the name of the best of what was found, a dict of versions by name; None if none will do."""
    able = [name for name in found if found[name][0] >= OLDEST]
    return next((name for name in able if found[name][0] in UR), able[0] if able else None)


def main(environment, named=None):
    """Choose, tell, and make the environment."""
    names = [named] if named else NAMES
    found = {name: told for name in names for told in [version(name)] if told}
    chosen = best(found)
    if chosen is None:
        seen = ", ".join(f"{name} is {found[name][1]}" for name in found) or f"none of {', '.join(names)} runs"
        sys.exit(
            f"palpate needs CPython 3.11 or newer: {seen}. Install one, or name it: make PYTHON=/path/to/python"
        )
    can = EVERYTHING if found[chosen][0] in UR and platform.machine() in ("x86_64", "AMD64") else NO_UR
    asked = "as you asked; " if named else ""
    print(f"{environment}: CPython {found[chosen][1]} ({chosen}): {asked}{can}", flush=True)
    subprocess.check_call([chosen, "-m", "venv", environment])


if __name__ == "__main__":
    main(*sys.argv[1:])
