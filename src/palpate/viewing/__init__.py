"""A view of a run in a browser: tips, objects, contact forces and map in 3-D, forces as plots; live, or a log.

What serves it is imported when it is first used: with viser and matplotlib, for which whoever only plans a run, or
each worker of a sweep, would wait half a second.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from palpate.viewing.frames import FrameLayout, Frames, frames_of_log
from palpate.viewing.rows import FrameMemory, FreePoses, RowMaker
from palpate.viewing.surface_view import SurfaceView
from palpate.viewing.view_scene import BASE, TIP, Part, Placement, TipPlacement, ViewScene

if TYPE_CHECKING:
    from palpate.viewing.live_topics import LiveTopics
    from palpate.viewing.live_view import LiveView
    from palpate.viewing.player import Player
    from palpate.viewing.server import ANY_PORT, LOOPBACK, USUAL_PORT, ViewUnavailableError, check_host
    from palpate.viewing.topic_viewers import FOXGLOVE, RERUN

__all__ = [
    "ANY_PORT",
    "BASE",
    "FOXGLOVE",
    "LOOPBACK",
    "RERUN",
    "TIP",
    "USUAL_PORT",
    "FrameLayout",
    "FrameMemory",
    "Frames",
    "FreePoses",
    "LiveTopics",
    "LiveView",
    "Part",
    "Placement",
    "Player",
    "RowMaker",
    "SurfaceView",
    "TipPlacement",
    "ViewScene",
    "ViewUnavailableError",
    "check_host",
    "frames_of_log",
]

_HOMES = {
    "LiveTopics": "live_topics",
    "LiveView": "live_view",
    "Player": "player",
    **dict.fromkeys(("ANY_PORT", "LOOPBACK", "USUAL_PORT", "ViewUnavailableError", "check_host"), "server"),
    **dict.fromkeys(("FOXGLOVE", "RERUN"), "topic_viewers"),
}
"""Modules that import what serves a view, by name."""


def __getattr__(name: str) -> Any:
    if name in _HOMES:
        return getattr(import_module(f"palpate.viewing.{_HOMES[name]}"), name)
    raise AttributeError(f"module 'palpate.viewing' has no attribute {name!r}")
