"""A scene put where a recorded sample says that it was: geometry alone, nothing is simulated."""

import math
from collections.abc import Collection, Iterator, Mapping

import mujoco
import numpy as np

from palpate.errors import FloatArray, InvalidValueError
from palpate.kinematics import Pose
from palpate.kinematics.posture import Posture
from palpate.sim.hand.mount import PALM
from palpate.sim.objects.motion import Motion
from palpate.sim.render.parts import ancestors, body_names, carried_body, descendants, palm_of
from palpate.sim.scene import OBJECT_GEOM
from palpate.sim.tip import SENSOR_SITE
from palpate.spatial import Matrix, as_vector

_KINDS = (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE))


class YieldingBody:
    """A body that one hinge or slide carries, its start remembered.

    Attributes:
        body: Its number.
        address: Of the joint's position among all positions.
    """

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, joint: int, body: int) -> None:
        """Take a scene where it starts.

        Args:
            model: The scene.
            data: Its kinematics, computed.
            joint: That carries the body.
            body: That is touched.
        """
        self.body, self.address = body, int(model.jnt_qposadr[joint])
        self._turns = int(model.jnt_type[joint]) == _KINDS[0]
        self._start, self._axis = float(data.qpos[self.address]), data.xaxis[joint].copy()
        self._position, self._rotation = data.xpos[body].copy(), data.xmat[body].reshape(3, 3).copy()

    def joint_position(self, pose: Pose) -> float:
        """Return where the joint is while the body is there [rad, or m if it slides]; turns from -pi to pi."""
        if not self._turns:
            return self._start + float(self._axis @ (np.array(pose.position) - self._position))
        turned: FloatArray = np.array(pose.rotation) @ self._rotation.T
        skew = turned - turned.T
        sine = 0.5 * float(self._axis @ [skew[2, 1], skew[0, 2], skew[1, 0]])
        return self._start + math.atan2(sine, 0.5 * (float(np.trace(turned)) - 1.0))


def yielding_bodies(model: mujoco.MjModel, data: mujoco.MjData, driven: Collection[str]) -> Iterator[YieldingBody]:
    """Find the touched body, if one hinge or slide that is not driven is all that carries it.

    Args:
        model: The scene.
        data: Its kinematics, computed, where it starts.
        driven: Names of joints with a prescribed motion.
    """
    geom = int(mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM, OBJECT_GEOM))
    if geom < 0:
        return
    body = int(model.geom_bodyid[geom])
    carrying = set(ancestors(model, body))
    joints = [j for j in range(model.njnt) if int(model.jnt_bodyid[j]) in carrying]
    if len(joints) == 1 and int(model.jnt_type[joints[0]]) in _KINDS and model.joint(joints[0]).name not in driven:
        yield YieldingBody(model, data, joints[0], body)


_Joint = mujoco.mjtJoint


class ScenePlacement:
    """Moves all that can move: carrier, fingers, free bodies, what yields on a joint, what is driven.

    What there is, it finds in the model: tip or palm by name, what carries it from there down to the base, a
    hand's joints from there on, free bodies by their joints.

    Attributes:
        model: Of the scene.
        start: Where everything starts.
        free_bodies: Names of the bodies that move freely, in order; postures have what yields behind them.
    """

    def __init__(self, model: mujoco.MjModel, motions: Mapping[str, Motion] | None = None) -> None:
        """Take a scene.

        Args:
            model: The scene; stays as it is.
            motions: Of joints with a prescribed motion, by name.

        Raises:
            InvalidValueError: There is neither tip nor palm.
        """
        self.model, self._data = model, mujoco.MjData(model)
        self._motions = dict(motions or {})
        bodies, self._palm, carried = body_names(model), palm_of(model), carried_body(model)
        if carried is None:
            raise InvalidValueError(
                f"the scene has neither a body {PALM!r} nor a site {SENSOR_SITE!r}: nothing to place"
            )
        self._tip = carried
        chain = set(ancestors(model, self._tip))
        kinds = [_Joint(int(kind)) for kind in model.jnt_type]
        on = model.jnt_bodyid.tolist()
        arm = [j for j in range(model.njnt) if on[j] in chain]
        slides = [j for j in arm if kinds[j] == _Joint.mjJNT_SLIDE]
        hinges = [j for j in arm if kinds[j] == _Joint.mjJNT_HINGE]
        # slides alone are a stage, or move as one
        self._slides, self._arm = ([], sorted(slides + hinges)) if hinges else (slides, [])
        self._balls = [j for j in arm if kinds[j] == _Joint.mjJNT_BALL]
        below = set() if self._palm is None else set(descendants(model, self._palm))
        # motors stand in the order of a hand's joints; what nobody drives comes last
        driven = [int(model.actuator_trnid[i, 0]) for i in range(model.nu)]
        hand = [j for j in range(model.njnt) if on[j] in below]
        self._hand = [j for j in driven if j in hand] + [j for j in hand if j not in driven]
        self._free = [j for j in range(model.njnt) if kinds[j] == _Joint.mjJNT_FREE]
        self._driven = [(int(model.jnt_qposadr[model.joint(name).id]), its) for name, its in self._motions.items()]
        self._names = {i: name for i, name in enumerate(bodies) if model.body_weldid[i]}
        self.free_bodies = tuple(bodies[on[j]] for j in self._free)
        mujoco.mj_kinematics(model, self._data)
        self._yielding = tuple(yielding_bodies(model, self._data, self._motions))
        self._start = self._data.xpos[self._tip].copy()
        self._start_rotation = self._data.xmat[self._tip].reshape(3, 3).copy()
        self.start = Posture(
            self._pose(self._tip), self._angles(self._arm), self._angles(self._hand), self._free_poses()
        )

    def __reduce__(self) -> tuple[type, tuple[mujoco.MjModel, dict[str, Motion]]]:
        """Pass to another process what it is made of."""
        return ScenePlacement, (self.model, self._motions)

    @property
    def scene(self) -> "ScenePlacement":
        """Itself: its base frame is the scene's."""
        return self

    def in_scene(self, posture: Posture) -> Posture:
        """Return a posture as the scene has it: the very same."""
        return posture

    def place(self, posture: Posture) -> mujoco.MjData:
        """Return the scene like that; the same data every time.

        Args:
            posture: An arm is where its joints say; a stage is where the tip is, and turned like it, whatever
                joints there are.

        Raises:
            InvalidValueError: The scene has other joints or bodies.
        """
        data, model = self._data, self.model
        # a slide or a stage in the place of an arm that the log is of
        self._set("arm", self._arm, posture.arm if self._arm or not self._slides else ())
        self._set("hand", self._hand, posture.hand)
        if self._slides:
            axes = np.array([model.jnt_axis[j] for j in self._slides])
            along = axes @ (np.array(posture.pose_base_tip.position) - self._start)
            for joint, distance in zip(self._slides, along, strict=True):
                data.qpos[model.jnt_qposadr[joint]] = distance
        for joint in self._balls:  # a head that starts as the base frame stands
            turn = np.array(posture.pose_base_tip.rotation) @ self._start_rotation.T
            at = int(model.jnt_qposadr[joint])
            mujoco.mju_mat2Quat(data.qpos[at : at + 4], np.ascontiguousarray(turn).ravel())
        free, bodies = posture.free or self.start.free, len(self._free) + len(self._yielding)
        if len(free) != bodies:
            raise InvalidValueError(f"free has {len(free)} poses: this scene has {bodies} free bodies")
        for body, pose in zip(self._yielding, free[len(self._free) :], strict=True):
            data.qpos[body.address] = body.joint_position(pose)
        for joint, pose in zip(self._free, free, strict=False):
            at = int(model.jnt_qposadr[joint])
            data.qpos[at : at + 3] = pose.position
            mujoco.mju_mat2Quat(data.qpos[at + 3 : at + 7], np.array(pose.rotation).ravel())
        for at, motion in self._driven:
            data.qpos[at] = motion.at(posture.time)[0]
        mujoco.mj_kinematics(model, data)
        # where lights and cameras are: mjv_updateScene needs them
        mujoco.mj_camlight(model, data)
        return data

    def poses(self, posture: Posture) -> dict[str, Pose]:
        """Return pose_base_body of every body that can move, and of the tip or palm, by name.

        Raises:
            InvalidValueError: As in `place`.
        """
        self.place(posture)
        found = {name: self._pose(body) for body, name in self._names.items()}
        tip = self.model.body(self._tip).name
        # where the sensed contact is drawn: an arm's own word goes before that of its joints
        found[tip] = posture.pose_base_tip if self._palm is None else self._pose(self._tip)
        return found

    def pose_of(self, body: str) -> Pose:
        """Return where a body was in the last placed scene, a fixed one too."""
        return self._pose(int(self.model.body(body).id))

    def _set(self, name: str, joints: list[int], given: tuple[float, ...]) -> None:
        if len(given) != len(joints):
            raise InvalidValueError(
                f"{name} has {len(given)} joint positions: this scene's {name} has {len(joints)} joints"
                + (" that turn" if name == "arm" else "")
            )
        for joint, angle in zip(joints, given, strict=True):
            self._data.qpos[self.model.jnt_qposadr[joint]] = angle

    def _angles(self, joints: list[int]) -> tuple[float, ...]:
        return tuple(float(self._data.qpos[self.model.jnt_qposadr[joint]]) for joint in joints)

    def _free_poses(self) -> tuple[Pose, ...]:
        bodies = [int(self.model.jnt_bodyid[joint]) for joint in self._free]
        return tuple(self._pose(body) for body in (*bodies, *(each.body for each in self._yielding)))

    def _pose(self, body: int) -> Pose:
        return Pose(as_vector(self._data.xpos[body]), _matrix(self._data.xmat[body]))


def _matrix(flat: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> Matrix:
    a, b, c, d, e, f, g, h, i = flat.tolist()
    return ((a, b, c), (d, e, f), (g, h, i))
