"""Contacts sensed on the turntable, through a sensor and palpate's own solver, against where MuJoCo has them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from palpate.errors import FloatArray
from palpate.sensing.compensation import SensorPayload, contact_wrench
from palpate.sensing.solver import contacts_from_wrenches
from palpate.sim import SensorModel
from palpate.sim.sensor.simulation import simulated_sensor
from simulation.turntable import FORCE, SAMPLE, Ride, height_over_plate, tip, tip_surface


@dataclass(frozen=True, slots=True)
class Accuracy:
    """Errors of sensed contacts, (median, 99th percentile).

    Attributes:
        to_contact: Centroid to MuJoCo's contact point [m].
        on_surface: Centroid to that point moved along the normal onto the sensed surface [m].
        spin_torque: [N m].
        of_torque: Median of the true spin torque [N m].
    """

    to_contact: tuple[float, float]
    on_surface: tuple[float, float]
    spin_torque: tuple[float, float]
    of_torque: float


def accuracy(
    ridden: Ride,
    stiffness: float,
    sensor: SensorModel | None = None,
    *,
    compensated: bool = True,
    shrunk: bool = True,
    hard: bool = False,
    seeds: Sequence[int] = (0,),
) -> Accuracy:
    """Return how well contacts are sensed from what a sensor says of a ride.

    Args:
        ridden: What happened.
        stiffness: Of its contact [N/m].
        sensor: A perfect one if not given.
        compensated: Whether the tip's weight and inertia are taken off.
        shrunk: Whether the tip is sensed as smaller by its half of the compression.
        hard: By the wrench-axis method, which takes the spin torque for none.
        seeds: Of the sensor, one run for each.
    """
    carried = tip()
    payload = SensorPayload(carried.mass, carried.center_of_mass) if compensated else SensorPayload()
    wrenches = np.vstack([_sensed(ridden, sensor or SensorModel(), payload, seed) for seed in seeds])
    points, torque = (np.concatenate([each] * len(seeds)) for each in (ridden.points, ridden.spin_torque))
    surface = tip_surface(0.5 * FORCE / stiffness if shrunk else 0.0)
    found = contacts_from_wrenches(surface, wrenches, model="hard" if hard else "soft")
    off = found.centroid - points
    # the tip's lowest point is where a level plate touches it, whatever the depth
    squares = np.square(surface.half_lengths)
    foot = surface.center - surface.rotation @ (squares * surface.rotation[2]) / height_over_plate(surface)
    return Accuracy(
        to_contact=_spread(np.linalg.norm(off, axis=1)),
        on_surface=_spread(np.linalg.norm(found.centroid - foot, axis=1)),
        spin_torque=_spread(np.abs(found.spin_torque - torque)),
        of_torque=float(np.median(np.abs(torque))),
    )


def _sensed(ridden: Ride, model: SensorModel, payload: SensorPayload, seed: int) -> FloatArray:
    sensor = simulated_sensor(model, SAMPLE, seed)
    found = []
    for i, row in enumerate(np.hstack([ridden.loads, ridden.accelerations]).tolist()):
        load, acceleration = tuple(row[:6]), tuple(row[6:])
        said = sensor.step(i * SAMPLE, load, acceleration)
        a, b, c, d, e, f = said.wrench
        found.append(contact_wrench((a, b, c, d, e, f), said.acceleration, payload))
    return np.array(found)


def _spread(errors: FloatArray) -> tuple[float, float]:
    return float(np.median(errors)), float(np.percentile(errors, 99))
