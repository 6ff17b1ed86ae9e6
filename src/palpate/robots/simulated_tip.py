"""A fingertip of a robot file as a simulation has it."""

from palpate.errors import InvalidValueError
from palpate.open_kinds import name_of_kind
from palpate.robots.robot import Robot
from palpate.robots.surface_entries import SurfaceKind
from palpate.sim import Tip
from palpate.surfaces import CompliantTip


def simulated_tip(robot: Robot, i: int, kind: SurfaceKind) -> Tip:
    """Return a tip on the sensor of finger i, as heavy as the robot file or its sensor file says.

    Raises:
        InvalidValueError: It cannot be simulated.
    """
    finger, sensor = robot.file.fingers[i], robot.sensors[i]
    key = "payload" if sensor is None else f"payload in {finger.sensor}"
    payload = sensor.payload if sensor is not None else finger.payload
    assert payload is not None  # FingerEntry has made sure that one of the two is given
    if not payload.mass > 0.0:
        raise InvalidValueError(
            f"fingers[{i}], {key}: mass_kg = {payload.mass:g}: a simulated tip weighs something; 0.03 is usual"
        )
    surface = kind.surface()
    try:
        shape = surface.surface if isinstance(surface, CompliantTip) else surface
        return Tip(shape, payload.mass, kind.reach, payload.center_of_mass)
    except InvalidValueError as error:
        word = name_of_kind(kind)
        raise InvalidValueError(f"fingers[{i}].surface.kind = {word}: it cannot be simulated: {error}") from None
