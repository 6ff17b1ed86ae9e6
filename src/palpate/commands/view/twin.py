"""A simulated twin of a rig's run: what there is to look at, where no simulation was."""

from dataclasses import replace

import msgspec

from palpate.experiments.explore.plan import ExplorationPlan
from palpate.experiments.explore.plan import plan as plan_exploration
from palpate.experiments.friction.plan import FrictionPlan
from palpate.experiments.friction.plan import plan as plan_friction
from palpate.experiments.regulate.plan import RegulationPlan
from palpate.experiments.regulate.plan import plan as plan_regulation
from palpate.runtime.robot import Robot
from palpate.runtime.robot_backend import TurningStageEntry
from palpate.runtime.robot_file import FingerEntry
from palpate.runtime.robot_pace import SimulatedPaceEntry
from palpate.runtime.robot_rig import RigEntry
from palpate.sensing.ft.sensor_file import PayloadEntry

TIP_MASS = 0.03
"""[kg] Of a simulated tip; nothing is simulated with it here."""

OneFingerPlan = ExplorationPlan | RegulationPlan | FrictionPlan
"""What is done with one fingertip."""


def shown_plan(planned: OneFingerPlan) -> OneFingerPlan:
    """Return the plan whose scene a view shows: of a rig's run the same with a stage that carries the tip.

    The object is the one that the run was told of, where it was told that it is; what it really was nobody knows.

    Raises:
        InvalidValueError: It cannot be simulated.
    """
    if not isinstance(planned.robot.file.backend, RigEntry):
        return planned
    twin = stage_twin(planned.robot)
    if isinstance(planned, ExplorationPlan):
        return plan_exploration(replace(planned.config, change=()), twin, planned.target)
    if isinstance(planned, RegulationPlan):
        return plan_regulation(replace(planned.config, change=()), twin, planned.target, planned.motion)
    return plan_friction(planned.config, twin)


def stage_twin(robot: Robot) -> Robot:
    """Return a rig's robot with a simulated stage that turns in the place of its devices."""
    fingers = tuple(
        FingerEntry(
            surface=finger.surface, payload=PayloadEntry(mass=TIP_MASS, center_of_mass=finger.surface.center)
        )
        for finger in robot.file.fingers
    )
    file = msgspec.structs.replace(
        robot.file,
        backend=TurningStageEntry(leash=0.1, angular_leash=1.5),
        pace=SimulatedPaceEntry(),
        fingers=fingers,
    )
    return replace(robot, file=file, sensors=(None,) * len(fingers))
