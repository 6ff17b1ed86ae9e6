"""Controllers of one's own, for replays: `module:function`, called with the plan of the run."""

from collections.abc import Callable
from typing import Any, cast

from palpate.errors import InvalidValueError, shown
from palpate.named_object import named_object, raised
from palpate.runtime import Controller

ControllerMaker = Callable[[Any], Controller]
"""From the plan of the recorded run, with what is set otherwise, to a fresh controller for it."""


def load_controller_maker(name: str) -> ControllerMaker:
    """Return the function that `module:function` names; the present folder is looked in first.

    What it returns when it is called is checked to be a controller.

    Raises:
        InvalidValueError: There is no such module or function, or the module cannot be imported.
    """
    function = named_object("controller", name, "mine:make for the function make in mine.py")
    wanted = name.rpartition(":")[2]
    if not callable(function):
        raise InvalidValueError(
            f"controller = {name}: {wanted} is {shown(function, 80)}: must be a function that takes the "
            "plan of the run and returns a controller"
        )

    def make(planned: object) -> Controller:
        try:
            made = function(planned)
        except Exception as error:
            raise InvalidValueError(f"controller = {name}: {raised(wanted, error)}") from error
        missing = [step for step in ("start", "step") if not callable(getattr(made, step, None))]
        if missing or isinstance(made, type):
            raise InvalidValueError(
                f"controller = {name}: {wanted} returned {shown(made, 80)}: must be a controller, with the "
                "methods start(first) and step(now)"
            )
        return cast(Controller, made)

    return make
