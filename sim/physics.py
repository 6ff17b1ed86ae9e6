"""What all MuJoCo back ends share."""

import mujoco
import numpy as np

from palpate.errors import FloatArray, InvalidValueError, SimulationDivergedError, positive
from palpate.spatial import Vector

STATE = int(mujoco.mjtState.mjSTATE_INTEGRATION)
"""Everything that the next time step depends on, the solver's warm start included."""

DIVERGED = 1e8
"""A sum of sensor values beyond this [N, m, m/s, ...], or NaN, comes from no scene that people build."""


def whole_steps(name: str, period: float, time_step: float) -> int:
    """Return how many time steps a period is.

    Raises:
        InvalidValueError: Not a whole number of them.
    """
    steps = round(positive(name, period, "s") / time_step)
    if steps < 1 or abs(steps * time_step - period) > 1e-9 * period:
        raise InvalidValueError(f"{name} = {period:g} s: must be a whole number of time steps of {time_step:g} s")
    return steps


def state_size(model: mujoco.MjModel) -> int:
    """Return how many numbers `state_of` gives."""
    return int(mujoco.mj_stateSize(model, STATE))


def state_of(model: mujoco.MjModel, data: mujoco.MjData) -> FloatArray:
    """Return a copy of all that the next time step depends on, shape (`state_size`,)."""
    state = np.empty(state_size(model))
    mujoco.mj_getState(model, data, state, STATE)
    return state


def set_state(model: mujoco.MjModel, data: mujoco.MjData, state: FloatArray) -> None:
    """Go back, or on, to what `state_of` gave."""
    mujoco.mj_setState(model, data, state, STATE)


def check_motion(velocity: Vector, angular_velocity: Vector) -> None:
    """Refuse a commanded motion [m/s, rad/s] of absurd numbers.

    MuJoCo would not diverge: servos whose references are no numbers are all sent to 0 instead.

    Raises:
        InvalidValueError: They are absurd, or not numbers.
    """
    try:
        (x, y, z), (u, v, w) = velocity, angular_velocity
    except (TypeError, ValueError):
        raise InvalidValueError(
            f"velocity_base_tip = {velocity} m/s, angular_velocity_base_tip = {angular_velocity} rad/s: must be "
            "three numbers each"
        ) from None
    if not abs(x) + abs(y) + abs(z) + abs(u) + abs(v) + abs(w) < DIVERGED:
        raise InvalidValueError(
            f"velocity_base_tip = {velocity} m/s, angular_velocity_base_tip = {angular_velocity} rad/s: must be "
            f"numbers, all together below {DIVERGED:g}; look for a division by zero in the controller"
        )


def check_converged(readings: list[float], time: float) -> None:
    """Refuse sensor values that no sound simulation gives.

    Raises:
        SimulationDivergedError: They are absurd, or not numbers.
    """
    if not abs(sum(readings)) < DIVERGED:
        raise SimulationDivergedError(
            f"the simulation diverged at t = {time:.4f} s: take a softer contact or a smaller time step"
        )
