"""A simulated arm that its own file describes: `backend.kind: mjcf` or `urdf` of a robot file."""

import math
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Annotated

import msgspec

from palpate.errors import InvalidValueError, shown
from palpate.kinematics import Pose
from palpate.robots.device_settings import PoseEntry
from palpate.robots.named_description import PREFIX
from palpate.robots.robot import Robot
from palpate.robots.simulated_arm import SimulatedArm
from palpate.sim import ArmFile, ArmModel, Fidelity
from palpate.sim.carriers.arm_file import ARMS

ARM_TEXT = "arm.xml"
"""Under this name a log keeps the arm's file."""

BEHIND = PoseEntry(position=(-0.45, 0.0, 0.0))
"""Where an arm stands by default: behind what it touches, by half the reach of one of 0.9 m."""

ON_THE_FLANGE = PoseEntry(position=(0.0, 0.0, 0.1), rotvec=(math.pi, 0.0, 0.0))
"""Where the tip frame sits by default: 0.1 m out along z of the flange, upright while that looks down."""

PerJoint = Annotated[tuple[float, ...], msgspec.Meta(max_length=9)]


class MjcfArmEntry(SimulatedArm, frozen=True, kw_only=True):
    """A serial arm of 3 to 9 joints: see `palpate.sim.ArmFile`.

    Attributes:
        file: Of the arm, relative to the robot file; or the name of an arm that palpate has, without an ending; or
            `robot_descriptions:` and a name in that package.
        flange: Name of a site, body or link.
        base: Pose of the robot base in the base frame.
        tip: Pose of the tip frame on the flange.
        home: Posture to work from [rad, or m of a slide].
        joint_speed: Largest speed of each joint [rad/s, or m/s of a slide], instead of the file's.
        joint_torque: Largest torque of each joint [N m, or N of a slide], instead of the file's.
        root: Name of the body or link on which the arm stands, if joints below it are no part of the arm.
    """

    ENDING = ".xml"

    file: str
    flange: str = "flange"
    base: PoseEntry = BEHIND
    tip: PoseEntry = ON_THE_FLANGE
    home: PerJoint = msgspec.field(name="home_rad", default=())
    joint_speed: PerJoint = msgspec.field(name="joint_speed_rad_per_s", default=())
    joint_torque: PerJoint = msgspec.field(name="joint_torque_Nm", default=())
    root: str = ""

    def __post_init__(self) -> None:
        """Refuse numbers out of range, and the name of an arm that palpate has not."""
        super().__post_init__()
        if not self._path.suffix and not self.file.startswith(PREFIX):
            known = sorted(path.stem for path in ARMS.glob(f"*{self.ENDING}"))
            raise InvalidValueError(
                f"file = {shown(self.file)}: must be a file ({self.ENDING}), {PREFIX}NAME, or one of the arms "
                f"{', '.join(known)}"
            )

    @property
    def pose_base_robot(self) -> Pose:
        """See `SimulatedArm`."""
        return self.base.pose

    @property
    def pose_flange_tip(self) -> Pose:
        """See `SimulatedArm`."""
        return self.tip.pose

    @property
    def fidelity(self) -> Fidelity:
        """See `SimulatedArm`: implicit, for joints may be lighter than their servos are made for."""
        return Fidelity()

    @property
    def files(self) -> Mapping[str, str]:
        """See `RobotKind`."""
        return {ARM_TEXT: str(self._path), **super().files}

    def arm_model(self, robot: Robot) -> ArmModel:
        """See `SimulatedArm`."""
        place = robot.texts[f"{ARM_TEXT}.path"]
        given = self.home, self.joint_speed, robot.texts[ARM_TEXT]
        return _read(ArmFile(place, self.flange, *given, joint_torque=self.joint_torque, root=self.root))

    def remarks(self, robot: Robot) -> tuple[str, ...]:
        """See `RobotKind`."""
        return (*super().remarks(robot), *(f"arm: {each}" for each in self.arm_model(robot).assumptions))

    @property
    def _path(self) -> Path:
        own = {path.stem: path for path in ARMS.glob(f"*{self.ENDING}")}
        return own.get(self.file, Path(self.file))


class UrdfArmEntry(MjcfArmEntry, frozen=True, kw_only=True):
    """A serial arm of 3 to 9 joints whose file is a URDF; otherwise as `MjcfArmEntry`."""

    ENDING = ".urdf"


@lru_cache(maxsize=4)
def _read(file: ArmFile) -> ArmModel:
    """Once for each text: what lies beside it is only seen."""
    return file.read()
