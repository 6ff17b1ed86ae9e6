"""The plan on the screen: the path still to go, the path gone, and marks with their words."""

import math
from collections.abc import Sequence

import numpy as np
import viser

from palpate.errors import FloatArray
from palpate.runtime import palette
from palpate.runtime.palette import rgb
from palpate.runtime.plan_track import PlanTrack
from palpate.runtime.shown_plan import ShownMark, ShownPlan
from palpate.spatial import Vector
from palpate.viewing.view_scene import Colour

REST_COLOUR: Colour = rgb(palette.COMMAND)
DONE_COLOUR: Colour = rgb(palette.QUIET_COLOUR)
"""As in reports; grey beside it: what is done is dim."""

REST_WIDTH, DONE_WIDTH = 3.0, 1.5
"""Of the lines [pixels]."""

MARK_COLOURS: tuple[Colour, ...] = tuple(rgb(each) for each in palette.SIDE_BY_SIDE)
"""The first event that comes takes the first one. Words distinguish events, colours help."""

MARK_RADIUS = 4e-4
"""Of a mark's ball [m]: a few on a fingertip's width."""

LABEL_DISTANCE = 3e-3
"""Marks nearer than this share one line of words [m]: words on each other cannot be read."""

MOST_LABELS = 60
"""Lines more than these hide the scene."""


class PlanDrawing:
    """Lines and marks; one thread draws."""

    def __init__(self, server: viser.ViserServer) -> None:
        """Begin with nothing."""
        self._server, self._track = server, PlanTrack()
        self._lines: dict[str, viser.LineSegmentsHandle] = {}
        self._drawn: dict[str, int] = {}
        self._marks: tuple[ShownMark, ...] = ()
        self._balls: list[viser.SceneNodeHandle] = []
        self._words: list[viser.SceneNodeHandle] = []
        self._colours: dict[str, Colour] = {}
        self.leg = ""

    def follow(self, plan: ShownPlan) -> None:
        """Take the plan as it is now."""
        self._track.follow(plan)
        self.leg = plan.leg
        if plan.marks != self._marks:
            self._draw_marks(plan.marks)

    def move(self, positions: FloatArray) -> None:
        """Take where the tip was, base frame, shape (n, 3) [m]."""
        self._track.move(positions)

    def show(self) -> None:
        """Send the lines."""
        self._draw_line("/plan/done", self._track.done, DONE_COLOUR, DONE_WIDTH)
        self._draw_line("/plan/to_go", self._track.rest, REST_COLOUR, REST_WIDTH)

    def clear(self) -> None:
        """Forget everything."""
        self._track.clear()
        self.follow(ShownPlan())
        self.show()

    @property
    def events(self) -> dict[str, int]:
        """How many marks of each event there are."""
        return {name: sum(mark.event == name for mark in self._marks) for name in self._colours if name}

    def _draw_line(self, name: str, points: FloatArray, colour: Colour, width: float) -> None:
        if len(points) < 2:
            if name in self._lines:
                self._lines.pop(name).remove()
            return
        segments = np.stack([points[:-1], points[1:]], axis=1).astype(np.float32)
        if name in self._lines:
            self._lines[name].remove()
        self._lines[name] = self._server.scene.add_line_segments(
            name, segments, colour, thickness=width, thickness_units="screen"
        )

    def _draw_marks(self, marks: tuple[ShownMark, ...]) -> None:
        old = len(self._marks) if marks[: len(self._marks)] == self._marks else 0
        if old == 0:
            _remove(self._balls)
        _remove(self._words)  # a new mark may join the word of an old one
        self._marks, scene = marks, self._server.scene
        for i in range(old, len(marks)):
            event, position = marks[i].event, marks[i].position
            colour = self._colours.setdefault(event, MARK_COLOURS[len(self._colours) % len(MARK_COLOURS)])
            self._balls.append(
                scene.add_icosphere(f"/marks/mark_{i}", MARK_RADIUS, colour, subdivisions=1, position=position)
            )
        for i, (position, words) in enumerate(places(marks)):
            self._words.append(
                scene.add_label(
                    f"/marks/word_{i}", words, position=position, anchor="bottom-left", font_screen_scale=0.8
                )
            )


def _remove(handles: list[viser.SceneNodeHandle]) -> None:
    for handle in handles:
        handle.remove()
    handles.clear()


def places(marks: Sequence[ShownMark]) -> list[tuple[Vector, str]]:
    """Return where to write what: marks that are near each other share one line with every event once."""
    found: list[tuple[Vector, list[str]]] = []
    for mark in marks:
        words = next((words for at, words in found if math.dist(at, mark.position) < LABEL_DISTANCE), None)
        if words is None:
            if len(found) < MOST_LABELS:
                found.append((mark.position, [mark.event]))
        elif mark.event not in words:
            words.append(mark.event)
    return [(position, ", ".join(words)) for position, words in found]
