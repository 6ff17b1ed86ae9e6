"""Hands from MJCF files."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import mujoco

from palpate.bounded_file import PathLike
from palpate.errors import vector
from palpate.sim.carriers.arm_checks import joints_to, turns_on
from palpate.sim.carriers.arm_file import ArmFile, keep_joints, leave_to_a_servo, speeds_in
from palpate.sim.carriers.arm_mending import mend
from palpate.sim.carriers.arm_model import ArmModel
from palpate.sim.carriers.arm_source import ArmSourceFile
from palpate.sim.hand.jointed_hand import JointedFinger, JointedHand
from palpate.sim.tip import Tip

HANDS = Path(__file__).resolve().parent.parent / "hands"
"""Where the files of hands lie that palpate has."""

JOINTS = (1, 4)
"""Of a finger: with three a tip goes anywhere, and the fourth bends it meanwhile."""


@dataclass(frozen=True, slots=True)
class HandFile:
    """A hand in an MJCF or URDF file, whose world frame is the hand frame: z away from the fingers.

    Attributes:
        path: Of the file.
        sensors: Names of sites, bodies or links, one per finger: there the force/torque sensors sit, x in the
            direction in which the finger closes.
        start: Joint positions finger by finger [rad or m]; without: the keyframe `home`, or as the file has them.
        joint_speed: Largest speed of each joint likewise [rad/s or m/s], where the file has none.
        text: What stood in it, if it may not be there any more.
    """

    path: PathLike
    sensors: tuple[str, ...]
    start: tuple[float, ...] = ()
    joint_speed: tuple[float, ...] = ()
    text: str | None = None

    def read(self, tips: Sequence[Tip]) -> JointedHand:
        """Return the hand with tips on its sensors.

        Raises:
            InvalidValueError: It cannot be read, or is no hand of serial fingers; the message names file, line
                where it is known, value and remedy.
        """
        source = ArmSourceFile.of(Path(self.path), self.text)
        spec = source.spec()
        mend(spec, source)
        whole = source.compiled(spec)
        joints = [self._joints(source, whole, sensor) for sensor in self.sensors]
        counts = [len(each) for each in joints]
        starts = _split("start", self.start, counts, "rad or m")
        speeds = _split("joint_speed", self.joint_speed, counts, "rad/s or m/s")
        if not self.joint_speed and (own := speeds_in(source, whole, whole.njnt, "joint of the file")):
            speeds = [tuple(own[joint] for joint in each) for each in joints]
        read = [
            ArmFile(self.path, sensor, start, speed, text=source.text, count=JOINTS).read()
            for sensor, start, speed in zip(self.sensors, starts, speeds, strict=True)
        ]
        names = [name for finger in read for name in finger.joints]
        for name in names:
            if turns_on(whole, int(whole.joint(name).id)):
                raise source.refusal(name, f"joint {name} has no range", "give it one [rad]: no finger turns on")
            if names.count(name) > 1:
                raise source.refusal(name, f"joint {name} moves two fingers", "must move one finger each")
        return JointedHand(
            _alone(source, read),
            tuple(JointedFinger(its.arm, its.joints, its.flange, its.pose_body_flange) for its in read),
            tuple(tips),
            tuple(q for its in read for q in its.home),
        )

    def _joints(self, source: ArmSourceFile, model: mujoco.MjModel, sensor: str) -> list[int]:
        """Numbers of the joints between palm and sensor."""
        sites = [model.site(i).name for i in range(model.nsite)]
        bodies = [model.body(i).name for i in range(1, model.nbody)]
        if sensor not in sites + bodies:
            known = ", ".join(name for name in sites + bodies if name)
            raise source.refusal("", f"sensors: no site, body or link is called {sensor!r}", f"there are {known}")
        body = int(model.site(sensor).bodyid[0]) if sensor in sites else int(model.body(sensor).id)
        return joints_to(source, model, body, 0, JOINTS)


def _split(name: str, given: Sequence[float], counts: Sequence[int], unit: str) -> list[tuple[float, ...]]:
    """Numbers of all joints, finger by finger; of none, none."""
    if not given:
        return [()] * len(counts)
    values = vector(name, given, sum(counts), unit).tolist()
    ends = [sum(counts[: i + 1]) for i in range(len(counts))]
    return [tuple(values[end - count : end]) for count, end in zip(counts, ends, strict=True)]


def _alone(source: ArmSourceFile, fingers: Sequence[ArmModel]) -> mujoco.MjSpec:
    """Bodies, shapes and the fingers' joints, which motors drive."""
    spec = source.spec()
    mend(spec, source)
    keep_joints(spec, [name for finger in fingers for name in finger.joints])
    for body in spec.bodies:
        body.gravcomp = 0.0  # what carries the hand lifts its weight, and motors that of the fingers
    for finger in fingers:
        for name, armature, limits in zip(finger.joints, finger.armature, finger.arm.limits, strict=True):
            leave_to_a_servo(spec, spec.joint(name), armature, limits)
            spec.joint(name).actgravcomp = False
    return spec
