"""What a robot risks whose fingertip's sensor nothing else can be compared with."""

from palpate.robots.robot import Robot

RISK = "a sensor that shows too little is believed, and the robot may press harder than limits.force_N"


def unchecked_sensors(robot: Robot) -> str:
    """Return in one sentence what is risked, and why; empty where the arm itself measures the force as well.

    An arm that turns out to measure none, a CB3, is compared with a model of its servos
    (`palpate.runtime.servo_following`).
    """
    if robot.file.backend.has_hand(robot):
        why = "the force of each finger is measured by its own sensor alone"
    elif not robot.file.backend.measures_force:
        why = "no arm measures the force as well"
    elif any(finger.sensor_device is not None and finger.sensor_device.in_arm for finger in robot.file.fingers):
        return (
            "The arm's sensor is the fingertip's sensor, too: beside it only how far the arm gives way shows a "
            "push; see that its stiffness_N_per_m, response_s and lag_s are as pressing finds them (--identify)."
        )
    else:
        return ""
    return f"No second channel: {why}; {RISK}."
