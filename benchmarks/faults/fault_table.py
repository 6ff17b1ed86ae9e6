"""The fault table: what goes wrong, how it is brought about, what the supervisor says, what the robot does."""

import math
import signal
from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import Enum

from faults.fault_rig import (
    Commands,
    Injection,
    Limited,
    Live,
    LostDevice,
    Observing,
    Samples,
    raising,
)
from palpate.errors import OverrunError
from palpate.runtime.data import Command, Sample
from palpate.runtime.result import Ending

NAN, INF = math.nan, math.inf
RETRACT_SPEED, FASTEST_RETRACT = 0.02, 0.1
"""[m/s]: at first, and where that does not keep the force from rising; and"""
RETRACT_DISTANCE = 0.1
"""[m] the farthest, as from a made-up force that never ends: as the supervisor's reactions are documented."""


class Reaction(Enum):
    """What the robot may do from the trip on, its grip kept."""

    STAND = "stands still"
    RETRACT = "draws back along the contact normal, then stands still"


@dataclass(frozen=True)
class Fault:
    """One line of the table.

    Attributes:
        name: For people.
        injection: How it is brought about.
        measure: What the trip must name; None: there is no trip.
        value: What the trip's value must show.
        reaction: What the robot may do.
        delay: From the first period with the fault to the one that trips: 0 but where a limit must first be
            exceeded.
        ending: How the run ends.
    """

    name: str
    injection: Injection
    measure: str | None
    value: str = ""
    reaction: Reaction = Reaction.STAND
    delay: int = 0
    ending: Ending = Ending.TRIPPED

    def __str__(self) -> str:
        return self.name


def finger(change: Callable[..., object]) -> Samples:
    """The first finger's sample is changed: `change(now, before)`."""

    def changed(now: Sample, before: Sample) -> Sample:
        first, *others = now.wrenches
        return replace(now, wrenches=(change(first, before.wrenches[0]), *others))

    return Samples(changed)


def reading(change: Callable[..., object]) -> Samples:
    """The first finger's reading is changed: `change(fx, fy, fz, mx, my, mz)`."""
    return finger(lambda now, before: replace(now, wrench=change(*now.wrench)))


def arm(**changes: Callable[..., object]) -> Samples:
    """The arm's sample is changed, field by field: `field=change(now, before)`."""

    def changed(now: Sample, before: Sample) -> Sample:
        return replace(now, arm=replace(now.arm, **{name: f(now.arm, before.arm) for name, f in changes.items()}))

    return Samples(changed)


def _stamped_back(now: Sample, before: Sample) -> Sample:
    """A clock that was set back by a second."""
    return replace(
        now,
        time=now.time - 1.0,
        arm=replace(now.arm, time=now.arm.time - 1.0),
        wrenches=tuple(replace(w, time=w.time - 1.0) for w in now.wrenches),
    )


def _commanded(**changes: object) -> Commands:
    return Commands(lambda command: replace(command, **changes))


def _signal(number: int) -> Commands:
    def act(command: Command) -> Command:
        signal.raise_signal(number)
        return command

    return Commands(act)


def _twisted(*wrench: float) -> tuple[float, ...]:
    """3 mN m more about the force's axis."""
    (x, y, z), (a, b, c) = wrench[:3], wrench[3:]
    twist = 0.003 / math.hypot(x, y, z)
    return (x, y, z, a + twist * x, b + twist * y, c + twist * z)


ANYWHERE = (
    Fault("a force is NaN", reading(lambda x, y, z, *m: (x, NAN, z, *m)), "wrench of finger 1", "not finite"),
    Fault("a moment is infinite", reading(lambda *w: (*w[:5], INF)), "wrench of finger 1", "not finite"),
    Fault("the position is NaN", arm(position_base_tip=lambda a, b: (0.0, NAN, 0.0)), "arm state", "not finite"),
    Fault("the velocity is NaN", arm(velocity_base_tip=lambda a, b: (NAN, 0.0, 0.0)), "arm state", "not finite"),
    Fault(
        "force over the limit",
        reading(lambda x, y, z, *m: (15.0 * x, 15.0 * y, 15.0 * z, *[15.0 * a for a in m])),
        "contact force",
        " N",
        Reaction.RETRACT,
    ),
    Fault(
        "spin torque over the limit",
        Limited({"spin_torque": 0.002}, reading(_twisted)),
        "spin torque",
        " N m",
        Reaction.RETRACT,
    ),
    Fault(
        "measured speed over the limit",
        arm(velocity_base_tip=lambda a, b: (0.3, 0.0, 0.0)),
        "measured speed of the tip",
        "0.3 m/s",
    ),
    Fault("outside the workspace", arm(position_base_tip=lambda a, b: (0.0, 0.0, 1.01)), "tip position", "1.0100"),
    Fault(
        "a joint out of its range",
        Limited(
            {"joint_lower": (-1.0, -1.0), "joint_upper": (1.0, 1.0)}, arm(joint_position=lambda a, b: (0.0, 1.2))
        ),
        "position of joint 2",
        "1.2",
    ),
    Fault(
        "a joint is NaN",
        Limited(
            {"joint_lower": (-1.0, -1.0), "joint_upper": (1.0, 1.0)}, arm(joint_position=lambda a, b: (NAN, 0.0))
        ),
        "position of joint 1 of the arm",
        "nan",
    ),
    Fault("time goes backwards", Samples(_stamped_back), "time of the sample", " s"),
    Fault(
        "time stands still",
        Samples(lambda now, before: before),
        "time of the sample",
        " s",
    ),
    Fault(
        "the arm's time stamp goes backwards by 5 ms",
        arm(time=lambda a, b: a.time - 0.005),
        "time stamp of the arm",
        " s",
    ),
    Fault(
        "the sensor's time stamp goes backwards by 5 ms",
        finger(lambda now, before: replace(now, time=now.time - 0.005)),
        "time stamp of force/torque sensor 1",
        " s",
    ),
    Fault(
        "the sensor's time stamp is of the future",
        finger(lambda now, before: replace(now, time=now.time + 0.5)),
        "age of the sample of force/torque sensor 1",
        "-500 ms",
    ),
    Fault(
        "the arm repeats its last sample",
        Samples(lambda now, before: replace(now, arm=before.arm)),
        "age of the sample of the arm",
        "21 ms",
        delay=20,
    ),
    Fault(
        "the sensor repeats its last sample",
        finger(lambda now, before: before),
        "age of the sample of force/torque sensor 1",
        "21 ms",
        delay=20,
    ),
    Fault("a wrench is missing", Samples(lambda now, before: replace(now, wrenches=())), "touch", "0 wrenches"),
    Fault("a device is lost for one period", LostDevice(1), "back end", "OSError: no reply"),
    Fault("a device is lost for good", LostDevice(10_000), "back end", "OSError: no reply"),
    Fault(
        "an overrun that is not tolerated",
        LostDevice(1, lambda: OverrunError("late")),
        "back end",
        "OverrunError: late",
    ),
    Fault("the controller raises", Commands(raising(lambda: ZeroDivisionError("1/0"))), "controller", "1/0"),
    Fault("the controller returns nothing", Commands(lambda c: None), "what the controller returned", "None"),
    Fault(
        "the controller returns NaN",
        _commanded(velocity_base_tip=(NAN, 0.0, 0.0)),
        "commanded velocity",
        "nan",
    ),
    Fault(
        "the controller returns two numbers",
        _commanded(velocity_base_tip=(0.0, 0.0)),
        "commanded velocity",
        "(0.0, 0.0)",
    ),
    Fault(
        "the controller is too fast",
        _commanded(velocity_base_tip=(0.0, 0.0, 0.3)),
        "commanded speed",
        "0.3 m/s",
    ),
    Fault(
        "the controller jumps",
        _commanded(velocity_base_tip=(0.0, 0.15, 0.0)),
        "commanded acceleration",
        " m/s^2",
    ),
    Fault("the controller grips too hard", _commanded(grip_force=(50.0, 50.0)), "commanded grip force", "50 N"),
    Fault("an observer raises", Observing(raising(lambda: KeyError("x"))), "observer", "KeyError"),
    Fault("live parameters raise", Live(raising(lambda: RuntimeError("no"))), "live parameters", "no"),
    Fault("Ctrl-C", _signal(signal.SIGINT), None, ending=Ending.INTERRUPTED),
    Fault("SIGTERM", _signal(signal.SIGTERM), None, ending=Ending.INTERRUPTED),
    Fault("the terminal is closed", _signal(signal.SIGHUP), None, ending=Ending.INTERRUPTED),
)
"""On any robot."""


def _overloaded(*wrench: float) -> tuple[float, ...]:
    """More than eight times the load: about 18 N, beyond a Nano17's limits and short of the supervisor's."""
    return tuple(8.5 * x for x in wrench)


ON_A_SENSOR = (
    Fault(
        "the sensor freezes (fresh time stamps)",
        finger(lambda now, before: replace(now, wrench=before.wrench)),
        "force/torque sensor 1",
        "no channel has changed for too many samples",
        delay=18,  # the 20th equal sample: the one before the fault is the first of them
    ),
    Fault(
        "a channel is stuck",
        finger(lambda now, before: replace(now, wrench=(*now.wrench[:5], before.wrench[5]))),
        "force/torque sensor 1",
        "a channel has not changed for too many samples (channel 6)",
        delay=198,
    ),
    Fault(
        "load beyond the sensor's range",
        reading(_overloaded),
        "force/torque sensor 1",
        "load beyond",
        Reaction.RETRACT,
    ),
    Fault(
        "an accelerometer gone mad",
        finger(lambda now, before: replace(now, acceleration=(1e9, 0.0, 0.0))),
        "force/torque sensor 1",
        "far beyond anything",
    ),
    Fault(
        "a raw reading is NaN",
        reading(lambda *w: (NAN, *w[1:])),
        "force/torque sensor 1",
        "not a finite number (channel 1)",
    ),
)
"""Where a sensor file describes the sensor: what its health monitor knows."""


def hand(**changes: Callable[..., object]) -> Samples:
    """The hand's sample is changed."""

    def changed(now: Sample, before: Sample) -> Sample:
        return replace(
            now, hand=replace(now.hand, **{name: f(now.hand, before.hand) for name, f in changes.items()})
        )

    return Samples(changed)


WITH_A_HAND = (
    Fault(
        "the finger feels more than the grip limit",
        Limited({"grip_force": 10.0}, reading(lambda x, y, z, a, b, c: (5.0 * x, y, z, a, b, c))),
        "grip force",
        " N",
    ),
    Fault("a joint of the hand is NaN", hand(joint_position=lambda h, b: (NAN,)), "position of joint 1 of"),
    Fault(
        "the hand repeats its last sample",
        Samples(lambda now, before: replace(now, hand=before.hand)),
        "age of the sample of the hand",
        "21 ms",
        delay=20,
    ),
    Fault("the controller forgets a finger", _commanded(grip_force=(3.0,)), "commanded grip force", "(3.0,)"),
    Fault("the controller grips with NaN", _commanded(grip_force=(NAN, 3.0)), "commanded grip force", "nan"),
    Fault("the controller lets go of the negative", _commanded(grip_force=(-1.0, -1.0)), "commanded grip force"),
)
"""Where a hand holds something."""
