"""How faithfully, and how fast, MuJoCo computes a scene.

What each choice costs and gives is measured in `benchmarks/simulation`.
"""

from dataclasses import dataclass
from enum import Enum

import mujoco

from palpate.errors import InvalidValueError, positive

GRAVITY = 9.80665
"""Standard gravity [m/s^2] (ISO 80000-3)."""


class Integrator(Enum):
    """How MuJoCo steps; the values are its own names."""

    EULER = "Euler"
    IMPLICIT = "implicit"
    IMPLICITFAST = "implicitfast"
    RK4 = "RK4"


class Cone(Enum):
    """Shape of the friction cone: Coulomb's, or a pyramid in it, up to 34 degrees wrong in direction."""

    ELLIPTIC = "elliptic"
    PYRAMIDAL = "pyramidal"


_INTEGRATORS = {
    Integrator.EULER: mujoco.mjtIntegrator.mjINT_EULER,
    Integrator.IMPLICIT: mujoco.mjtIntegrator.mjINT_IMPLICIT,
    Integrator.IMPLICITFAST: mujoco.mjtIntegrator.mjINT_IMPLICITFAST,
    Integrator.RK4: mujoco.mjtIntegrator.mjINT_RK4,
}

_CONES = {
    Cone.ELLIPTIC: mujoco.mjtCone.mjCONE_ELLIPTIC,
    Cone.PYRAMIDAL: mujoco.mjtCone.mjCONE_PYRAMIDAL,
}

CONTACT_FINDER = (1e-9, 200)
"""Tolerance [m] and iterations with which MuJoCo looks for where convex shapes touch. Its own 1e-6 puts a floor
of 15 um and 5 uN m under what an ellipsoid senses; this costs next to nothing."""


@dataclass(frozen=True, slots=True)
class Fidelity:
    """How a scene is computed.

    Attributes:
        time_step: Of the simulation [s].
        integrator: RK4 breaks the agreement of the sensors with the state they belong to: for comparison only.
        cone: A pyramid ignores the friction's own reference and shows no limit surface: for comparison only.
    """

    time_step: float = 0.5e-3
    integrator: Integrator = Integrator.IMPLICITFAST
    cone: Cone = Cone.ELLIPTIC

    def __post_init__(self) -> None:
        positive("time_step", self.time_step, "s")
        for name, kind in (("integrator", Integrator), ("cone", Cone)):
            given = getattr(self, name)
            if not isinstance(given, kind):
                raise InvalidValueError(f"{name} = {given!r}: must be one of {', '.join(map(str, kind))}")

    def new_spec(self) -> mujoco.MjSpec:
        """Return an empty scene that is computed so, with gravity."""
        spec = mujoco.MjSpec()
        spec.option.timestep = self.time_step
        spec.option.gravity = [0.0, 0.0, -GRAVITY]
        spec.option.cone = _CONES[self.cone]
        spec.option.integrator = _INTEGRATORS[self.integrator]
        spec.option.ccd_tolerance, spec.option.ccd_iterations = CONTACT_FINDER
        # a diverged simulation shall be seen, not silently put back to its start
        spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
        return spec
