"""What advances a scene by one time step, as far as friction is concerned."""

from typing import Protocol

import mujoco


class FrictionStep(Protocol):
    """MuJoCo's own friction (`MujocoFriction`) or the plant's (`FrictionPlant`)."""

    def reset(self) -> None:
        """Begin anew at the state that the data holds: after mj_resetData, or whenever it was set from outside."""
        ...

    def advance(self) -> None:
        """Simulate one time step. Sensors then belong to the state before it, friction included."""
        ...


class MujocoFriction:
    """Friction by MuJoCo's contact law."""

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        """Take a scene."""
        self._model, self._data, self._step = model, data, mujoco.mj_step

    def reset(self) -> None:
        """See `FrictionStep`."""
        mujoco.mj_forward(self._model, self._data)

    def advance(self) -> None:
        """See `FrictionStep`."""
        self._step(self._model, self._data)
