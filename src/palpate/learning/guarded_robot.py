"""One control period for callers with a loop of their own: step, sense, supervise."""

from contextlib import ExitStack, suppress

from palpate.errors import positive
from palpate.runtime import Backend, Command, Observation, Phase, Supervisor, Touch
from palpate.runtime.closing import Closing
from palpate.runtime.following import CommandedMotion
from palpate.runtime.interpreter import undisturbed
from palpate.runtime.standstill_check import LONGEST_STOP, REST_SPEED
from palpate.runtime.stopping import stopping_of
from palpate.runtime.supervision import Trip
from palpate.spatial import ZERO, Vector, norm, toward

SLEW = 10.0
"""Bound on the change of the commanded velocity [m/s^2]: 10 mm/s in a millisecond, as explorations have it; the
supervisor stops at 25 m/s^2."""


class GuardedRobot(Closing):
    """A back end between touch and supervisor, stepped from outside; `run` is the alternative with its own loop.

    The commanded velocity changes no faster than a slew limit allows, and the supervisor sees every
    observation and every command. Once it has tripped, only its reaction moves the robot.

    Attributes:
        now: The newest observation.
    """

    now: Observation

    def __init__(self, backend: Backend, touch: Touch, supervisor: Supervisor, slew: float = SLEW) -> None:
        """Take a robot; nothing moves, nor is opened, before `start`.

        Args:
            backend: The robot.
            touch: Its fingers.
            supervisor: Its limits.
            slew: Bound on the change of the commanded velocity [m/s^2].

        Raises:
            InvalidValueError: The slew is not above 0.
        """
        self.backend, self._touch, self._supervisor = backend, touch, supervisor
        self._most_change = positive("slew", slew, "m/s^2") * backend.period
        self._velocity: Vector = ZERO
        self._episode = ExitStack()

    @property
    def period(self) -> float:
        """Control period [s]."""
        return self.backend.period

    @property
    def trip(self) -> Trip | None:
        """Trip of the supervisor; None if there is none."""
        return self._supervisor.trip

    @property
    def commanded(self) -> Vector:
        """Velocity that was commanded last, base frame [m/s]."""
        return self._velocity

    @property
    def error(self) -> Exception | None:
        """The exception behind the trip, if it was one."""
        return self._supervisor.error

    def start(self) -> Observation:
        """Start the robot, from the beginning, with a trip forgotten; return the first observation.

        From here to `stop` or `close` garbage collection and thread switches are held off as in the loop; see
        `undisturbed`.
        """
        self._episode.close()
        self._supervisor.reset()
        self._supervisor.start(self.backend.period, stopping_of(self.backend))
        sample = self.backend.start()
        self._touch.start()
        self._velocity = ZERO
        self._following = CommandedMotion(self.backend.period, sample.arm)
        self.now = self._touch.sense(sample)
        self._supervisor.admits(self.now)
        self._episode.enter_context(undisturbed())
        self.backend.pacer.start()
        return self.now

    def step(self, velocity_base_tip: Vector) -> Observation:
        """Move for one period, and return what is observed then: the old observation, if a device was lost.

        Args:
            velocity_base_tip: Wanted velocity of the tip frame's origin, base frame [m/s].
        """
        supervisor = self._supervisor
        if supervisor.trip is None:
            wanted = toward(self._velocity, velocity_base_tip, self._most_change)
            command = supervisor.check(self.now, Command(wanted, Phase.HOLD))
        else:
            command = supervisor.react(self.now)
        self._velocity = command.velocity_base_tip
        try:
            before, sample = self.now, self.backend.step(command)
            self.now = self._touch.sense(sample)
            self._following.take(command, before, sample)
        except Exception as error:  # as in the loop: it stops the robot, and is reported
            supervisor.fail(self.now.time, "back end", error)
        else:
            supervisor.admits(self.now)
        return self.now

    def stop(self) -> bool:
        """Let a reaction that has begun end, and bring the tip to rest; return whether it came to rest."""
        with self._episode:
            return self._rest(self._supervisor)

    def close(self) -> None:
        """Leave the robot stopped, and let go of it; may be called more than once."""
        with self._episode, suppress(Exception):
            self.backend.pacer.stop()
        self.backend.close()

    def _rest(self, supervisor: Supervisor) -> bool:
        while supervisor.reacting:
            self.step(ZERO)
        for _ in range(round(LONGEST_STOP / self.period)):
            if supervisor.error is not None:
                return False
            if self._velocity == ZERO and norm(self.now.arm.velocity_base_tip) < REST_SPEED:
                return True
            self.step(ZERO)
        return False


def approach(robot: GuardedRobot, velocity: Vector, farthest: float) -> bool:
    """Move until something is touched; the tip stands still then. Return whether something was.

    Args:
        robot: That has been started.
        velocity: Of the tip, base frame [m/s].
        farthest: Path length after which it gives up [m].
    """
    speed = norm(velocity)
    periods = round(farthest / (speed * robot.period)) if speed > 0.0 else 0
    for _ in range(periods):
        if robot.now.fingers[0].touching or robot.trip is not None:
            break
        robot.step(velocity)
    while robot.trip is None and robot.commanded != ZERO:
        robot.step(ZERO)
    return robot.now.fingers[0].touching
