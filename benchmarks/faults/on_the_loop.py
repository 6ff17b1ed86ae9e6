"""A fault in what passes through the loop, tried on a simulated robot whose truth is known."""

import random
from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module

from faults.fault_rig import FaultyBackend, Injection, Outcome, Rig, carry_out
from faults.fault_table import FASTEST_RETRACT
from faults.kind import Moment, Verdict, Workshop
from palpate.errors import InvalidValueError
from palpate.experiments.regulate.config import RegulateConfig
from palpate.experiments.regulate.experiment import Regulate
from palpate.robots.robot import Robot
from palpate.robots.values import load_named_robot
from palpate.runtime.log import LogWriter, read_log
from palpate.runtime.rest import RestState
from palpate.runtime.result import Ending, RunResult
from palpate.runtime.touch import Touch
from palpate.spatial import norm, subtract

FORCE_EXCESS = 1.5
"""Largest true force, in units of the limit; and what one period at the allowed speed adds."""

MOTION_EXCESS = 1.02
"""Largest commanded speed and acceleration, in units of the limit."""

REST_SPEED = 1e-3
"""[m/s]: a slower tip is at rest, as the loop has it."""


def reported_rest(result: RunResult) -> RestState:
    """Return what a result says of it."""
    return result.rest.state


def contradiction(reported: RestState, measured: RestState) -> tuple[str, ...]:
    """Return what is wrong with what was reported; nothing if it agrees, or if nobody could know."""
    if RestState.NOT_KNOWN in (reported, measured) or reported is measured:
        return ()
    return (f"reported {reported.value}, measured {measured.value}",)


DURATION = 0.6
"""For which the force is held [s]."""


def robot_of(name: str) -> Robot:
    """Return the robot of a name, a file, or `module:factory`.

    Raises:
        InvalidValueError: There is none, or the factory makes something else.
    """
    module, colon, factory = name.partition(":")
    if not colon or (not module.isidentifier() and "." not in module):
        return load_named_robot(name)
    made = getattr(import_module(module), factory)()
    if not isinstance(made, Robot):
        raise InvalidValueError(
            f"robot = {name!r}: makes a {type(made).__name__}; must be a palpate.robots.robot.Robot"
        )
    return made


def planned_rig(name: str, seed: int) -> Rig:
    """Return a rig of this robot that holds a force, as `palpate regulate` plans it."""
    config = RegulateConfig(robot=name, duration=DURATION)
    plan = Regulate().plan(config, robot_of(name), {})
    return Rig(
        FaultyBackend(plan.backend()),
        Touch(*plan.fingers),
        plan.controller(),
        plan.limits,
        plan.longest_duration,
        expected=plan.expected_duration,
        stiffness=20e3,
    )


@dataclass(frozen=True, slots=True)
class OnTheLoop:
    """Tries an injection at any period of a run.

    Attributes:
        injection: What goes wrong.
        rig: What it is tried on.
        fixed: Whether only this rig will do: a hand, a sensor with a file.
    """

    injection: Injection
    rig: Callable[[], Rig]
    fixed: bool = False

    def __call__(self, moment: Moment, workshop: Workshop) -> Verdict:
        """Run, spoil it, and compare what is reported with what is true."""
        rig = self.rig() if self.fixed or workshop.robot is None else planned_rig(workshop.robot, moment.seed)
        random.seed(moment.seed)
        at = 1 + int(moment.share * (rig.busy_periods - 1))
        watch = Watch(rig)
        self.injection.into(rig, at)
        path = workshop.folder / "run.mcap"
        path.unlink(missing_ok=True)
        problems = list[str]()
        try:
            outcome = carry_out(rig, file=LogWriter(path))
        except (SystemExit, GeneratorExit) as error:  # are not the loop's to keep
            reported, log, measured = type(error).__name__, read_log(path), measured_rest(rig.backend)
        else:
            reported, log, measured = _reported(outcome), read_log(path), measured_rest(rig.backend)
            problems += contradiction(reported_rest(outcome.result), measured)
            lost = len(outcome.log.record()) - len(log)
            problems += [f"{lost} periods are not in the log"] if lost else []
        problems += watch.problems()
        if not log.complete:
            problems.append("the log was not finished")
        if measured is RestState.MOVING:
            problems.append("moves after the end")
        if rig.backend.closed_after is None:
            problems.append("the back end was not closed")
        return Verdict(reported, tuple(problems))


class Watch:
    """The largest that was commanded and that really happened."""

    def __init__(self, rig: Rig) -> None:
        """Watch a rig from now on."""
        self._rig = rig
        rig.backend.watch = self._see
        self._force = 0.0

    def _see(self) -> None:
        truth = getattr(self._rig.backend.sound, "truth", None)
        if truth is not None:
            self._force = max(self._force, norm(truth().force))

    def problems(self) -> list[str]:
        """Return which limits were exceeded, by how much."""
        rig, found = self._rig, []
        limits, backend = rig.limits, rig.backend
        stiffness = rig.stiffness * limits.speed * backend.period
        if self._force > FORCE_EXCESS * limits.force + stiffness:
            found.append(f"true force {self._force:.1f} N at a limit of {limits.force:g} N")
        speeds = [norm(command.velocity_base_tip) for command in backend.commands]
        if speeds and not max(speeds) <= MOTION_EXCESS * max(limits.speed, FASTEST_RETRACT):
            found.append(f"commanded {max(speeds):.3g} m/s at a limit of {limits.speed:g} m/s")
        truly = [norm(sample.arm.velocity_base_tip) for sample in backend.truly]
        if not max(truly) <= MOTION_EXCESS * limits.speed:
            found.append(f"moved with {max(truly):.3g} m/s at a limit of {limits.speed:g} m/s")
        grips = [grip for command in backend.commands for grip in command.grip_force or ()]
        if grips and not max(grips) <= MOTION_EXCESS * limits.grip_force:
            found.append(f"commanded a grip of {max(grips):.3g} N at a limit of {limits.grip_force:g} N")
        return found


def measured_rest(backend: FaultyBackend) -> RestState:
    """Return whether the robot truly stands at the end, by its last two true positions and its true speed."""
    if len(backend.truly) < 2:
        return RestState.NOT_KNOWN
    *_, before, last = (sample.arm for sample in backend.truly)
    gone = norm(subtract(last.position_base_tip, before.position_base_tip)) / backend.period
    return RestState.MOVING if max(gone, norm(last.velocity_base_tip)) > REST_SPEED else RestState.AT_REST


def _reported(outcome: Outcome) -> str:
    trip, ending = outcome.result.trip, outcome.result.ending
    return ending.value if trip is None or ending is not Ending.TRIPPED else f"trip: {trip.measure}"
