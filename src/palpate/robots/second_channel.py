"""What a robot risks whose fingertip's sensor nothing else can be compared with."""

from palpate.robots.robot import Robot

RISK = "a sensor that shows too little is believed, and the robot may press harder than limits.force_N"


def unchecked_sensors(robot: Robot) -> str:
    """Return in one sentence what is risked, and why; empty where the arm itself measures the force as well."""
    if robot.file.backend.has_hand(robot):
        why = "the force of each finger is measured by its own sensor alone"
    elif not robot.file.backend.measures_force:
        why = "no arm measures the force as well"
    elif any(finger.sensor_device is not None and finger.sensor_device.in_arm for finger in robot.file.fingers):
        why = "the arm's sensor is the fingertip's sensor, too"
    else:
        return ""
    return f"No second channel: {why}; {RISK}."
