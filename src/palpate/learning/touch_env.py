"""Touch as a gymnasium environment."""

from collections.abc import Mapping
from typing import Any, SupportsFloat, cast

import gymnasium
import numpy as np
import numpy.typing as npt
from gymnasium import spaces

from palpate.errors import InvalidValueError, positive, shown
from palpate.experiments.kit.world import WorldMaker, usual_worlds
from palpate.kinematics import Pose
from palpate.kinematics.posture import Posture
from palpate.learning.guarded_robot import GuardedRobot, approach
from palpate.learning.reward import HoldWhileSliding, Reward
from palpate.runtime import Backend, Limits, Observation, Supervisor, Touch
from palpate.runtime.closing import Closing
from palpate.sim.render.renderer import ContactForce, SceneRenderer
from palpate.sim.scene import Scene
from palpate.spatial import ZERO, Vector, add, rotate, subtract

Seen = dict[str, npt.NDArray[np.float32]]

REACH = 0.1
"""Largest distance of a contact centroid from the sensor that is shown [m]; fingertips are smaller."""

BEYOND = 2.0
"""Forces, torques and velocities are shown up to so many times their limits, passed for an instant at most."""


def seen_space(limits: Limits) -> spaces.Dict:
    """Return the bounds of what is seen; anything beyond them is shown at the bound.

    - `touching`: 1 if something is touched, else 0; then all that belongs to the contact is 0.
    - `normal_force` [N], positive when pushing.
    - `tangential_force` [N], what the object exerts on the finger.
    - `spin_torque` [N m] about the normal.
    - `centroid` of the contact from the tip frame's origin [m].
    - `normal` of the fingertip there, into the object.
    - `position` of the tip frame's origin from where the episode began [m].
    - `velocity` of the tip frame's origin [m/s].

    Args:
        limits: Of the supervisor.
    """
    force, torque, speed = BEYOND * limits.force, BEYOND * limits.spin_torque, BEYOND * limits.speed
    room = float(np.linalg.norm(subtract(limits.workspace_upper, limits.workspace_lower)))
    return spaces.Dict(
        {
            "touching": _box(1, 1.0, least=0.0),
            "normal_force": _box(1, force, least=0.0),
            "tangential_force": _box(3, force),
            "spin_torque": _box(1, torque),
            "centroid": _box(3, REACH),
            "normal": _box(3, 1.0),
            "position": _box(3, room),
            "velocity": _box(3, speed),
        }
    )


def seen(now: Observation, begin: Vector, space: spaces.Dict) -> Seen:
    """Return what an agent sees of an observation.

    Args:
        now: All that is known.
        begin: Where the tip frame's origin was when the episode began, base frame [m].
        space: From `seen_space`.
    """
    arm, finger = now.arm, now.fingers[0]
    touching, centroid, normal, tangential, pressing, spin = 0.0, ZERO, ZERO, ZERO, 0.0, 0.0
    if finger.touching:
        contact, rotation = finger.contact, arm.rotation_base_tip
        touching, pressing, spin = 1.0, contact.normal_force, contact.spin_torque
        centroid = rotate(rotation, contact.centroid.tolist())
        normal = rotate(rotation, contact.normal.tolist())
        tangential = rotate(rotation, contact.tangential_force.tolist())
    values: dict[str, tuple[float, ...]] = {
        "touching": (touching,),
        "normal_force": (pressing,),
        "tangential_force": tangential,
        "spin_torque": (spin,),
        "centroid": centroid,
        "normal": normal,
        "position": subtract(arm.position_base_tip, begin),
        "velocity": arm.velocity_base_tip,
    }
    return {name: _within(value, space[name]) for name, value in values.items()}


def _box(size: int, most: float, least: float | None = None) -> spaces.Box:
    return spaces.Box(-most if least is None else least, most, (size,), np.float32)


def _within(value: tuple[float, ...], box: spaces.Space[object]) -> npt.NDArray[np.float32]:
    assert isinstance(box, spaces.Box)
    shown = np.array(value, np.float32)
    if not np.isfinite(shown).all():  # a lost device may report anything
        shown = np.nan_to_num(shown)
    return np.minimum(np.maximum(shown, box.low), box.high)


class WorldPicture(Closing):
    """Draws the scene behind a back end, and the force that is felt."""

    def __init__(self, backend: Backend) -> None:
        """Prepare; takes some 100 ms.

        Raises:
            InvalidValueError: There is no scene: the robot is real.
            NoRendererError: This machine cannot draw off screen.
        """
        scene = getattr(backend, "scene", None)
        if not isinstance(scene, Scene):
            raise InvalidValueError(
                f"backend is a {type(backend).__name__}: it has no scene to draw; take a simulated one"
            )
        self._renderer = SceneRenderer(scene.model)

    def draw(self, now: Observation) -> npt.NDArray[np.uint8]:
        """Return the picture of an observation, shape (height, width, 3)."""
        arm, finger = now.arm, now.fingers[0]
        posture = Posture(Pose(arm.position_base_tip, arm.rotation_base_tip), arm.joint_position, time=now.time)
        forces = []
        if finger.touching:
            rotation, contact = arm.rotation_base_tip, finger.contact
            point = add(arm.position_base_tip, rotate(rotation, contact.centroid.tolist()))
            forces = [ContactForce(point, rotate(rotation, contact.force.tolist()))]
        return self._renderer.picture(posture, forces)

    def close(self) -> None:
        """See `Closing`."""
        self._renderer.close()


RGB_ARRAY = "rgb_array"

Action = npt.NDArray[np.float32]


class TouchEnv(gymnasium.Env[Seen, Action]):
    """An agent moves a fingertip over an object and feels it.

    The action is a velocity of the tip in the base frame [m/s], each component bounded; it is kept for
    `action_time`, some control periods. The velocity follows it as fast as the slew limit allows. The observation
    is `seen_space`, in base coordinates and SI units.

    A reset makes a new world and brings the tip to the surface. An episode is *terminated* when the supervisor
    stops the robot: a limit was broken or a device lost; `info["trip"]` names it. It is *truncated* when its
    time is up. In both cases the robot is brought to rest. Losing the surface does not end the episode; it only
    earns no reward.

    A seed gives the same episodes again, bit for bit, if the worlds are simulated.
    """

    metadata: dict[str, Any] = {"render_modes": [RGB_ARRAY], "render_fps": 50}  # noqa: RUF012, as gymnasium has it

    def __init__(
        self,
        worlds: WorldMaker | None = None,
        reward: Reward | None = None,
        *,
        speed: float | None = None,
        action_time: float = 0.02,
        duration: float = 10.0,
        render_mode: str | None = None,
    ) -> None:
        """Take what is to be learnt, and where; makes one world, to know its limits.

        Args:
            worlds: Makes the world of an episode; a sphere under a stage, if not given.
            reward: The default is to hold 2 N while sliding.
            speed: Largest velocity along each axis [m/s]; None: what the supervisor lets pass along all of them.
            action_time: How long an action lasts [s], a whole number of control periods.
            duration: Of an episode [s], a whole number of actions.
            render_mode: "rgb_array", or None.

        Raises:
            InvalidValueError: A value that cannot be; a speed that the supervisor would stop at.
        """
        if render_mode not in (None, RGB_ARRAY):
            raise InvalidValueError(f"render_mode = {shown(render_mode)}: must be {RGB_ARRAY!r} or None")
        self.render_mode = render_mode
        self.metadata = {**self.metadata, "render_fps": round(1.0 / positive("action_time", action_time, "s"))}
        self._worlds: WorldMaker = worlds or usual_worlds()
        self._reward: Reward = reward or HoldWhileSliding()
        self._robot: GuardedRobot | None = None
        self._picture: WorldPicture | None = None
        self._over = True
        first = self._worlds(np.random.default_rng(0))
        limits, period = first.limits, first.backend.period
        first.backend.close()
        speed = _checked_speed(speed, limits)
        self._periods = _whole("action_time", action_time, period, "control periods")
        self._actions = _whole("duration", duration, action_time, "actions")
        self._done = 0
        self._begin: Vector = ZERO
        self._seen_space = seen_space(limits)
        self.observation_space = cast("spaces.Space[Seen]", self._seen_space)
        self.action_space = spaces.Box(-speed, speed, (3,), np.float32)
        self._speed = speed

    def reset(
        self, *, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[Seen, dict[str, Any]]:
        """Begin an episode in a new world; one that still goes on is ended, and the robot brought to rest before.

        A limit broken during the approach terminates the episode at its first step.

        Args:
            seed: Of this and the following episodes; they go on from the last one, if not given.
            options: There are none.

        Raises:
            DeviceError: A real or emulated robot is not there.
        """
        super().reset(seed=seed)
        self._halt()
        world = self._worlds(self.np_random)
        if self._robot is not None and self._robot.backend is not world.backend:
            self._robot.close()
        self._robot = robot = GuardedRobot(world.backend, Touch(world.finger), Supervisor(world.limits))
        self._drop_picture()
        robot.start()
        approach(robot, world.approach, world.farthest)
        self._begin = robot.now.arm.position_base_tip
        self._done, self._over = 0, False
        self._reward.start(robot.now)
        return seen(robot.now, self._begin, self._seen_space), self._info(robot)

    def step(self, action: Action) -> tuple[Seen, SupportsFloat, bool, bool, dict[str, Any]]:
        """Move with a velocity [m/s] for the time of an action; what is beyond the bounds is cut off there.

        Raises:
            InvalidValueError: No three numbers, or no episode goes on: call `reset` first.
        """
        if self._over or self._robot is None:
            raise InvalidValueError(
                "step() without an episode: it is over, or was never begun; call reset() first"
            )
        robot, rewarded = self._robot, 0.0
        velocity = self._velocity(action)
        for _ in range(self._periods):
            now = robot.step(velocity)
            if robot.trip is not None:
                break
            rewarded += self._reward.step(now)
        self._done += 1
        rewarded /= self._periods
        trip = robot.trip
        terminated, truncated = trip is not None, trip is None and self._done >= self._actions
        if trip is not None:
            rewarded += self._reward.tripped(trip)
        result = seen(robot.now, self._begin, self._seen_space), rewarded, terminated, truncated, self._info(robot)
        if terminated or truncated:
            self._halt()
        return result

    def render(self) -> npt.NDArray[np.uint8] | None:
        """Return a picture of the scene with the contact force, shape (height, width, 3), or None.

        Raises:
            InvalidValueError: There is no scene to draw: the robot is real.
            NoRendererError: This machine cannot draw off screen.
        """
        if self.render_mode is None or self._robot is None:
            return None
        if self._picture is None:
            self._picture = WorldPicture(self._robot.backend)
        return self._picture.draw(self._robot.now)

    def close(self) -> None:
        """Bring the robot to rest and let go of it; may be called more than once."""
        self._drop_picture()
        self._halt()
        robot, self._robot = self._robot, None
        if robot is not None:
            robot.close()

    def _halt(self) -> None:
        """Bring the robot to rest, if an episode goes on; it is over then."""
        going, self._over = not self._over, True
        if going and self._robot is not None:
            self._robot.stop()

    def _velocity(self, action: Action) -> Vector:
        given = np.asarray(action, np.float64)
        if given.shape != (3,):
            raise InvalidValueError(f"action has shape {given.shape}: must be (3,), a velocity [m/s]")
        x, y, z = np.clip(given, -self._speed, self._speed).tolist()  # what is no number, the supervisor stops at
        return (x, y, z)

    def _info(self, robot: GuardedRobot) -> dict[str, Any]:
        return {"time": robot.now.time, "trip": "" if robot.trip is None else str(robot.trip)}

    def _drop_picture(self) -> None:
        picture, self._picture = self._picture, None
        if picture is not None:
            picture.close()


def _checked_speed(speed: float | None, limits: Limits) -> float:
    fastest = limits.commanded_speed / 3**0.5
    if speed is None:
        return fastest
    if positive("speed", speed, "m/s") > fastest:
        raise InvalidValueError(
            f"speed = {speed:g} m/s: along all three axes that is {3**0.5 * speed:.3g} m/s, which the supervisor "
            f"stops at {limits.commanded_speed:g} m/s (limits.contact_speed_m_per_s); take at most {fastest:.3g} "
            "m/s"
        )
    return speed


def _whole(name: str, value: float, part: float, parts: str) -> int:
    """How many parts there are in a time [s]."""
    count = positive(name, value, "s") / part
    if round(count) < 1 or abs(round(count) / count - 1.0) > 1e-9:
        raise InvalidValueError(f"{name} = {value:g} s: must be a whole number of {parts} of {part:g} s")
    return round(count)
