"""Whether an arm that measures no force gives way only as far as its fingertip's sensor feels a push.

A position servo that is pushed with F stands F / K beside where its commands lead it. So the motion that does not
happen is a second channel of force, beside a sensor that may be dead. Like `palpate.runtime.following` this is for
runs of a robot: samples that are replayed under other options do not follow what is commanded there.
"""

import math
from dataclasses import dataclass
from functools import partial
from math import exp, hypot

import numpy as np

from palpate.compiling import machine_code, njit
from palpate.errors import FloatArray, check_positive, not_negative
from palpate.runtime.data import ArmSample, Command, Observation, Sample
from palpate.runtime.following import CommandedMotion, Following, FollowingError, FollowingMaker
from palpate.spatial import IDENTITY, ZERO, Matrix, Vector, Wrench, as_vector, dot, norm, rotate

SHARE = 0.35
"""Of the force limit, that may push an arm and is not felt. The true force may be twice as large: a tip that
friction holds sideways gives way less than by its stiffness, and servos give way later than a contact presses."""

ALONG, ACROSS = 0.5, 1.5
"""Of the felt force, by which an arm may give way otherwise along it and across it: its stiffness differs by
direction. A sensor that shows two thirds or more is not found."""

TIMING, CYCLES = 0.2, 3.0
"""Share of its response, or control periods if they are more, by which an arm may be late or early."""

SPEED_ERROR = 0.01
"""Of the path, which an arm may go too far or not."""

SETTLED = 0.1
"""[s] For which a speed may have its tip late: five times the response of a slow arm."""

MEMORY = 1.0
"""Time constant [s] with which the model is drawn to where the arm is, so that errors of speed do not add up: a
push that grows by less than `SHARE` of the limit in this time is not found."""


@dataclass(frozen=True, slots=True)
class PositionServo:
    """A critically damped position servo, alike in all directions.

    Attributes:
        stiffness: K, with which it holds the tip [N/m].
        response: 2 / w, how long it takes to follow [s].
        lag: How far it runs behind a ramp [s]: `response`, or less where velocity is fed forward.
    """

    stiffness: float
    response: float
    lag: float

    def __post_init__(self) -> None:
        check_positive(self, stiffness="N/m", response="s")
        not_negative("lag", self.lag, "s")

    def following(self, limit: float) -> FollowingMaker:
        """Return what compares commands with motion under a force limit [N].

        An arm that measures force by itself needs no model: `ForceComparison` of the supervisor is closer.
        """

        def made(period: float, first: ArmSample) -> Following:
            plain = CommandedMotion(period, first)
            return plain if first.tip_force_base is not None else ServoFollowing(self, limit, period, plain, first)

        return made


REFERENCE, PLACE, SPEED, FELT, OFF, FASTEST, PATH, ALLOWED = 0, 3, 6, 9, 12, 15, 16, 17
"""Where numbers of the memory stand. By axis: the servo's reference, where its model is [m], how fast [m/s], the
force that drew it aside [N], and how far the tip is from it [m]. Then the speed and the path for which the tip may
be late or elsewhere, and how far it may be [m]."""

RATE, COMPLIANCE, LEAD, PUSHED, LATE = 0, 1, 2, 3, 4
"""Where numbers of the model stand: 2 / response, 1 / stiffness, how far the reference leads [s], and how far the
tip may be pushed [m] and be late [s]."""


@njit(error_model="numpy", cache=True)
def is_aside(
    model: FloatArray,
    memory: FloatArray,
    time: float,
    rotation: Matrix,
    wrench: Wrench,
    commanded: Vector,
    position: Vector,
) -> bool:
    """Move the model on by a period; return whether the tip is farther from it than it may be in any direction.

    Args:
        model: Laid out as the constants above say,
        memory: likewise, written.
        time: Since the last period [s].
        rotation: Of the tip, base frame.
        wrench: That its finger feels, tip frame.
        commanded: Velocity [m/s], base frame.
        position: Of the tip after it [m].
    """
    turned, forget = model[RATE] * time, min(1.0, time / MEMORY)
    decay = exp(-turned)
    size = kept = speed = off = 0.0
    for i in range(3):
        felt = rotation[i][0] * wrench[0] + rotation[i][1] * wrench[1] + rotation[i][2] * wrench[2]
        reference, v = memory[REFERENCE + i], memory[SPEED + i]
        # the period's mean
        goal = reference + (0.5 * time + model[LEAD]) * commanded[i] + model[COMPLIANCE] * felt
        y = memory[PLACE + i] - goal
        memory[SPEED + i] = decay * (v - turned * (v + model[RATE] * y))
        modelled = goal + decay * (y + turned * y + time * v)
        memory[OFF + i] = position[i] - modelled
        memory[PLACE + i] = modelled + forget * memory[OFF + i]
        memory[REFERENCE + i] = reference + (time * commanded[i] + forget * memory[OFF + i])
        memory[FELT + i] -= forget * memory[FELT + i]  # by it the model was drawn aside, too
        size, kept = hypot(size, felt), hypot(kept, memory[FELT + i])
        speed, off = hypot(speed, commanded[i]), hypot(off, memory[OFF + i])
    if size >= kept:
        for i in range(3):
            memory[FELT + i] = rotation[i][0] * wrench[0] + rotation[i][1] * wrench[1] + rotation[i][2] * wrench[2]
    memory[FASTEST] = max(speed, memory[FASTEST] * (1.0 - min(1.0, time / SETTLED)))
    memory[PATH] += speed * time - forget * memory[PATH]
    memory[ALLOWED] = model[PUSHED] + model[LATE] * memory[FASTEST] + SPEED_ERROR * memory[PATH]
    return bool(off > memory[ALLOWED])


class ServoFollowing:
    """Compares where a finger's tip is with where commands and felt force should have led it: a `Following`."""

    def __init__(
        self, servo: PositionServo, limit: float, period: float, plain: Following, first: ArmSample
    ) -> None:
        """Begin at rest, with the force limit [N], the control period [s], and what judges motion alone."""
        self._servo, self._plain = servo, plain
        late, lead = max(TIMING * servo.response, CYCLES * period), max(0.0, servo.response - servo.lag)
        pushed = SHARE * limit / servo.stiffness
        model = np.array([2.0 / servo.response, 1.0 / servo.stiffness, lead, pushed, late])
        self._memory: FloatArray = np.zeros(ALLOWED + 1)
        self._memory[REFERENCE : REFERENCE + 3] = self._memory[PLACE : PLACE + 3] = first.position_base_tip
        given = (model, self._memory)
        seen = (0.0, IDENTITY, (0.0,) * 6, ZERO, ZERO)
        self._is_aside = partial(machine_code(is_aside, *given, *seen), *given)

    def take(self, command: Command, before: Observation, after: Sample) -> None:
        """See `Following`."""
        self._plain.take(command, before, after)
        if len(before.fingers) != 1 or before.hand is not None:
            return
        time, arm, wrench = after.time - before.time, before.arm, before.fingers[0].wrench
        position = after.arm.position_base_tip
        if self._is_aside(time, arm.rotation_base_tip, wrench, command.velocity_base_tip, position):
            x, y, z, _, _, _ = wrench
            self._judge(rotate(arm.rotation_base_tip, (x, y, z)))

    def _judge(self, felt: Vector) -> None:
        stiffness, allowed = self._servo.stiffness, float(self._memory[ALLOWED])
        off, drawn = as_vector(self._memory[OFF : OFF + 3]), as_vector(self._memory[FELT : FELT + 3])
        if _unexplained(stiffness, off, drawn) > stiffness * allowed:
            raise FollowingError(
                f"the tip stands {1e3 * norm(off):.2g} mm beside where commands and felt force lead it, as if "
                f"pushed with {stiffness * norm(off):.3g} N that its sensor does not feel (it shows "
                f"{norm(felt):.3g} N); the limit is {stiffness * allowed:.3g} N; check the fingertip's sensor, "
                "and stiffness_N_per_m, response_s and lag_s of the arm in the robot file"
            )


def _unexplained(stiffness: float, off: Vector, felt: Vector) -> float:
    """What an arm gives way by that differences of its stiffness do not explain, as a force [N]."""
    feels = norm(felt)
    along = abs(dot(off, felt)) / feels if feels > 0.0 else 0.0
    across = math.sqrt(max(0.0, dot(off, off) - along * along))
    return math.hypot(max(0.0, stiffness * along - ALONG * feels), max(0.0, stiffness * across - ACROSS * feels))
