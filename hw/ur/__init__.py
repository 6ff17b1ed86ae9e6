"""Arms of Universal Robots, over the maker's real-time interface and the ur_rtde library."""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from palpate.hw.ur.arm import UrArm
    from palpate.hw.ur.goals import ForceTask
    from palpate.hw.ur.settings import FlangePayload, UrSettings
    from palpate.hw.ur.tool_sensor import UrRawToolSensor, UrToolSensor

__all__ = ["FlangePayload", "ForceTask", "UrArm", "UrRawToolSensor", "UrSettings", "UrToolSensor"]

_HOME = {
    "ForceTask": "palpate.hw.ur.goals",
    "FlangePayload": "palpate.hw.ur.settings",
    "UrArm": "palpate.hw.ur.arm",
    "UrRawToolSensor": "palpate.hw.ur.tool_sensor",
    "UrSettings": "palpate.hw.ur.settings",
    "UrToolSensor": "palpate.hw.ur.tool_sensor",
}


def __getattr__(name: str) -> object:
    # Imported when first used: the client process needs none of it, and is up a second earlier.
    if name in _HOME:
        return getattr(import_module(_HOME[name]), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}; it has {', '.join(__all__)}")


def __dir__() -> list[str]:
    return sorted(__all__)
