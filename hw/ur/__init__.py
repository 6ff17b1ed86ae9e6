"""Arms of Universal Robots, over the maker's real-time interface and the ur_rtde library."""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from palpate.hw.ur.arm import UrArm
    from palpate.hw.ur.settings import FlangePayload, UrSettings
    from palpate.hw.ur.tool_sensor import UrToolSensor

__all__ = ["FlangePayload", "UrArm", "UrSettings", "UrToolSensor"]

_MODULES = {"FlangePayload": "settings", "UrArm": "arm", "UrSettings": "settings", "UrToolSensor": "tool_sensor"}


def __getattr__(name: str) -> object:
    # Imported when first used: the client process needs none of it, and starts a second earlier.
    if name in _MODULES:
        return getattr(import_module(f"palpate.hw.ur.{_MODULES[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}; it has {', '.join(__all__)}")


def __dir__() -> list[str]:
    return sorted(__all__)
