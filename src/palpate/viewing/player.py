"""A recorded run in the view: played, stopped, wound on and back."""

from collections.abc import Callable, Sequence
from multiprocessing import get_context
from time import monotonic, sleep

import numpy as np

from palpate.errors import InvalidValueError, positive
from palpate.runtime.closing import Closing
from palpate.runtime.shown_plan import PlanChange
from palpate.viewing.drawing import Drawing
from palpate.viewing.frames import Frames
from palpate.viewing.live_view import INTERVAL
from palpate.viewing.server import LOOPBACK, USUAL_PORT, ViewServer
from palpate.viewing.surface_worker import SurfaceFeed, SurfaceWorker
from palpate.viewing.view_scene import ViewScene

SPEEDS = (0.1, 0.25, 0.5, 1.0, 2.0, 5.0, 10.0, 50.0)
"""What people can choose, besides what they began with; times as fast as it was."""

IN_VIEW = 9
"""Postures of the run that the first camera has in view."""

SLIDER_STEP = 0.01
"""Of the time slider [s]."""


class Player(Closing):
    """Serves a recorded run to browsers."""

    def __init__(
        self,
        scene: ViewScene,
        frames: Frames,
        speed: float = 1.0,
        host: str = LOOPBACK,
        port: int = USUAL_PORT,
        plans: Sequence[PlanChange] = (),
    ) -> None:
        """Start serving, at the beginning of the run.

        Args:
            scene: What there is to see.
            frames: The run, at least one period. Where it does not say where free bodies are, they are shown where
                they start.
            speed: How many times as fast as it was; infinite for its end at once.
            host: Address to listen on.
            port: Where; 0 for one that is free.
            plans: Of the run, in order; none if nobody knows.

        Raises:
            InvalidValueError: There is nothing to play, or a value is impossible.
            ViewUnavailableError: The port is taken.
        """
        positive("speed", speed, "times", infinite_allowed=True)
        if not len(frames):
            raise InvalidValueError("there are no periods to show: the log is empty")
        start, layout = scene.placement.start, frames.layout
        for name, of_run, of_scene in (
            ("fingers", layout.fingers, len(scene.fingers)),
            # a stage in the place of an arm goes where its tip was
            ("joints", layout.joints if start.arm else 0, len(start.arm)),
            ("hand joints", layout.hand_joints, len(start.hand)),
        ):
            if of_run != of_scene:
                raise InvalidValueError(
                    f"the run has {of_run} {name}, the scene {of_scene}: they do not belong together"
                )
        self._frames, self._time = frames, frames.time - frames.time[0]
        self._duration = float(self._time[-1])
        self._plans, self._followed = tuple(plans), 0
        self.server = ViewServer("palpate", host, port)
        self._worker: SurfaceWorker | None = None
        try:
            feed = None
            if scene.surface is not None:
                self._worker = SurfaceWorker(get_context("spawn"), scene.surface)
                feed = SurfaceFeed(self._worker.connection, scene.surface)
            self.drawing = Drawing(self.server, scene, frames.postures(IN_VIEW), feed)
            gui = self.server.gui
            self._playing = gui.add_checkbox("play", True)
            speeds = sorted({f"{s:g} x" for s in SPEEDS} | {f"{speed:g} x"}, key=lambda text: float(text[:-2]))
            self._speed = gui.add_dropdown("speed", speeds, initial_value=f"{speed:g} x")
            longest = max(self._duration, SLIDER_STEP)
            self._slider = gui.add_slider("time [s]", 0.0, longest, SLIDER_STEP, 0.0)
        except BaseException:
            self.close()
            raise
        self._now, self._shown, self._slid = 0.0, 0, 0.0
        self._advance_to(0.0)

    @property
    def url(self) -> str:
        """What to open in a browser."""
        return self.server.url

    @property
    def time(self) -> float:
        """Where it is, from the beginning of the run [s]."""
        return self._now

    def step(self, passed: float) -> None:
        """Play on.

        Args:
            passed: Time since the last step [s].
        """
        self.drawing.step()
        slid = float(self._slider.value)
        if slid != self._slid:  # somebody has moved it
            self._slid = slid
            self._now = min(slid, self._duration)
        elif self._playing.value and self._now < self._duration:
            speed = float(self._speed.value[:-2])
            self._now = self._duration if np.isinf(speed) else min(self._now + speed * passed, self._duration)
            self._slid = SLIDER_STEP * int(self._now / SLIDER_STEP)  # no more digits than fit beside it
            self._slider.value = self._slid  # type: ignore[misc]  # it has a setter, which mypy does not find
        else:
            return
        self._advance_to(self._now)

    def play(self, going_on: Callable[[], bool] = lambda: True) -> None:
        """Play from when the first browser comes until Ctrl-C, and stay open after the end of the run.

        Args:
            going_on: Asked before every picture.

        Raises:
            KeyboardInterrupt: At Ctrl-C.
        """
        seen, before = False, monotonic()
        while going_on():
            sleep(INTERVAL)
            now = monotonic()
            if seen or self.server.get_clients():
                seen = True
                self.step(now - before)
            before = now

    def close(self) -> None:
        """Stop serving; may be called more than once."""
        self.server.stop()
        if self._worker is not None:
            self._worker.close()

    def _advance_to(self, time: float) -> None:
        """Show the run as it was then."""
        until = int(np.searchsorted(self._time, time, side="right"))
        if until < self._shown:
            self.drawing.clear()
            self._shown = self._followed = 0
        if until > self._shown:
            self._add_until(until)
            if until == len(self._frames) or not self._playing.value:
                self.drawing.refresh(self._frames[until - 1 : until])

    def _add_until(self, until: int) -> None:
        """Take the frames before `until`, each under the plan that was there."""
        while self._followed < len(self._plans):
            change = self._plans[self._followed]
            begins = int(np.searchsorted(self._frames.time, change.time, side="left"))
            if begins >= until:
                break
            if begins > self._shown:
                self.drawing.add(self._frames[self._shown : begins])
                self._shown = begins
            self.drawing.follow(change.plan)
            self._followed += 1
        self.drawing.add(self._frames[self._shown : until])
        self._shown = until
