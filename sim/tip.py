"""A fingertip: a sphere or an ellipsoid on a six-axis force/torque sensor."""

from dataclasses import dataclass

import mujoco
import numpy as np

from palpate.errors import InvalidValueError, positive
from palpate.surfaces import Ellipsoid, Sphere

SENSOR_SITE = "sensor"
TIP_GEOM = "tip"


@dataclass(frozen=True, slots=True)
class Tip:
    """A fingertip on its sensor. The sensor frame is the body frame; the surface gives shape and centre.

    Attributes:
        surface: Outer shape, in the sensor frame.
        mass: Of everything on the tip side of the sensor [kg], at the centre of the surface.
    """

    surface: Sphere | Ellipsoid
    mass: float = 0.03

    def __post_init__(self) -> None:
        positive("mass", self.mass, "kg")
        surface: object = self.surface
        if not isinstance(surface, Sphere | Ellipsoid):
            kind = type(self.surface).__name__
            raise InvalidValueError(f"surface is a {kind}: a simulated tip is a Sphere or an Ellipsoid")

    @property
    def center_of_mass(self) -> tuple[float, float, float]:
        """Centre of mass in the sensor frame [m]."""
        x, y, z = self.surface.center.tolist()
        return (x, y, z)

    def add_to(self, parent: mujoco.MjsBody) -> mujoco.MjsBody:
        """Add the tip's body, geom and sensor site to a parent body, at its origin."""
        center = list(self.center_of_mass)
        half_lengths = self.surface.half_lengths
        body = parent.add_body(name="tip")
        body.explicitinertial = True
        body.mass = self.mass
        body.ipos = center
        body.iquat = _quat_wxyz(self.surface)
        # an ellipsoid's: m (b^2 + c^2) / 5
        squares = [length**2 for length in half_lengths]
        body.inertia = [self.mass * (sum(squares) - square) / 5 for square in squares]
        is_sphere = isinstance(self.surface, Sphere)
        body.add_geom(
            name=TIP_GEOM,
            type=mujoco.mjtGeom.mjGEOM_SPHERE if is_sphere else mujoco.mjtGeom.mjGEOM_ELLIPSOID,
            size=[half_lengths[0], 0.0, 0.0] if is_sphere else half_lengths,
            pos=center,
            quat=_quat_wxyz(self.surface),
            contype=0,
            conaffinity=0,
        )
        body.add_site(name=SENSOR_SITE)
        return body


def _quat_wxyz(surface: Sphere | Ellipsoid) -> list[float]:
    quat_wxyz = np.zeros(4)
    mujoco.mju_mat2Quat(quat_wxyz, surface.rotation.ravel())
    return [float(entry) for entry in quat_wxyz]
