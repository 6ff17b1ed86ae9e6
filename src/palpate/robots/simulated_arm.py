"""Simulated arms with one fingertip, in robot files: what is the same for all of them."""

from abc import abstractmethod
from dataclasses import replace
from typing import ClassVar

import msgspec

from palpate.kinematics import FollowingErrorLimit, Pose, StandingArm
from palpate.robots.device_settings import Range
from palpate.robots.idle import plate_task
from palpate.robots.robot import Robot
from palpate.robots.simulated_kind import SimulatedKind, TipCarrier
from palpate.robots.simulated_tip import simulated_tip
from palpate.sim import ArmCarrier, ArmModel, Fidelity, ServoedArm
from palpate.sim.carriers.carrier import CarriedMass
from palpate.sim.carriers.step_test import ServoResponse, step_test
from palpate.sim.presets import ARM
from palpate.spatial import Vector


class SimulatedArm(SimulatedKind, frozen=True, kw_only=True):
    """A simulated arm that starts with its tip upright: see `palpate.sim.ArmCarrier`.

    Attributes:
        bandwidth: Natural frequency of its servos [rad/s].
        following_error_limit: Largest distance of the reference from the actual position of the tip [m].
    """

    METHODS = ("arm_model",)
    RANGES: ClassVar[tuple[Range, ...]] = (
        *SimulatedKind.RANGES,
        ("bandwidth_rad_per_s", 0.1, 1e4, "rad/s"),
        ("following_error_m", 1e-6, 0.1, "m"),
    )

    bandwidth: float = msgspec.field(name="bandwidth_rad_per_s", default=100.0)
    following_error_limit: float = msgspec.field(name="following_error_m", default=0.001)

    @property
    @abstractmethod
    def pose_base_robot(self) -> Pose:
        """Where the arm's own base frame is in that of the scene."""

    @property
    @abstractmethod
    def pose_flange_tip(self) -> Pose:
        """Where the tip frame is on the flange."""

    @property
    def fidelity(self) -> Fidelity:
        """How it is computed, but for the time step."""
        return ARM.fidelity

    def arm_model(self, robot: Robot) -> ArmModel:
        """Return the arm alone.

        Raises:
            InvalidValueError: Its file is missing, or describes none.
        """
        raise NotImplementedError

    def tip_carrier(self, robot: Robot, load: CarriedMass, start: Vector) -> TipCarrier:
        """See `SimulatedKind`."""
        carrier, fidelity, servos = self._tested(robot, load, start)
        # velocity is fed forward, so that a ramp is followed without lag; what is fast the servos follow no faster
        # for that: to force control they are the delay with which they give way
        limit = carrier.arm.following_error_limit.distance
        lag = max(servos.lag[:2])
        arm = StandingArm(carrier.arm.kinematics, carrier.joint_start(start))
        return TipCarrier(carrier, fidelity, lag, servos.response[2], servos.stiffness[2], limit, arm)

    def remarks(self, robot: Robot) -> tuple[str, ...]:
        """See `RobotKind`."""
        if self.hand is not None:  # an experiment decides where that starts
            return super().remarks(robot)
        task = plate_task(robot)
        _, _, servos = self._tested(robot, simulated_tip(robot, 0, task.tip), task.start)
        return (*super().remarks(robot), f"servos, by a step test where it starts: {servos}")

    def _tested(
        self, robot: Robot, load: CarriedMass, start: Vector
    ) -> tuple[ArmCarrier, Fidelity, ServoResponse]:
        limit = FollowingErrorLimit(self.following_error_limit)
        arm = ServoedArm(self.arm_model(robot), self.pose_base_robot, self.pose_flange_tip, self.bandwidth, limit)
        carrier, fidelity = ArmCarrier(arm), replace(self.fidelity, time_step=self.time_step)
        return carrier, fidelity, step_test(carrier, load, start, fidelity, robot.file.period)
