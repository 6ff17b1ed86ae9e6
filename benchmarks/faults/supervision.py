"""Faults in what passes through the loop: the table of tests, hostile controllers, wrong sensors and mountings."""

from faults.fault_rig import Rig
from faults.fault_table import ANYWHERE, ON_A_SENSOR, WITH_A_HAND
from faults.grip_plant import holding_rig
from faults.hostile_controllers import CONTROLLERS
from faults.kind import Domain, Kind
from faults.mountings import WRONG, Mounted, name_of
from faults.on_the_loop import OnTheLoop
from faults.stage_rig import plain_finger, sensor_finger, stage_rig
from faults.wrong_sensors import SENSORS


def on_stage() -> Rig:
    return stage_rig(plain_finger())


def on_nano17() -> Rig:
    return stage_rig(sensor_finger())


KINDS = (
    *(Kind(f.name, Domain.SUPERVISION, OnTheLoop(f.injection, on_stage), anywhere=True) for f in ANYWHERE),
    *(Kind(f.name, Domain.SUPERVISION, OnTheLoop(f.injection, on_nano17, fixed=True)) for f in ON_A_SENSOR),
    *(Kind(f.name, Domain.SUPERVISION, OnTheLoop(f.injection, holding_rig, fixed=True)) for f in WITH_A_HAND),
    *(
        Kind(f"the controller {name}", Domain.SUPERVISION, OnTheLoop(injection, on_stage), anywhere=True)
        for name, injection in CONTROLLERS.items()
    ),
    *(
        Kind(f"the sensor: {name}", Domain.SUPERVISION, OnTheLoop(injection, on_stage), anywhere=True)
        for name, injection in SENSORS.items()
    ),
    *(
        Kind(f"the sensor mounted as {name_of(rotation)}", Domain.SUPERVISION, Mounted(rotation))
        for rotation in WRONG
    ),
)
"""All of them."""
