"""Make an environment of a Python that can do everything, where one is installed, and say which and why.

    python3 tests/install/choose_python.py ENVIRONMENT [PYTHON]

A PYTHON that is named is taken as it is. Runs on any Python 3, for that is what may be called `python3`.
"""

import platform
import subprocess
import sys

OLDEST = (3, 11)
UR = ((3, 11), (3, 12))
"""Versions that the client library of UR arms has wheels for, on Linux x86-64 and Windows."""

NAMES = ["python3", "python3.12", "python3.11", "python3.14", "python3.13"]
ASK = "import platform, sys; print(sys.version_info[0], sys.version_info[1], platform.python_version())"


def version(python):
    """Return major, minor and the whole version of a Python; None if there is none of that name."""
    try:
        told = subprocess.check_output([python, "-c", ASK], stderr=subprocess.DEVNULL).decode().split()
    except (OSError, subprocess.CalledProcessError):
        return None
    return (int(told[0]), int(told[1])), told[2]


def best(found):
    """Return the name of the best of what was found, a dict of versions by name; None if none will do."""
    able = [name for name in found if found[name][0] >= OLDEST]
    return next((name for name in able if found[name][0] in UR), able[0] if able else None)


def reason(python, found, named):
    """Return why that Python, in words."""
    ur = found[python][0] in UR and platform.machine() in ("x86_64", "AMD64")
    can = "it can do everything" if ur else "all but real and emulated UR arms, for which ur_rtde has wheels only for "
    can += "" if ur else "CPython 3.11 and 3.12 on x86-64"
    return "as you asked; " + can if named else can


def main(environment, python=None):
    """Choose, tell, and make the environment."""
    names = [python] if python else NAMES
    found = {name: told for name in names for told in [version(name)] if told}
    chosen = best(found)
    if chosen is None:
        seen = ", ".join("%s is %s" % (name, found[name][1]) for name in found) or "none of %s runs" % ", ".join(names)
        sys.exit("palpate needs CPython 3.11 or newer: %s. Install one, or name it: make PYTHON=/path/to/python" % seen)
    print("%s: CPython %s (%s): %s" % (environment, found[chosen][1], chosen, reason(chosen, found, bool(python))))
    sys.stdout.flush()
    subprocess.check_call([chosen, "-m", "venv", environment])


if __name__ == "__main__":
    main(*sys.argv[1:])
