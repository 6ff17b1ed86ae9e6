"""When a state was sampled, on this computer's clock, from the controller's own time stamps."""

import math

WINDOW = 0.25
"""[s] over which the shortest delay of a state is sought. Two are kept: clocks that part by 100 ppm, a poor
quartz, err by 0.05 ms in them. Shorter ones may see no short delay; longer ones take states for old too long
after a clock has slipped, as that of an emulator on a busy machine does."""

_STEP = 1e-6
"""[s] by which time goes on at least from state to state, while a quicker one corrects what was taken for it."""


class ControllerClock:
    """Learns how far the two clocks are apart.

    A state is seen later than it was sampled by a delay that is never negative, and now and then small: the least
    of (seen - sampled) over some seconds is the difference of the clocks, but for the shortest delay, a tenth of a
    millisecond or so.
    """

    def __init__(self, rate: float = 1.0) -> None:
        """Begin.

        Args:
            rate: How fast the controller's clock runs against this one.
        """
        self._rate = rate
        self._window_end = -math.inf
        self._previous = self._present = math.inf
        self._last = -math.inf

    def host_time(self, controller_time: float, seen: float) -> float:
        """Return when a state was sampled [s]: after the one before, and not after it was seen.

        Args:
            controller_time: Its time stamp; later than the one before [s].
            seen: When it was seen here [s]; later than the one before.
        """
        own = controller_time / self._rate
        offset = seen - own
        if seen >= self._window_end:
            self._previous, self._present = self._present, math.inf
            self._window_end = seen + WINDOW
        self._present = min(self._present, offset)
        time = own + min(self._previous, self._present)
        self._last = time = min(seen, max(time, self._last + _STEP))
        return time
