"""The process that makes the surface grow, and the end of the pipe that feeds it.

Neither the loop nor the pictures wait for it: contacts gather until it has replied, and then all that there are
go to it at once; so its reply is always of the newest. If it ends, the view goes on without a surface.
"""

import math
import os
import signal
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnContext
from time import monotonic

import numpy as np

from palpate.errors import FloatArray
from palpate.interruption import SIGNALS
from palpate.viewing.frames import Frames
from palpate.viewing.surface_grower import CONTACT_WIDTH, TIME, SurfaceGrower, contacts_of
from palpate.viewing.surface_view import GrownSurface, SurfaceView

NICENESS = 15
"""How far it steps back behind loop and pictures where they share a core (of 19, nice(2))."""

INTERVAL = 0.4
"""Least time between two surfaces [s]; at least as long as the last one took: it has half a core at most."""

MOST_WAITING = 50_000
"""Contacts that wait for it; beyond, every second one is left out: five megabytes, fifty seconds at 1 kHz."""

STOP_TIMEOUT = 10.0
"""How long it is given to end by itself [s]: a large mesh takes three."""


@dataclass(frozen=True, slots=True, eq=False)
class Batch:
    """What is sent to the process.

    Attributes:
        run: Number of the run; with a new one the surface begins anew.
        contacts: See `palpate.viewing.surface_grower`, shape (n, CONTACT_WIDTH).
    """

    run: int
    contacts: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class SurfaceUpdate:
    """What comes back.

    Attributes:
        run: Number of the run that it is of.
        surface: As it is now, or why there is none.
    """

    run: int
    surface: GrownSurface | str


class SurfaceWorker:
    """The process. Whoever starts it hands `connection` to a `SurfaceFeed`, and closes the worker in the end.

    Attributes:
        connection: The feed's end of the pipe.
    """

    def __init__(self, context: SpawnContext, view: SurfaceView) -> None:
        """Start it; it needs a second until it is ready, which nobody waits for."""
        self.connection, theirs = context.Pipe()
        self._process = context.Process(target=_serve, args=(theirs, view), name="palpate map", daemon=True)
        self._process.start()
        theirs.close()

    @property
    def is_alive(self) -> bool:
        """Whether it still runs."""
        return self._process.is_alive()

    @property
    def pid(self) -> int | None:
        """Its process id."""
        return self._process.pid

    def close(self) -> None:
        """End it; may be called more than once."""
        with suppress(OSError):
            self.connection.close()
        self._process.join(STOP_TIMEOUT)
        if self._process.is_alive():
            self._process.kill()
            self._process.join()


class SurfaceFeed:
    """Feeds the process, without ever waiting for its work; for one thread.

    Attributes:
        failed: Why no surface comes any more; None while all is well.
    """

    def __init__(self, connection: Connection, view: SurfaceView) -> None:
        """Take the pipe of a `SurfaceWorker`."""
        self.failed: str | None = None
        self._pipe, self._view = connection, view
        self._run, self._busy = 0, False
        self._waiting: list[FloatArray] = []
        self._first = 0.0
        self._asked, self._due = 0.0, 0.0
        self._newest, self._sent, self._shown = -math.inf, -math.inf, -math.inf  # last contacts' times [s]

    @property
    def waiting(self) -> int:
        """Contacts that were not sent yet."""
        return sum(len(part) for part in self._waiting)

    @property
    def behind(self) -> float:
        """How much was felt since what the last surface was made from [s], by the run's clock; 0 if nothing."""
        if self._newest == -math.inf:
            return 0.0
        return self._newest - max(self._shown, self._first)

    def add(self, frames: Frames) -> None:
        """Take the contacts of some periods."""
        if self.failed is not None:
            return
        contacts = contacts_of(frames, self._view)
        if not len(contacts):
            return
        if self._newest == -math.inf:
            self._first = float(contacts[0, TIME])
        self._newest = float(contacts[-1, TIME])
        self._waiting.append(contacts)
        if self.waiting > MOST_WAITING:
            self._waiting = [np.concatenate(self._waiting)[::2]]

    def clear(self) -> None:
        """Begin anew."""
        self._run += 1
        self._waiting = [np.zeros((0, CONTACT_WIDTH))]  # the process starts anew, too
        self._newest = self._sent = self._shown = -math.inf
        self._due = 0.0

    def take(self) -> GrownSurface | None:
        """Send what waits if the process is idle, and return the newest surface, if there is a new one."""
        if self.failed is not None:
            return None
        try:
            found = self._hear()
            if not self._busy and self._waiting and monotonic() >= self._due:
                self._pipe.send(Batch(self._run, np.concatenate(self._waiting)))
                self._waiting, self._busy, self._asked, self._sent = [], True, monotonic(), self._newest
        except (EOFError, OSError):
            self.failed = "the process that makes the map has ended: the view goes on without it"
            return None
        return found

    def _hear(self) -> GrownSurface | None:
        if not (self._busy and self._pipe.poll()):
            return None
        update: SurfaceUpdate = self._pipe.recv()
        now = monotonic()
        self._busy, self._due = False, now + max(INTERVAL, now - self._asked)
        if update.run != self._run:
            self._due = 0.0
            return None
        if isinstance(update.surface, str):
            self.failed = f"the map cannot be drawn: {update.surface}"
            return None
        self._shown = self._sent
        return update.surface


def _serve(pipe: Connection, view: SurfaceView) -> None:
    """What the process does, until the other end of the pipe is closed."""
    for number in SIGNALS:
        signal.signal(number, signal.SIG_IGN)  # they are for the loop
    if hasattr(os, "nice"):
        os.nice(NICENESS)
    grower, run = SurfaceGrower(view), 0
    while True:
        try:
            batch: Batch = pipe.recv()
        except (EOFError, OSError):
            return
        if batch.run != run:
            grower, run = SurfaceGrower(view), batch.run
        surface: GrownSurface | str
        try:
            grower.add(batch.contacts)
            surface = grower.grown()
        except Exception as error:
            surface = f"{type(error).__name__}: {error}"  # shown to whoever watches; a map is worth no run
        try:
            pipe.send(SurfaceUpdate(run, surface))
        except OSError:
            return
