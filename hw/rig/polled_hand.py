"""A hand whose bus is slower than the loop: a thread talks to it, the loop takes the newest state at once.

An exchange with servos takes one to several milliseconds, and up to `reply_timeout` where one is silent. Most of
that time the thread waits for the wire, and the loop runs.
"""

import threading
from time import monotonic

from palpate.errors import positive
from palpate.hw.devices import DeviceError, HandDevice, MovingHand, move_fingers
from palpate.runtime.data import HandSample
from palpate.runtime.watchdog import DeviceWatchdog, watchdogs_of
from palpate.spatial import Vector

_JOIN = 3.0
"""Longest to wait for the thread at the end [s]; no exchange takes so long."""


class PolledHand:
    """A `HandDevice` around another one. The hand goes on pressing as last commanded while the loop is silent."""

    def __init__(self, hand: HandDevice, period: float) -> None:
        """Take a hand.

        Args:
            hand: Used by nobody else while this one is started.
            period: From exchange to exchange [s]; as fast as it can if they take longer.

        Raises:
            InvalidValueError: The period is not above 0.
        """
        self.hand, self._period = hand, positive("period", period, "s")
        self._ending = threading.Event()
        self._thread: threading.Thread | None = None
        self._force: tuple[float, ...] | None = None
        self._velocity: tuple[Vector | None, ...] | None = None
        self._newest: HandSample | None = None
        self._error: Exception | None = None

    @property
    def name(self) -> str:
        """See `Device`."""
        return self.hand.name

    def watchdogs(self) -> tuple[DeviceWatchdog, ...]:
        """See `WatchdogSource`."""
        return watchdogs_of(self.hand)

    def start(self) -> None:
        """See `HandDevice`.

        Raises:
            DeviceError: It is not fit.
        """
        self.close()
        self._force, self._velocity, self._error = None, None, None
        self.hand.start()
        try:
            self._newest = self.hand.read()
            ending = self._ending = threading.Event()
            self._thread = threading.Thread(
                target=self._poll, args=(ending,), name=f"polls {self.name}", daemon=True
            )
            self._thread.start()
        except BaseException:
            self.close()
            raise

    def read(self) -> HandSample:
        """Return the newest state.

        Raises:
            DeviceError: See `HandDevice`; for the last exchange.
        """
        error, newest = self._error, self._newest
        if error is not None:
            raise error
        if newest is None:
            raise DeviceError(self.name, "it is not started", "call start() first")
        return newest

    def press(self, grip_force: tuple[float, ...]) -> None:
        """See `HandDevice`; an invalid force is reported by the next `read`."""
        self._force = grip_force

    def move(self, finger_velocity: tuple[Vector | None, ...] | None) -> None:
        """See `MovingHand`.

        Raises:
            InvalidValueError: The hand only closes.
        """
        if not isinstance(self.hand, MovingHand):
            move_fingers(self.hand, finger_velocity)
        self._velocity = finger_velocity

    def close(self) -> None:
        """See `Device`."""
        self._ending.set()
        thread, self._thread = self._thread, None
        if thread is not None:
            thread.join(_JOIN)
        self._newest = None
        self.hand.close()

    def _poll(self, ending: threading.Event) -> None:
        hand, deadline = self.hand, monotonic()
        while not ending.is_set():
            try:
                force = self._force
                if force is not None:
                    hand.press(force)
                if isinstance(hand, MovingHand):
                    hand.move(self._velocity)
                self._newest = hand.read()
                self._error = None
            except Exception as error:  # reported to the loop, whatever it is; the next exchange may succeed
                self._error = error
            now = monotonic()
            deadline = max(deadline + self._period, now)
            ending.wait(deadline - now)
