"""Whether an arm that is commanded to stand still comes to rest: judged by its speed and by its position."""

import math

from palpate.runtime.data import ArmSample
from palpate.runtime.rest import RobotRest
from palpate.runtime.watchdog import DeviceWatchdog
from palpate.spatial import norm, subtract

REST_SPEED = 1e-3
"""A tip slower than this [m/s] counts as stopped."""

REST_TIME = 0.02
"""for this long [s]: a turning point is not rest."""

REST_STEP = 5e-5
"""A position this near [m] has not changed: repeatability of an arm (UR5e, data sheet: 0.03 mm)."""

LEAST_PATH = 0.5
"""Of the length that the reported speed makes, which positions must show for the arm to be called moving."""

OLDEST_MOTION = 0.1
"""Age of a state [s] from which on it says no more of an arm that moved then: it may have stopped since."""

LONGEST_STOP = 0.5
"""How long the robot is given to come to rest [s]."""


class StandstillCheck:
    """Takes the arm's states of a stop, one per period.

    Attributes:
        at_rest: Whether it has stood still for `REST_TIME`.
        longest: Periods that it is given.
    """

    def __init__(self, first: ArmSample, period: float, oldest: float) -> None:
        """Begin a stop.

        Args:
            first: State before it.
            period: Control period [s].
            oldest: Age from which on a state is not believed [s].
        """
        self._wanted = max(1, round(REST_TIME / period))
        self.longest = max(self._wanted, round(LONGEST_STOP / period))
        self.at_rest = False
        self._since, self._oldest, self._slow = first, oldest, 0
        self._speed, self._last, self._reported, self._path = math.nan, first, 0.0, 0.0
        self._age = math.inf

    def add(self, time: float, arm: ArmSample) -> None:
        """Take a period's state at `time` [s]. One that is too old, or makes no sense, says nothing."""
        self._speed = speed = self._speed_of(time, arm)
        if speed < REST_SPEED:
            self._slow += 1
            watched = arm.time - self._since.time  # an arm that repeats an old state shows nothing
            self.at_rest = self._slow >= self._wanted and watched >= 0.5 * REST_TIME
        else:
            self._slow, self._since = 0, arm

    def lost(self) -> None:
        """Take a period in which the arm could not be read."""
        self._slow, self._speed = 0, math.nan

    def rest(self, watchdogs: tuple[DeviceWatchdog, ...]) -> RobotRest:
        """Return how it ended; `watchdogs` stop the robot where that is not known."""
        if self.at_rest:
            return RobotRest.at_rest()
        moves = self._path > 0.0 and self._path >= LEAST_PATH * self._reported  # a repeated state shows nothing
        if moves and self._speed >= REST_SPEED and self._age <= OLDEST_MOTION:
            return RobotRest.moving(self._speed)
        return RobotRest.not_known(watchdogs)

    def _speed_of(self, time: float, arm: ArmSample) -> float:
        """Return the speed that the arm reports [m/s], or that its positions show if they do not bear that out."""
        last, self._last = self._last, arm
        try:
            self._age = time - arm.time
            if not self._age <= self._oldest:
                return math.nan
            reported, passed = norm(arm.velocity_base_tip), arm.time - self._since.time
            step = norm(subtract(arm.position_base_tip, last.position_base_tip))
            if step < math.inf and reported < math.inf:
                self._path += step
                self._reported += reported * (arm.time - last.time)
            gone = norm(subtract(arm.position_base_tip, self._since.position_base_tip))
            if not reported < REST_SPEED or gone < REST_SPEED * passed + REST_STEP:
                return reported if reported < math.inf else math.nan
            return gone / passed if passed > 0.0 else math.nan
        except Exception:  # a device's nonsense must not end the braking
            return math.nan
