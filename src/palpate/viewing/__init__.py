"""A view of a run in a browser: tips, objects, contact forces and map in 3-D, forces as plots; live, or a log."""

from palpate.viewing.frames import FrameLayout, Frames, frames_of_log
from palpate.viewing.live_topics import LiveTopics
from palpate.viewing.live_view import LiveView
from palpate.viewing.player import Player
from palpate.viewing.rows import FrameMemory, FreePoses, RowMaker
from palpate.viewing.server import ANY_PORT, LOOPBACK, USUAL_PORT, ViewUnavailableError, check_host
from palpate.viewing.surface_view import SurfaceView
from palpate.viewing.topic_viewers import FOXGLOVE, RERUN
from palpate.viewing.view_scene import BASE, TIP, Part, Placement, TipPlacement, ViewScene

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
