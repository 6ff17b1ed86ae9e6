"""A step test of a simulated arm: how far and how fast its tip gives way to a push, how far it runs behind a ramp.

At the posture in which a task starts, the tip is pushed with a known force, and then sent off at a known velocity,
along each axis of the base frame. With y the response to the push over its final value, the integral of 1 - y is
the sum of the delays and time constants of any servo, 2 / w of a critically damped one: its response.
"""

from dataclasses import dataclass
from functools import lru_cache

import mujoco
import numpy as np

from palpate.errors import FloatArray, InvalidValueError
from palpate.sensing.compensation import SensorPayload
from palpate.sim.carriers.arm_carrier import ArmCarrier
from palpate.sim.carriers.arm_drive import ArmDrive
from palpate.sim.carriers.carrier import CarriedMass
from palpate.sim.carriers.servoed_arm import FLANGE
from palpate.sim.fidelity import Fidelity
from palpate.spatial import ZERO, Vector, as_vector, scale

SHARE = 0.1
"""Of the following-error limit, by which a step moves the tip: the limit then does not act."""

SETTLING = 12.0
"""Responses for which a step is watched: the slowest exponential of a critically damped servo is at exp(-24)."""

DIGITS, RESOLUTION = 3, 4
"""Significant digits of a stiffness, and decimals of a time [s], that are the same on every machine."""

AT_REST = 0.01
"""Of its deflection, by which a tip that holds still may have moved in the last tenth of the test."""


@dataclass(frozen=True, slots=True)
class ServoResponse:
    """What a step test has found, along x, y and z of the base frame.

    Attributes:
        stiffness: With which the tip is held [N/m].
        response: How long it takes to give way to a push [s].
        lag: How far it runs behind a ramp [s].
    """

    stiffness: Vector
    response: Vector
    lag: Vector

    def __str__(self) -> str:
        forces = ", ".join(f"{1e-3 * each:.3g}" for each in self.stiffness)
        times, lags = (", ".join(f"{1e3 * each:.3g}" for each in row) for row in (self.response, self.lag))
        return f"stiffness {forces} N/mm along x, y and z, response {times} ms, lag behind a ramp {lags} ms"


def step_test(
    carrier: ArmCarrier, load: CarriedMass, start: Vector, fidelity: Fidelity, period: float
) -> ServoResponse:
    """Return how a carried load follows and gives way; tested once, however many runs of a sweep ask.

    Args:
        carrier: With the arm.
        load: What is on it.
        start: Where the tip frame's origin is [m].
        fidelity: How it is simulated.
        period: Of control [s].

    Raises:
        InvalidValueError: It cannot be held there, or its tip does not come to rest.
    """
    return _tested(carrier, SensorPayload(load.mass, load.center_of_mass), start, fidelity, period)


@lru_cache(maxsize=8)
def _tested(
    carrier: ArmCarrier, load: SensorPayload, start: Vector, fidelity: Fidelity, period: float
) -> ServoResponse:
    arm, joints = carrier.arm, carrier.joint_start(start)
    tested = _Tested(carrier, load, start, fidelity, period)
    columns = []
    for name, axis in zip("xyz", np.eye(3), strict=True):
        force = SHARE * arm.push(joints, as_vector(axis))
        course = tested.course(axis, force, 0.0)
        deflection = float(course[-1])
        late = abs(deflection - float(course[-len(course) // 10]))
        if not (deflection > 0.0 and late <= AT_REST * deflection):
            raise InvalidValueError(
                f"{arm.model.arm.name}, pushed with {force:.3g} N along {name}, has moved by {deflection:.3g} m "
                f"after {tested.duration:.3g} s and does not come to rest: its motors must hold its weight and "
                "that force; give more joint_torque, another home posture or less bandwidth"
            )
        response = float(np.trapezoid(1.0 - course / deflection, dx=fidelity.time_step))
        speed = SHARE * arm.following_error_limit.distance / tested.duration
        # a reference that is reached one time step early is none that is followed late
        lag = max(0.0, tested.duration - float(tested.course(axis, 0.0, speed)[-1]) / speed)
        columns.append((_significant(force / deflection), round(response, RESOLUTION), round(lag, RESOLUTION)))
    return ServoResponse(*(as_vector(row) for row in np.array(columns).T))


class _Tested:
    """An arm with its load alone in a scene."""

    def __init__(
        self, carrier: ArmCarrier, load: CarriedMass, start: Vector, fidelity: Fidelity, period: float
    ) -> None:
        spec = fidelity.new_spec()
        carried = carrier.mount(spec, load, start).add_body(name="load", explicitinertial=True)
        carried.mass, carried.ipos, carried.inertia = load.mass, load.center_of_mass, [1e-4 * load.mass] * 3
        self._model = spec.compile()
        self._data = mujoco.MjData(self._model)
        self._drive = ArmDrive(carrier.arm, self._model, self._data, period)
        self._flange = int(self._model.body(FLANGE).id)
        self._periods = round(SETTLING * carrier.arm.lead / period)
        self.duration = self._periods * period

    def course(self, axis: FloatArray, force: float, speed: float) -> FloatArray:
        """Return how far the tip has come along an axis, at the start and after every time step [m]."""
        model, data, flange = self._model, self._data, self._flange
        mujoco.mj_resetData(model, data)
        mujoco.mj_kinematics(model, data)
        first, velocity = data.xpos[flange].copy(), scale(speed, as_vector(axis))
        data.xfrc_applied[flange, :3] = force * axis
        data.xfrc_applied[flange, 3:] = np.cross(first - data.xipos[flange], force * axis)
        self._drive.start()
        found = [0.0]
        for _ in range(self._periods):
            self._drive.begin(velocity, ZERO)
            for _ in range(self._drive.steps):
                self._drive.advance()
                mujoco.mj_step(model, data)
                mujoco.mj_kinematics(model, data)
                found.append(float(axis @ (data.xpos[flange] - first)))
        return np.array(found)


def _significant(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")
