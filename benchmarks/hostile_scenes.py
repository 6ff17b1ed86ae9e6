"""Scenes that are not what an exploration was told, and what became of it.

An exploration is planned for one scene and carried out in another: the plan keeps its gains, speeds and limits,
and only what is simulated is exchanged.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import msgspec
import numpy as np
import trimesh

from palpate.errors import FloatArray
from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.explore.experiment import Explore
from palpate.experiments.explore.exploration import ExplorationResult, evaluate
from palpate.experiments.explore.plan import ExplorationPlan, plan, plan_on
from palpate.experiments.kit.recorded_run import RecordedRun, carry_out
from palpate.robots.finger_sensor import sensor_for
from palpate.robots.robot import ROBOT_TEXT, Robot, load_robot, read_robot
from palpate.robots.values import on_robot
from palpate.runtime import Backend, Ending
from palpate.sim import MujocoBackend, SceneObject, Target, build_scene
from palpate.sim.objects.mesh import TracedMesh
from palpate.sim.objects.mesh_file import Triangles
from palpate.sim.objects.motion import DrivenJoint, JointKind, MovingTarget, Ramp
from palpate.sim.tip import TipSurface
from palpate.spatial import ZERO, Vector

FAR_BELOW = (0.0, 0.0, -0.5)
"""Where an object is that is missing [m]."""

STIFFEST_STEP = 100e3
"""[N/m] The usual time step takes a contact so stiff (see `palpate.sim.presets`); beyond, it is divided."""

NANO17 = (1.0 / 320.0, 1e-3 / 64.0)
"""White noise of a Nano17-class sensor [N, N m], its resolution in ATI's data sheet."""


@dataclass(frozen=True, slots=True)
class Truth:
    """What is otherwise than was assumed.

    Attributes:
        friction: Over what was assumed.
        stiffness: Likewise.
        object: The target that stands where the assumed object should; None: that object.
        tip: The surface of the fingertip; None: that.
    """

    friction: float = 1.0
    stiffness: float = 1.0
    object: Callable[[SceneObject], Target] | None = None
    tip: TipSurface | None = None


def taken_away(direction: Vector, speed: float, begin: float) -> Callable[[SceneObject], Target]:
    """Return what makes an object that leaves in a direction at a speed [m/s] from a time [s] on."""
    joints = (DrivenJoint(JointKind.SLIDE, direction, Ramp(speed, begin)),)
    return lambda shape: MovingTarget(shape, joints)


def missing(shape: SceneObject) -> Target:
    """Return an object that is not there."""
    return MovingTarget(shape, (DrivenJoint(JointKind.SLIDE, (1.0, 0.0, 0.0), Ramp(0.0)),), FAR_BELOW)


def in_truth(planned: ExplorationPlan, truth: Truth) -> Backend:
    """Return a plan's robot in another scene than it was made for."""
    usual = planned.backend()
    assert isinstance(usual, MujocoBackend)
    scene = usual.scene
    law = replace(
        scene.law, friction=truth.friction * scene.law.friction, stiffness=truth.stiffness * scene.law.stiffness
    )
    finer = 1
    while law.stiffness > STIFFEST_STEP * finer**2:
        finer *= 2
    fidelity = replace(scene.fidelity, time_step=scene.fidelity.time_step / finer)
    start = usual.start().arm.position_base_tip
    target = scene.target if truth.object is None else truth.object(planned.target)
    tip = scene.tip if truth.tip is None else replace(scene.tip, surface=truth.tip)
    other = build_scene(tip, target, law, start, scene.carrier, fidelity)
    sensor = sensor_for(planned.robot, planned.config)
    return MujocoBackend(other, planned.period, sensor, usual.pacer)


def carried_out(config: ExploreConfig, truth: Truth, robot: Robot | None = None) -> ExplorationResult:
    """Plan for what `config` says, and explore what is true."""
    planned = plan(config, load_robot(config.robot) if robot is None else robot, {})
    run = RecordedRun(planned, in_truth(planned, truth))
    return evaluate(planned, run.recorded(run.run()))


def drifting(name: str, force: Vector, moment: Vector = ZERO, minutes: float = 10.0) -> Robot:
    """Return a robot whose sensor's zero drifts.

    Args:
        name: Of the robot, which has a preset sensor.
        force: Per minute at the start [N]; it goes on for `minutes`, ever slower.
        moment: Likewise [N m].
        minutes: Time constant.
    """
    robot = load_robot(name)
    text = robot.texts[ROBOT_TEXT]
    whole = [minutes * each for each in (*force, *moment)]
    drift = f"drift: {{force_N: {whole[:3]}, moment_Nm: {whole[3:]}, time_constant_s: {60.0 * minutes:g}}}"
    after = "      preset: nano17"
    assert after in text
    return read_robot({**robot.texts, ROBOT_TEXT: text.replace(after, f"{after}\n      {drift}", 1)})


def most_force(found: ExplorationResult) -> float:
    """Return the largest force that the object really exerted on the tip [N]."""
    return float(np.linalg.norm(np.nan_to_num(found.truth.force), axis=1).max())


def rests(found: ExplorationResult) -> bool:
    """Return whether the robot stands still in the end."""
    last: FloatArray = found.record.velocity[-1]
    return found.run.at_rest and float(np.linalg.norm(last)) < 1e-3


@dataclass(frozen=True, slots=True)
class Hostile:
    """An exploration of a scene that is not as it was said.

    Attributes:
        name: Of the scene.
        truth: What is otherwise.
        ending: How the run must end.
        told: What the account must say.
        drift: Of the sensor's zero, per minute [N].
        size: Of the region [m]: a drift takes time.
    """

    name: str
    truth: Truth
    ending: Ending
    told: str
    drift: Vector = ZERO
    size: float = 0.01

    def carried_out(self, robot: str, way: str) -> ExplorationResult:
        """Explore a sphere of 30 mm.

        Args:
            robot: stage or ur5e.
            way: raster or spiral.
        """
        size: dict[str, float] = {"radius": 0.5 * self.size} if way == "spiral" else {"width": self.size}
        if way == "raster":
            size["depth"] = 0.4 * self.size
        drifts = self.drift != ZERO
        kind = f"{robot}-nano17" if drifts else {"ur5e": "ur5e-sim"}.get(robot, robot)
        fields = {} if drifts else {"force_noise": NANO17[0], "moment_noise": NANO17[1]}
        config = ExploreConfig(robot=kind, object="sphere", size=(0.03,), strategy=way, **size, **fields)
        return carried_out(config, self.truth, drifting(kind, self.drift) if drifts else None)

    def missed(self, found: ExplorationResult) -> list[str]:
        """Name what was asked for and missed."""
        wrong, told = [], Explore().report(found).outcome
        if most_force(found) > found.plan.wall.limit:
            wrong.append(f"{most_force(found):.2f} N, the limit is {found.plan.wall.limit:g} N")
        if not rests(found):
            wrong.append("the robot moves in the end")
        if found.run.ending is not self.ending:
            wrong.append(f"ended as {found.run.ending.value!r}, not {self.ending.value!r}")
        if self.told not in told:
            wrong.append(f"the account does not say {self.told!r}: {told}")
        if found.map is not None and found.map.claimed.any() and found.map.covered < 0.90:
            wrong.append(f"{100.0 * found.map.covered:.1f} % of the map's errors inside its band")
        return wrong


SCENES = (
    Hostile("friction x 3", Truth(friction=3.0), Ending.DONE, "Finished"),
    Hostile("stiffness x 10", Truth(stiffness=10.0), Ending.DONE, "Landing felt 2"),
    Hostile("taken away down", Truth(object=taken_away((0.0, 0.0, -1.0), 0.2, 2.0)), Ending.LOST, "1 lost"),
    Hostile("taken away aside", Truth(object=taken_away((0.0, 1.0, 0.0), 0.2, 2.0)), Ending.LOST, "1 lost"),
    Hostile("missing", Truth(object=missing), Ending.LOST, "nothing was met"),
    Hostile("drift 0.2 N/min, pulling", Truth(), Ending.DONE, "zero moved", (0.0, 0.0, -0.2), 0.025),
    Hostile("drift 0.2 N/min, pushing", Truth(), Ending.DONE, "zero moved", (0.0, 0.0, 0.2), 0.025),
    Hostile("drift 0.2 N/min, all axes", Truth(), Ending.DONE, "zero moved", (0.2, 0.2, 0.2), 0.025),
)


class SharpMesh(TracedMesh):
    """A mesh that is touched although it is too hollow for the tip: where that touches is where it is deepest."""

    def check_tip(self, radius: float) -> None:
        """Take any tip."""


@dataclass(frozen=True, slots=True)
class Wall:
    """A sweep along a floor, against a vertical wall of 6 mm.

    Attributes:
        robot: stage or ur5e.
        stiffness: Of the contact [N/m].
        speed: Of the sweep [m/s].
    """

    robot: str
    stiffness: float
    speed: float

    def hit(self) -> ExplorationResult:
        """Run into it, with a supervisor that lets any force be, so that all of it is seen."""
        bounds = (((-0.03, -0.01, -0.02), (0.006, 0.01, 0.0)), ((0.00601, -0.01, -0.02), (0.03, 0.01, 0.006)))
        whole = trimesh.util.concatenate([trimesh.creation.box(bounds=each) for each in bounds])
        target = SharpMesh(Triangles(np.asarray(whole.vertices), np.asarray(whole.faces)))
        config = ExploreConfig(
            robot={"ur5e": "ur5e-sim"}.get(self.robot, self.robot),
            object="box",
            size=(0.06, 0.02, 0.04),
            tip=(0.004,),
            width=0.014,
            depth=0.002,
            beyond=True,
            speed=self.speed,
            stiffness=self.stiffness,
        )
        robot = load_robot(config.robot)
        planned = plan_on(target, on_robot(config, robot), robot)
        planned = replace(
            planned,
            setup=replace(
                planned.setup,
                limits=msgspec.structs.replace(
                    planned.limits, force=1e4, impact_force=None, moment=1e3, spin_torque=1e3
                ),
            ),
        )
        return evaluate(planned, carry_out(planned))
