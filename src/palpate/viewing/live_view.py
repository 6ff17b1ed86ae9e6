"""A live view: what a running loop sees, drawn by a process of its own.

A thread would share Python's interpreter lock with the loop, and drawing takes milliseconds of it. So the loop
writes one row per period into shared memory, which costs it two to four microseconds and never waits, and another
process, of lower urgency, draws what it finds there thirty times a second. Rows that it is too slow for are lost.
The surface of the map, which takes tenths of seconds, comes from a third process, of lower urgency still.
What people request in the browser comes back likewise, and takes effect as any other request for a change.
"""

import multiprocessing
import os
import signal
from collections.abc import Callable, Sequence
from contextlib import suppress
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnProcess

from palpate.errors import InvalidValueError
from palpate.interruption import SIGNALS
from palpate.runtime.closing import Closing
from palpate.runtime.data import Command, Observation, Sample
from palpate.runtime.live import LiveParameter, LiveParameters
from palpate.runtime.log import Sink
from palpate.runtime.shown_plan import PlanSource
from palpate.viewing.drawing import Drawing
from palpate.viewing.frames import FrameLayout, Frames
from palpate.viewing.live_controls import LiveControls
from palpate.viewing.plan_board import PlanBoard, PlanReader, PlanWriter
from palpate.viewing.request_board import BoardReader, BoardWriter, RequestBoard
from palpate.viewing.row_ring import CAPACITY, RingReader, RingWriter, RowRing
from palpate.viewing.rows import FreePoses, RowMaker
from palpate.viewing.server import LOOPBACK, USUAL_PORT, ViewServer, ViewUnavailableError
from palpate.viewing.surface_worker import SurfaceFeed, SurfaceWorker
from palpate.viewing.view_scene import ViewScene

INTERVAL = 1.0 / 30.0
"""Between two pictures [s]."""

NICENESS = 10
"""How far the view steps back behind the loop where they share a core (of 19, nice(2))."""

START_TIMEOUT = 60.0
"""The process imports what it needs in a second or two; on a busy machine in more [s]."""

STOP_TIMEOUT = 20.0
"""How long it is given to close by itself [s]."""

_OVER = "over"


class LiveView(Closing):
    """Shows a run in browsers while it goes on. Its `observe` is an `Observer` of the loop."""

    def __init__(
        self,
        scene: ViewScene,
        host: str = LOOPBACK,
        port: int = USUAL_PORT,
        *,
        live: LiveParameters | None = None,
        free_poses: FreePoses | None = None,
        plan: PlanSource | None = None,
        capacity: int = CAPACITY,
    ) -> None:
        """Start the view's process; takes a second or two.

        Programs that make one need `if __name__ == "__main__":` around it, as whatever starts processes with
        `multiprocessing`.

        Args:
            scene: What there is to see.
            host: Address to listen on. Whoever has `url`, with its token, may move the sliders.
            port: Where; 0 for one that is free.
            live: The controller's, with a slider each; none if not given.
            free_poses: Where the scene's free bodies are; if not given they are shown where they start.
            plan: Knows where the controller is going; if not given the view shows no plan.
            capacity: Periods that the view may be late before it loses some.

        Raises:
            ViewUnavailableError: The port is taken, or the process did not start.
            InvalidValueError: There is no such port.
        """
        live = live or LiveParameters()
        maker, parameters = RowMaker(scene, live, free_poses), tuple(live.parameters.values())
        context = multiprocessing.get_context("spawn")
        ring, board = RowRing(context, maker.layout.width, capacity), RequestBoard(context, tuple(live.parameters))
        plans = PlanBoard(context)
        self._take_up(maker, ring, board, live, plan, plans)
        self._worker = None if scene.surface is None else SurfaceWorker(context, scene.surface)
        self._pipe, theirs = context.Pipe()
        worker = None if self._worker is None else self._worker.connection
        self._process = context.Process(
            target=_serve,
            args=(ring, maker.layout, board, plans, parameters, scene, worker, host, port, theirs),
            name="palpate view",
            daemon=True,
        )
        self._process.start()
        theirs.close()
        if worker is not None:
            worker.close()  # the view's process has it: when that ends, the worker does
        self.url = url_from(self._pipe, self._process, self.close)

    def _take_up(
        self,
        maker: RowMaker,
        ring: RowRing,
        board: RequestBoard,
        live: LiveParameters,
        plan: PlanSource | None,
        plans: PlanBoard,
    ) -> None:
        """Prepare to write periods and plans, and to read requests."""
        self._row, self._write = maker.row, RingWriter(ring).write
        self._board, self._live = BoardReader(board), live
        self._news = _no_news if plan is None else plan.news
        self._plan = PlanWriter(plans)

    def observe(self, sample: Sample, now: Observation, command: Command) -> None:
        """Take a period, and what people ask for; never waits."""
        if self._board.is_new:
            self._request()
        plan = self._news()
        if plan is not None:
            self._plan.write(plan)
        self._write(self._row(now, command))

    def _request(self) -> None:
        for name, value in self._board.take():
            # checked here whatever the view lets through; nothing that comes in here may end a run
            with suppress(InvalidValueError):
                self._live.request(name, value)

    @property
    def sinks(self) -> tuple[Sink, ...]:
        """What the run's recorder is to be given for it: nothing."""
        return ()

    def run_over(self) -> tuple[str, ...]:
        """Tell who watches that the run is over: the sliders are put out.

        Returns:
            What was not as it should be, a sentence each.
        """
        with suppress(OSError):
            self._pipe.send(_OVER)
        if self._worker is None or self._worker.is_alive:
            return ()
        return ("The process that makes the map's surface has ended: the view goes on without it",)

    @property
    def is_alive(self) -> bool:
        """Whether the view is still being served."""
        return self._process.is_alive()

    @property
    def makes_surface(self) -> bool:
        """Whether the process that makes the map's surface is there."""
        return self._worker is not None and self._worker.is_alive

    def wait(self) -> None:
        """Return when the view's process ends; Ctrl-C raises KeyboardInterrupt."""
        self._process.join()

    def close(self) -> None:
        """End the view; may be called more than once."""
        end_process(self._pipe, self._process)
        if self._worker is not None:
            self._worker.close()


def end_process(pipe: Connection, process: SpawnProcess) -> None:
    """Close the pipe to a process, which ends it; kill the process if it still runs after `STOP_TIMEOUT`."""
    with suppress(OSError):
        pipe.close()
    process.join(STOP_TIMEOUT)
    if process.is_alive():
        process.kill()
        process.join()


def url_from(pipe: Connection, process: SpawnProcess, close: Callable[[], None]) -> str:
    """Wait for the address that a view's process sends; where it sends none, close the view.

    Raises:
        ViewUnavailableError: It has not started.
        Exception: What it has sent instead.
    """
    try:
        if not pipe.poll(START_TIMEOUT):
            raise ViewUnavailableError(f"the view did not start within {START_TIMEOUT:g} s: is the machine busy?")
        message: str | Exception = pipe.recv()
    except EOFError:
        close()
        raise ViewUnavailableError(
            f"the view's process ended at once (exit code {process.exitcode}); its reason stands above"
        ) from None
    except BaseException:
        close()
        raise
    if isinstance(message, Exception):
        close()
        raise message
    return message


def _no_news() -> None:
    """Of a plan that nobody has."""


def _serve(
    ring: RowRing,
    layout: FrameLayout,
    board: RequestBoard,
    plans: PlanBoard,
    parameters: Sequence[LiveParameter],
    scene: ViewScene,
    worker: Connection | None,
    host: str,
    port: int,
    pipe: Connection,
) -> None:
    """What the view's process does, until the other end of the pipe is closed."""
    for number in SIGNALS:
        signal.signal(number, signal.SIG_IGN)  # they are for the loop, which closes the view when it is done
    if hasattr(os, "nice"):
        os.nice(NICENESS)
    try:
        server = ViewServer("palpate", host, port)
    except Exception as error:
        pipe.send(error)
        return
    try:
        feed = None if worker is None or scene.surface is None else SurfaceFeed(worker, scene.surface)
        drawing, reader, plan_reader = Drawing(server, scene, feed=feed), RingReader(ring), PlanReader(plans)
        controls = LiveControls(server, parameters, BoardWriter(board).request)
        last = Frames(reader.read(), layout)  # nothing: whoever writes waits for the address
        pipe.send(server.url)
        while True:
            try:
                if pipe.poll(INTERVAL) and pipe.recv() == _OVER:
                    controls.end()
            except (EOFError, OSError):
                return  # the loop's process has closed the pipe, or is gone
            frames = Frames(reader.read(), layout)
            controls.step(frames)
            plan = plan_reader.news()
            if plan is not None:
                drawing.follow(plan)
            if len(frames):
                last = frames
                drawing.add(frames)
            elif len(last):
                drawing.refresh(last)
                last = frames
            drawing.step()
    finally:
        server.stop()
