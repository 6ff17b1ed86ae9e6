"""Controllers of one's own, for replays: `module:function`, called with the plan of the run."""

import importlib
import importlib.util
import os
import sys
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, cast

from palpate.errors import InvalidValueError, shown
from palpate.nearest_name import nearest
from palpate.runtime import Controller

ControllerMaker = Callable[[Any], Controller]
"""From the plan of the recorded run, such as an `ExplorationPlan` or `GraspPlan`, with what is set otherwise, to a
fresh controller for it."""


def load_controller_maker(name: str) -> ControllerMaker:
    """Return the function that `module:function` names; the present folder is looked in first.

    What it returns when it is called is checked to be a controller.

    Raises:
        InvalidValueError: There is no such module or function, or the module cannot be imported.
    """
    module_name, colon, function_name = name.partition(":")
    if not (colon and module_name and function_name) or module_name.endswith(".py") or "/" in module_name:
        raise InvalidValueError(
            f"controller = {name}: write MODULE:FUNCTION, as in mine:make for the function make in mine.py"
        )
    with _present_folder_first():
        try:
            module = importlib.import_module(module_name)
        except ModuleNotFoundError as error:
            if error.name is None or not f"{module_name}.".startswith(f"{error.name}."):
                raise InvalidValueError(f"controller = {name}: {_raised(module_name, error)}") from error
            raise InvalidValueError(
                f"controller = {name}: there is no module {error.name}, neither in {os.getcwd()} nor installed"
            ) from None
        except Exception as error:
            raised = _raised(f"importing {module_name}", error)
            raise InvalidValueError(f"controller = {name}: {raised}") from error
    function = getattr(module, function_name, None)
    if function is None:
        own = [other for other in vars(module) if not other.startswith("_") and callable(getattr(module, other))]
        near = nearest(function_name, own)
        advice = f"did you mean {near}?" if near else f"there are {', '.join(own) or 'none'}"
        raise InvalidValueError(
            f"controller = {name}: no function of {module_name} is called {function_name}; {advice}"
        )
    if not callable(function):
        raise InvalidValueError(
            f"controller = {name}: {function_name} is {shown(function, 80)}: must be a function that takes the "
            "plan of the run and returns a controller"
        )

    def make(planned: object) -> Controller:
        try:
            made = function(planned)
        except Exception as error:
            raise InvalidValueError(f"controller = {name}: {_raised(function_name, error)}") from error
        missing = [step for step in ("start", "step") if not callable(getattr(made, step, None))]
        if missing or isinstance(made, type):
            raise InvalidValueError(
                f"controller = {name}: {function_name} returned {shown(made, 80)}: must be a controller, with the "
                "methods start(first) and step(now)"
            )
        return cast(Controller, made)

    return make


def _raised(what: str, error: Exception) -> str:
    """What an exception in somebody's code was, and where: the last line of theirs or of what they called."""
    where = traceback.extract_tb(error.__traceback__)
    line = f" ({where[-1].filename}, line {where[-1].lineno})" if where else ""
    if isinstance(error, SyntaxError):
        line = f" ({error.filename}, line {error.lineno})"
        return f"{what} raised {type(error).__name__}: {error.msg}{line}"
    return f"{what} raised {type(error).__name__}: {error}{line}"


@contextmanager
def _present_folder_first() -> Iterator[None]:
    """Look for modules in the present folder, as `python -m palpate` does and the installed command does not."""
    before = list(sys.path)
    sys.path.insert(0, os.getcwd())
    importlib.invalidate_caches()
    try:
        yield
    finally:
        sys.path[:] = before
