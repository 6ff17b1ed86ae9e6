"""Files of robots by their names in the package `robot_descriptions`, which clones them at first use."""

import importlib
import importlib.util
import pkgutil
import sys
from contextlib import redirect_stdout
from pathlib import Path

from palpate.errors import InvalidValueError
from palpate.nearest_name import nearest

PACKAGE = "robot_descriptions"
PREFIX = f"{PACKAGE}:"
"""Of such a name in a robot file: `robot_descriptions:panda_mj_description`."""

_PATHS = ("MJCF_PATH", "URDF_PATH")


def described_path(named: str) -> Path:
    """Return the MJCF or URDF that such a name stands for.

    Raises:
        InvalidValueError: The package is not installed, knows no such robot, or cannot clone it.
    """
    name, spec = named.removeprefix(PREFIX), importlib.util.find_spec(PACKAGE)
    if spec is None:
        problem = f"{PACKAGE} is not installed; `pip install {PACKAGE}`, or give the path of a file"
        raise InvalidValueError(f"{named}: {problem}")
    known = [each.name for each in pkgutil.iter_modules(spec.submodule_search_locations)]
    if name not in known:
        near = nearest(name, known)
        meant = f"did you mean {near}?" if near else "its page lists them"
        raise InvalidValueError(f"{named}: {PACKAGE} has no such robot; {meant}")
    try:
        with redirect_stdout(sys.stderr):  # it reports how far it is
            module = importlib.import_module(f"{PACKAGE}.{name}")
    except Exception as error:  # whatever git, the network or its cache come up with
        first = (str(error).strip().splitlines() or [type(error).__name__])[0]
        remedy = f"run `python -m {PACKAGE} pull {name}` where there is a network, or give the path of a file"
        raise InvalidValueError(f"{named}: {PACKAGE} cannot load it: {first}; {remedy}") from error
    paths = (getattr(module, each, None) for each in _PATHS)
    found = next((path for path in paths if path is not None), None)
    if found is None:
        raise InvalidValueError(f"{named}: it has no {' or '.join(_PATHS)}; give a description that has one")
    return Path(found)
