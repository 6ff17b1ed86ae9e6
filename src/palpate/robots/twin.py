"""A simulated twin of a rig: what there is to look at, where no simulation was."""

from dataclasses import replace

import msgspec

from palpate.robots.backend_entries import TurningStageEntry
from palpate.robots.pace_entries import SimulatedPaceEntry
from palpate.robots.robot import Robot
from palpate.robots.robot_file import FingerEntry
from palpate.sensing.ft.sensor_file import PayloadEntry

TIP_MASS = 0.03
"""[kg] Of a simulated tip; nothing is simulated with it here."""


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
        backend=TurningStageEntry(following_error_limit=0.1, angular_following_error=1.5),
        pace=SimulatedPaceEntry(),
        fingers=fingers,
    )
    return replace(robot, file=file, sensors=(None,) * len(fingers))
