"""Parts that carriers share: a sliding body, a joint servo, a balanced load, sensors of a frame."""

import mujoco

from palpate.errors import InvalidValueError
from palpate.sim.carriers.carrier import CarriedMass
from palpate.spatial import Matrix, Vector

LARGEST_SERVO_STEP = 0.4
"""Of bandwidth times time step where damping is explicit (Euler, RK4): half of 2 (sqrt 2 - 1) = 0.83,
where 4 - 4 h - h^2, the characteristic polynomial of a critically damped servo at z = -1, changes its sign."""

_NEGLIGIBLE_MASS = 1e-6
"""Mass of a body that stands for a load's centre of mass [kg]: too light to be felt by any machine."""


def add_carriage(spec: mujoco.MjSpec, name: str, position: Vector, mass: float, carried: float) -> mujoco.MjsBody:
    """Add a body that never turns, with its weight and that of what it carries balanced.

    Args:
        spec: The scene.
        name: Of the body.
        position: Where it starts, base frame [m].
        mass: Its own [kg].
        carried: What is mounted on it [kg].
    """
    body = spec.worldbody.add_body(name=name, pos=position)
    body.explicitinertial = True
    body.mass = mass
    body.inertia = [0.01 * mass] * 3  # it never turns: any value does
    # lifts what it carries too, from outside: sensors in between still feel that weight
    body.gravcomp = (mass + carried) / mass
    return body


def add_position_servo(spec: mujoco.MjSpec, joint: str, stiffness: float, damping: float) -> None:
    """Add an actuator, called like its joint, that gives stiffness (reference - q) - damping q'.

    Args:
        spec: The scene.
        joint: Whom it drives.
        stiffness: [N/m or N m/rad].
        damping: [N s/m or N m s/rad].

    Raises:
        InvalidValueError: It is too fast for a scene whose integrator takes its damping explicitly.
    """
    _check_servo_step(spec, 2.0 * stiffness / damping)
    spec.add_actuator(
        name=joint,
        trntype=mujoco.mjtTrn.mjTRN_JOINT,
        target=joint,
        gaintype=mujoco.mjtGain.mjGAIN_FIXED,
        gainprm=[stiffness] + [0.0] * 9,
        biastype=mujoco.mjtBias.mjBIAS_AFFINE,
        biasprm=[0.0, -stiffness, -damping] + [0.0] * 7,
    )


def lift_load(flange: mujoco.MjsBody, load: CarriedMass) -> None:
    """Balance the weight of a load on the joints that carry a body, in any orientation.

    As a robot does that knows mass and centre of mass of its payload: what the load's own joints and sensors feel
    stays. MuJoCo lifts at the centre of mass of a body; this one has no mass of its own, so it gets the load's
    centre of mass, and a speck of mass there.

    Args:
        flange: A body without mass, whose frame is the load's.
        load: What is put on it.
    """
    flange.explicitinertial = True
    flange.mass = _NEGLIGIBLE_MASS
    flange.ipos = load.center_of_mass
    flange.inertia = [_NEGLIGIBLE_MASS * 1e-6] * 3  # of a millimetre
    flange.gravcomp = (_NEGLIGIBLE_MASS + load.mass) / _NEGLIGIBLE_MASS


TURNING_SENSORS = 12
"""How many numbers `add_turning_sensors` adds to a scene's readings."""


def add_turning_sensors(spec: mujoco.MjSpec, body: str) -> None:
    """Add sensors of a body's axes and of its angular velocity, as `read_turning` reads them."""
    axes = (mujoco.mjtSensor.mjSENS_FRAMEXAXIS, mujoco.mjtSensor.mjSENS_FRAMEYAXIS)
    for kind in (*axes, mujoco.mjtSensor.mjSENS_FRAMEZAXIS, mujoco.mjtSensor.mjSENS_FRAMEANGVEL):
        spec.add_sensor(type=kind, objtype=mujoco.mjtObj.mjOBJ_XBODY, objname=body)


def read_turning(readings: list[float]) -> tuple[Matrix, Vector]:
    """Return rotation and angular velocity [rad/s] of a body, base frame, from its `TURNING_SENSORS` readings."""
    ax, ay, az, bx, by, bz, cx, cy, cz, u, v, w = readings
    return ((ax, bx, cx), (ay, by, cy), (az, bz, cz)), (u, v, w)


def _check_servo_step(spec: mujoco.MjSpec, bandwidth: float) -> None:
    """Refuse a critically damped servo of a natural frequency [rad/s] that the time step cannot follow."""
    explicit = (mujoco.mjtIntegrator.mjINT_EULER, mujoco.mjtIntegrator.mjINT_RK4)
    step = float(spec.option.timestep)
    if spec.option.integrator in explicit and bandwidth * step > LARGEST_SERVO_STEP:
        raise InvalidValueError(
            f"bandwidth = {bandwidth:g} rad/s with a time step of {step:g} s: bandwidth dt = "
            f"{bandwidth * step:.3g}, the limit is {LARGEST_SERVO_STEP:g}; take a bandwidth of at most "
            f"{LARGEST_SERVO_STEP / step:g} rad/s, or a time step of at most "
            f"{LARGEST_SERVO_STEP / bandwidth:.2g} s"
        )
