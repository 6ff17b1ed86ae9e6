"""A view of a run in a browser: tip, object, contact force and map in 3-D, forces as plots; live, or a log."""

from palpate.viewing.frames import Frames, frames_of_log
from palpate.viewing.live_view import LiveView
from palpate.viewing.player import Player
from palpate.viewing.server import ANY_PORT, LOOPBACK, USUAL_PORT, ViewUnavailableError
from palpate.viewing.view_scene import Part, Place, ViewScene

__all__ = [
    "ANY_PORT",
    "LOOPBACK",
    "USUAL_PORT",
    "Frames",
    "LiveView",
    "Part",
    "Place",
    "Player",
    "ViewScene",
    "ViewUnavailableError",
    "frames_of_log",
]
