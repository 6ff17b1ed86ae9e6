"""What a hand holds, as a fingertip: a back end whose tip is the tool, and whose sensor the fingers' sensors are.

The tip frame of its samples lies in the middle of the fingertips, as their joints tell it, with the axes of the
hand frame. What the tool exerts on the fingers, in that frame, is what a sensor there would bear: contact, plus
weight and inertia of the tool.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from palpate.errors import FloatArray
from palpate.kinematics.pose import Pose
from palpate.runtime.data import ArmSample, Command, HandSample, Sample, WrenchSample
from palpate.runtime.pacing import Pacer
from palpate.runtime.touch import FingerDescription
from palpate.sensing.compensation import SensorPayload, contact_wrench
from palpate.sensing.held.external_wrench import HeldBody, external_wrench
from palpate.sim.carriers.carrier import Carrier
from palpate.sim.contact_truth import CONTACT_COLUMNS, HELD_POSITION, Truth, numbers_of_truth
from palpate.sim.fidelity import Fidelity
from palpate.sim.hand.backend import HandBackend, WrappedHand
from palpate.sim.hand.contact import GraspContact
from palpate.sim.hand.hand_model import opening_of
from palpate.sim.hand.jointed_hand import JointedHand
from palpate.sim.hand.mount import PALM
from palpate.sim.hand.scene import HeldObject, build_grasp_scene
from palpate.sim.hand.touched import Touched
from palpate.sim.sensor.model import SeededSensor
from palpate.spatial import ZERO, Vector, Wrench, add, cross, rotate, scale, subtract

SETTLING = 0.3
"""[s] For which the tool is gripped before it is let go of, and then held before the tare."""

TARE = 1.0
"""[s] Over which the zero of the fingers' sum is averaged, in free air."""

NOTHING = HeldBody()
"""Weight and inertia of the tool stay in, as in what a sensor bears."""


def middle(points: Sequence[Vector]) -> Vector:
    """Return the mean of points."""
    total = ZERO
    for point in points:
        total = add(total, point)
    return scale(1.0 / len(points), total)


class GraspedTool(WrappedHand):
    """A simulated hand that holds a tool, on a carrier, as a robot with one fingertip. A `Backend`.

    `start` closes the fingers on the tool, which a fixture in the palm holds until then; thereafter the first of
    them stands still and the others press against it. Then it tares their sum: zeros of the sensors, and what the
    squeeze shows on other axes, are off from there on. In the samples the tool's wrench comes first, then those of
    the fingers.
    """

    def __init__(
        self,
        hand: HandBackend,
        fingers: Sequence[FingerDescription],
        payload: SensorPayload,
        grip: float,
        closing_time: float,
        end: Vector = ZERO,
        pacer: Pacer | None = None,
    ) -> None:
        """Take a hand around a tool that a fixture holds.

        Args:
            hand: In a scene with something to touch.
            fingers: Of the hand, as their sensors are known.
            payload: Mass and centre of mass of the tool, in the tip frame.
            grip: Normal force with which the fingers hold it [N].
            closing_time: Until they have closed on it [s].
            end: Of the tool, in the tip frame: its motion in the hand is part of the truth [m].
            pacer: Where time comes from, once the run has begun; as the hand's, if not given.
        """
        self._payload, self._end = payload, Pose(end)
        super().__init__(hand, pacer)
        self._pipelines = [finger.pipeline() for finger in fingers]
        n = hand.scene.hand.fingers
        self._closing = Command(grip_force=(grip,) * n)
        self._grips = (0.0,) + (grip,) * (n - 1)
        self._standing: tuple[Vector | None, ...] = (ZERO,) + (None,) * (n - 1)
        self._closing_periods = round((closing_time + SETTLING) / hand.period)
        self._zero = np.zeros(6)
        self._arm: Vector = ZERO
        self._pose_base_tip = Pose()

    def start(self) -> Sample:
        """Grip the tool, let go of the fixture, tare, and return the first sample."""
        hand, holding = self._hand, Command(grip_force=self._grips, finger_velocity=self._standing)
        hand.start()
        for pipeline in self._pipelines:
            pipeline.restart()
        for _ in range(self._closing_periods):
            hand.step(self._closing)
        hand.release()
        for _ in range(round(SETTLING / hand.period)):
            self._felt(hand.step(holding))
        self._zero, self._begin = np.zeros(6), 0.0
        samples = [hand.step(holding)]
        felt = [self._felt(samples[0])]
        for _ in range(round(TARE / hand.period) - 1):
            samples.append(hand.step(holding))
            felt.append(self._felt(samples[-1]))
        zeros = [contact_wrench(_wrench(each.wrench), each.acceleration, self._payload) for each in felt]
        self._zero, self._begin = np.mean(zeros, axis=0), samples[-1].time
        return self._seen(samples[-1], self._tared(felt[-1]))

    def step(self, command: Command) -> Sample:
        """Simulate one period with the commanded velocity of the tip frame.

        Raises:
            InvalidValueError: A motion that the carrier cannot do, or of absurd numbers.
            SimulationDivergedError: The simulation diverged.
        """
        turning = command.angular_velocity_base_tip
        velocity = subtract(command.velocity_base_tip, cross(turning, self._arm))
        sample = self._hand.step(
            Command(velocity, command.phase, self._grips, turning, finger_velocity=self._standing)
        )
        self._pacer.wait()
        return self._seen(sample, self._tared(self._felt(sample)))

    def truth(self) -> Truth:
        """Return what really happened between tool and surface at the last sample."""
        return self._hand.touched_truth()

    @property
    def truth_columns(self) -> tuple[str, ...]:
        """See `palpate.runtime.truth.TruthSource`."""
        return (*CONTACT_COLUMNS, *HELD_POSITION)

    def truth_row(self) -> tuple[float, ...]:
        """See `palpate.runtime.truth.TruthSource`."""
        return (*numbers_of_truth(self.truth()), *(self.pose_tip_tool() @ self._end).position)

    def squeeze(self, grip: float) -> None:
        """Squeeze with another normal force from now on [N]: for tests of what notices it."""
        self._grips = (0.0,) + (grip,) * (len(self._grips) - 1)

    def push(self, force: Vector) -> None:
        """Push at the tool's centre of mass from now on, base frame [N]: for tests of what notices it."""
        self._hand.push(force)

    def touched_points(self) -> FloatArray:
        """Return where the tool touches the surface now, base frame, shape (n, 3) [m]; for checks."""
        return self._hand.touched_points()

    def pose_tip_tool(self) -> Pose:
        """Return where the tool really is in the tip frame, for checks: the identity, unless it moved."""
        return self._pose_base_tip.inverse() @ self._hand.truth().pose_base_object

    def _sensors(self, hand: HandSample) -> tuple[list[Pose], Vector]:
        """Where the sensors are in the tip frame, and that in the hand frame."""
        model = self.scene.hand
        poses = model.sensor_poses(hand.joint_position)
        at = middle(
            [(pose @ Pose(tip.center_of_mass)).position for pose, tip in zip(poses, model.tips, strict=True)]
        )
        return [Pose(subtract(pose.position, at), pose.rotation) for pose in poses], at

    def _felt(self, sample: Sample) -> WrenchSample:
        """What a sensor in the tip frame would bear; the time is the oldest reading's."""
        hand = sample.hand
        assert hand is not None  # it is a hand's
        poses, _ = self._sensors(hand)
        felt = [
            pipeline.step(given.wrench, given.acceleration).wrench
            for pipeline, given in zip(self._pipelines, sample.wrenches, strict=True)
        ]
        turned = [
            rotate(pose.rotation, given.acceleration) for pose, given in zip(poses, sample.wrenches, strict=True)
        ]
        time = min(given.time for given in sample.wrenches)
        return WrenchSample(time, external_wrench(felt, poses, NOTHING, ZERO), middle(turned))

    def _tared(self, bears: WrenchSample) -> WrenchSample:
        return replace(bears, wrench=tuple((np.array(bears.wrench) - self._zero).tolist()))

    def _seen(self, sample: Sample, tool: WrenchSample) -> Sample:
        """The sample of the hand as one of an arm that carries the tool."""
        hand, arm, begin = sample.hand, sample.arm, self._begin
        assert hand is not None  # it is a hand's
        self._arm = offset = rotate(arm.rotation_base_tip, self._sensors(hand)[1])
        self._pose_base_tip = at = Pose(add(arm.position_base_tip, offset), arm.rotation_base_tip)
        moved = ArmSample(
            arm.time - begin,
            at.position,
            at.rotation,
            add(arm.velocity_base_tip, cross(arm.angular_velocity_base_tip, offset)),
            arm.joint_position,
            arm.angular_velocity_base_tip,
        )
        wrenches = tuple(replace(each, time=each.time - begin) for each in (tool, *sample.wrenches))
        return Sample(sample.time - begin, moved, wrenches, HandSample(hand.time - begin, hand.joint_position))


@dataclass(frozen=True, slots=True, eq=False)
class Holding:
    """How a hand holds something.

    Attributes:
        hand: That holds it; its first finger stands still, the others press.
        fingers: As their sensors are known.
        contact: Between fingertips and what they hold.
        grip: Normal force of each finger [N].
    """

    hand: JointedHand
    fingers: Sequence[FingerDescription]
    contact: GraspContact
    grip: float

    def over(
        self,
        touched: Touched,
        held: HeldObject,
        *,
        carrier: Carrier,
        fidelity: Fidelity,
        payload: SensorPayload,
        period: float = 1e-3,
        sensor: SeededSensor | Sequence[SeededSensor] | None = None,
        end: Vector = ZERO,
        pacer: Pacer | None = None,
    ) -> GraspedTool:
        """Return a hand that holds something over what it is to touch.

        Args:
            touched: What is there.
            held: What is held; its frame starts in the middle of the fingertips.
            carrier: What carries the hand, whose axes are those of the base.
            fidelity: How it is computed.
            payload: Mass and centre of mass of what is held, in the tip frame.
            period: Of control [s].
            sensor: See `HandBackend`.
            end: See `GraspedTool`.
            pacer: Likewise.

        Raises:
            InvalidValueError: It cannot be simulated.
        """
        hand = replace(self.hand, bus_period=fidelity.time_step)
        palm = subtract(held.pose_base_object.position, hand.center)
        scene = build_grasp_scene(
            hand, held, self.contact, carrier, None, palm, fidelity, touched=touched, fixture=PALM
        )
        closing_time = opening_of(hand) / hand.closing_speed
        backend = HandBackend(scene, period, sensor)
        return GraspedTool(backend, self.fingers, payload, self.grip, closing_time, end, pacer)


def _wrench(numbers: tuple[float, ...]) -> Wrench:
    a, b, c, d, e, f = numbers
    return (a, b, c, d, e, f)
