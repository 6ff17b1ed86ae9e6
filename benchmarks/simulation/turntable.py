"""A fingertip on a plate that turns: sensed contact and limit surface against MuJoCo's own contact.

The plate is heavy and its motion is prescribed. The tip hangs on three slides and is pressed by its servo.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import mujoco
import numpy as np

from palpate.errors import FloatArray
from palpate.sensing.compensation import SensorPayload, contact_wrench
from palpate.sensing.solver import contacts_from_wrenches
from palpate.sim import ContactLaw, Fidelity, SensorModel, Stage, Tip
from palpate.sim.contact_law import pair_parameters
from palpate.sim.contact_pair import add_pair
from palpate.sim.friction.step import MujocoFriction
from palpate.sim.presets import EXPLORE
from palpate.sim.sensor.simulation import simulated_sensor
from palpate.sim.tip import SENSOR_SITE, TIP_GEOM
from palpate.surfaces import Ellipsoid

PLATE_GEOM = "plate"
SAMPLE = 1e-3  # [s]: what is sensed is read at 1 kHz
FORCE = 5.3  # [N]
SPEED, RATE = 0.02, 1.0  # [m/s], [rad/s]
FRICTION, SPIN_LENGTH = 0.5, 0.006  # with which the spin torque is 4.4 mNm, that of the facts
SEMI_AXES, CENTER = (0.007, 0.008, 0.012), (0.001, -0.002, 0.01)  # [m]
TILT = ((0.8, 0.0, 0.6), (0.36, 0.8, -0.48), (-0.48, 0.6, 0.64))
LAW = replace(EXPLORE.law, friction=FRICTION, spin_length=SPIN_LENGTH)
PRESS, SETTLE, RIDE = 0.1, 0.15, 0.25  # [s]: ramp of the force, until it has settled, and the ride
STAGE = Stage()
SOFT = 20e3
"""[N/m] Stiffness of the preset's contact."""

OWN_FINDER = (1e-6, 50)
"""MuJoCo's own tolerance [m] and iterations for shapes of which it knows no closed form: an ellipsoid on a box."""


@dataclass(frozen=True, slots=True, eq=False)
class Ride:
    """What happened, sampled at 1 kHz; n samples.

    Attributes:
        loads: What the sensor is loaded with, sensor frame (which never turns), shape (n, 6) [N, N m].
        accelerations: Specific force at the sensor, shape (n, 3) [m/s^2].
        points: MuJoCo's contact, sensor frame, shape (n, 3) [m].
        normal_force: Shape (n,) [N].
        tangential_force: Length, shape (n,) [N].
        spin_torque: About the tip's outward normal, on the tip, shape (n,) [N m].
        slip: Of the plate over the tip, speed and turning rate, shape (n, 2) [m/s, rad/s].
        direction: Between tangential force and slip velocity, shape (n,) [rad].
        touching: Share of all samples with a contact.
    """

    loads: FloatArray
    accelerations: FloatArray
    points: FloatArray
    normal_force: FloatArray
    tangential_force: FloatArray
    spin_torque: FloatArray
    slip: FloatArray
    direction: FloatArray
    touching: float


def tip(less: float = 0.0) -> Tip:
    """Return the ellipsoid, with semi-axes shorter by `less` [m]."""
    return Tip(tip_surface(less))


def ride(
    fidelity: Fidelity = EXPLORE.fidelity,
    law: ContactLaw = LAW,
    speed: float = SPEED,
    rate: float = RATE,
    seconds: float = RIDE,
    finder: tuple[float, int] | None = None,
) -> Ride:
    """Press the tip on the plate, let it slide under it at a speed and turn at a rate, and keep what happens.

    Args:
        fidelity: How it is computed.
        law: Contact of tip and plate.
        speed: Of the plate [m/s].
        rate: Of the plate [rad/s].
        seconds: That are kept [s].
        finder: Tolerance [m] and iterations of MuJoCo's contact finder; those of palpate's scenes if not given.

    Raises:
        InvalidValueError: The law cannot be kept with this time step.
    """
    carried = tip()
    model = _model(carried, fidelity, law)
    if finder is not None:
        model.opt.ccd_tolerance, model.opt.ccd_iterations = finder
    data = mujoco.MjData(model)
    friction = MujocoFriction(model, data)
    stiffness, dt = STAGE.stiffness(carried.mass), fidelity.time_step
    depth = FORCE / stiffness + FORCE / law.stiffness
    every, rows, samples = max(1, round(SAMPLE / dt)), [], 0
    friction.reset()
    for i in range(round((PRESS + SETTLE + seconds) / dt)):
        time = i * dt
        data.ctrl[2] = -depth * min(1.0, time / PRESS)
        data.qvel[3], data.qvel[4] = speed, rate
        # the state to which the sensors of this step will belong
        plate = (float(data.qpos[3]), 0.0)
        tip_velocity = data.qvel[:3].copy()
        friction.advance()
        if time < PRESS + SETTLE or i % every:
            continue
        samples += 1
        if data.ncon:
            rows.append(_row(model, data, plate, tip_velocity, speed, rate))
    table = np.array(rows).reshape(-1, 17)
    return Ride(
        loads=table[:, :6],
        accelerations=table[:, 6:9],
        points=table[:, 9:12],
        normal_force=table[:, 12],
        tangential_force=table[:, 13],
        spin_torque=table[:, 14],
        slip=np.column_stack([table[:, 15], np.full(len(table), rate)]),
        direction=table[:, 16],
        touching=len(rows) / samples,
    )


def _model(carried: Tip, fidelity: Fidelity, law: ContactLaw) -> mujoco.MjModel:
    spec = fidelity.new_spec()
    surface = carried.surface
    assert isinstance(surface, Ellipsoid)
    x, y, z = carried.center_of_mass
    stage = spec.worldbody.add_body(name="stage", pos=(-x, -y, height_over_plate(surface) - z))
    stage.explicitinertial, stage.mass, stage.inertia = True, STAGE.mass, [0.01 * STAGE.mass] * 3
    stage.gravcomp = (STAGE.mass + carried.mass) / STAGE.mass
    stiffness = STAGE.stiffness(carried.mass)
    damping = STAGE.lag * stiffness  # critical
    for name, axis in (("x", (1, 0, 0)), ("y", (0, 1, 0)), ("z", (0, 0, 1))):
        stage.add_joint(name=name, type=mujoco.mjtJoint.mjJNT_SLIDE, axis=axis)
        spec.add_actuator(
            name=name,
            trntype=mujoco.mjtTrn.mjTRN_JOINT,
            target=name,
            gaintype=mujoco.mjtGain.mjGAIN_FIXED,
            gainprm=[stiffness] + [0.0] * 9,
            biastype=mujoco.mjtBias.mjBIAS_AFFINE,
            biasprm=[0.0, -stiffness, -damping] + [0.0] * 7,
        )
    carried.add_to(stage)
    plate = spec.worldbody.add_body(name="plate")
    plate.explicitinertial, plate.mass, plate.inertia = True, 1e4, [1e4] * 3
    plate.add_joint(name="slide", type=mujoco.mjtJoint.mjJNT_SLIDE, axis=(1.0, 0.0, 0.0))
    plate.add_joint(name="turn", type=mujoco.mjtJoint.mjJNT_HINGE, axis=(0.0, 0.0, 1.0))
    plate.add_geom(
        name=PLATE_GEOM,
        type=mujoco.mjtGeom.mjGEOM_BOX,
        size=(0.1, 0.1, 0.01),
        pos=(0.0, 0.0, -0.01),
        contype=0,
        conaffinity=0,
    )
    pair = pair_parameters(law, 1.0 / (STAGE.mass + carried.mass) + 1e-4, fidelity.time_step)
    spec.option.impratio = pair.impratio
    add_pair(spec, TIP_GEOM, PLATE_GEOM, pair)
    kinds = (mujoco.mjtSensor.mjSENS_FRAMEPOS, mujoco.mjtSensor.mjSENS_FORCE, mujoco.mjtSensor.mjSENS_TORQUE)
    for kind in (*kinds, mujoco.mjtSensor.mjSENS_ACCELEROMETER):
        spec.add_sensor(type=kind, objtype=mujoco.mjtObj.mjOBJ_SITE, objname=SENSOR_SITE)
    return spec.compile()


def _row(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    plate: tuple[float, float],
    tip_velocity: FloatArray,
    speed: float,
    rate: float,
) -> tuple[float, ...]:
    s = data.sensordata
    contact = data.contact[0]
    wrench = np.zeros(6)
    mujoco.mj_contactForce(model, data, 0, wrench)
    # what the tip does to the plate; its frame's x points into the plate
    f_n, torque = float(wrench[0]), -float(wrench[3])
    fx, fy, _ = (-(wrench[1] * contact.frame[3:6] + wrench[2] * contact.frame[6:9])).tolist()
    point = contact.pos.copy()
    rx, ry = float(point[0]) - plate[0], float(point[1]) - plate[1]
    vx, vy = speed - rate * ry - float(tip_velocity[0]), rate * rx - float(tip_velocity[1])
    direction = math.atan2(vx * fy - vy * fx, vx * fx + vy * fy)
    load = (-s[3:9]).tolist()
    return (
        *load,
        *s[9:12].tolist(),
        *(point - s[:3]).tolist(),
        f_n,
        math.hypot(fx, fy),
        torque,
        math.hypot(vx, vy),
        direction,
    )


def tip_surface(less: float = 0.0) -> Ellipsoid:
    """Return the ellipsoid, with semi-axes shorter by `less` [m]; in the sensor frame."""
    a, b, c = SEMI_AXES
    return Ellipsoid((a - less, b - less, c - less), center=np.array(CENTER), rotation=np.array(TILT))


def height_over_plate(surface: Ellipsoid) -> float:
    """Return how high its centre is over a plate that it touches [m]."""
    return float(np.linalg.norm(surface.rotation[2] * surface.half_lengths))


# -------------------------------------------------------------------------------- contacts sensed


@dataclass(frozen=True, slots=True)
class Accuracy:
    """Errors of sensed contacts, (median, 99th percentile).

    Attributes:
        to_contact: Centroid to MuJoCo's contact point [m].
        on_surface: Centroid to that point moved along the normal onto the sensed surface [m].
        spin_torque: Error of the spin torque [N m].
        of_torque: Median of the true spin torque [N m].
    """

    to_contact: tuple[float, float]
    on_surface: tuple[float, float]
    spin_torque: tuple[float, float]
    of_torque: float


def accuracy(
    ridden: Ride,
    stiffness: float = SOFT,
    *,
    shrunk: bool = True,
    hard: bool = False,
) -> Accuracy:
    """Return the errors of contacts sensed on a ride.

    Args:
        ridden: The ride.
        stiffness: Stiffness of its contact [N/m].
        shrunk: Whether the tip is sensed as smaller by its half of the compression.
        hard: Whether the wrench-axis method is used, which neglects the spin torque.
    """
    carried = tip()
    wrenches = _sensed(ridden, SensorPayload(carried.mass, carried.center_of_mass))
    surface = tip_surface(0.5 * FORCE / stiffness if shrunk else 0.0)
    found = contacts_from_wrenches(surface, wrenches, model="hard" if hard else "soft")
    off = found.centroid - ridden.points
    # the tip's lowest point is where a level plate touches it, whatever the depth
    squares = np.square(surface.half_lengths)
    foot = surface.center - surface.rotation @ (squares * surface.rotation[2]) / height_over_plate(surface)
    return Accuracy(
        to_contact=_spread(np.linalg.norm(off, axis=1)),
        on_surface=_spread(np.linalg.norm(found.centroid - foot, axis=1)),
        spin_torque=_spread(np.abs(found.spin_torque - ridden.spin_torque)),
        of_torque=float(np.median(np.abs(ridden.spin_torque))),
    )


def _sensed(ridden: Ride, payload: SensorPayload) -> FloatArray:
    sensor = simulated_sensor(SensorModel(), SAMPLE, 0)
    found = []
    for i, row in enumerate(np.hstack([ridden.loads, ridden.accelerations]).tolist()):
        load, acceleration = tuple(row[:6]), tuple(row[6:])
        said = sensor.step(i * SAMPLE, load, acceleration)
        a, b, c, d, e, f = said.wrench
        found.append(contact_wrench((a, b, c, d, e, f), said.acceleration, payload))
    return np.array(found)


def _spread(errors: FloatArray) -> tuple[float, float]:
    return float(np.median(errors)), float(np.percentile(errors, 99))


# -------------------------------------------------------------------------------- limit surface


SLIP_SPEED = 0.02  # |(v, e w)| [m/s]
LIMIT_ANGLES = tuple(np.linspace(0.0, 90.0, 13).tolist())  # [deg]
LIMIT_SECONDS = 0.05  # [s] of each angle


@dataclass(frozen=True, slots=True)
class LimitSurface:
    """Full slip at all angles between sliding and spinning.

    Attributes:
        error: Largest | |(f_t / mu f_n, torque / mu e f_n)| - 1 |.
        turned: Largest angle between load and slip, of the tangential force or of its share of the torque [deg].
        touching: Least share of the time in contact.
    """

    error: float
    turned: float
    touching: float


def limit_surface(
    fidelity: Fidelity = EXPLORE.fidelity,
    law: ContactLaw = LAW,
    angles: Sequence[float] = LIMIT_ANGLES,
) -> LimitSurface:
    """Return how far full slip is from MuJoCo's own limit surface, an ellipse.

    Args:
        fidelity: How it is computed.
        law: Contact of tip and plate.
        angles: From sliding, 0, to spinning, 90 [deg].
    """
    errors, turned, touching = [0.0], [0.0], [1.0]
    for angle in np.radians(angles).tolist():
        v, w = SLIP_SPEED * math.cos(angle), SLIP_SPEED * math.sin(angle) / law.spin_length
        ridden = ride(fidelity, law, v, w, seconds=LIMIT_SECONDS)
        touching.append(ridden.touching)
        most = law.friction * ridden.normal_force
        if not len(most) or not most.all():
            continue
        x, y = ridden.tangential_force / most, np.abs(ridden.spin_torque) / (law.spin_length * most)
        errors.append(float(np.abs(np.hypot(x, y) - 1.0).max()))
        of_slip = np.arctan2(law.spin_length * np.abs(ridden.slip[:, 1]), ridden.slip[:, 0])
        turned.append(float(np.degrees(np.abs(np.arctan2(y, x) - of_slip)).max()))
        if math.degrees(angle) < 80.0:  # there is a direction to speak of
            turned.append(float(np.degrees(np.abs(ridden.direction)).max()))
    return LimitSurface(max(errors), max(turned), min(touching))
