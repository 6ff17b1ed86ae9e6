"""A compliant target: on a slide with a spring and a damper."""

import math
from dataclasses import dataclass

import mujoco

from palpate.errors import InvalidValueError, check_positive, positive, vector
from palpate.sim.contact_law import ContactLaw
from palpate.sim.objects.primitives import SceneObject
from palpate.sim.objects.target import Mount, Nowhere, Placer
from palpate.sim.objects.traced import TracedObject
from palpate.spatial import ZERO, Vector, norm

UP: Vector = (0.0, 0.0, 1.0)

TURNING = 1e-3
"""Square of its radius of gyration [m^2]: it never turns, and any number will do."""


@dataclass(frozen=True, slots=True)
class SprungTarget:
    """An object on a slide, held by a spring and a damper; its weight is balanced. A `Target`.

    Attributes:
        shape: Its surface.
        stiffness: Of the spring [N/m].
        damping: Of the damper [N s/m].
        mass: Of what slides [kg].
        axis: Along which it slides, base frame; its length does not matter.
        position: Of the shape's origin when the spring is at rest, base frame [m].
    """

    shape: SceneObject
    stiffness: float = 2e3
    damping: float = 60.0
    mass: float = 1.0
    axis: Vector = UP
    position: Vector = ZERO

    def __post_init__(self) -> None:
        check_positive(self, stiffness="N/m", damping="N s/m", mass="kg")
        vector("axis", self.axis, 3, "")
        positive("length of axis", norm(self.axis), "")
        vector("position", self.position, 3, "m")
        if isinstance(self.shape, TracedObject):
            raise InvalidValueError(
                f"shape is a {type(self.shape).__name__}: must be fixed, its surface does not move with a body; "
                "take a convex object"
            )

    @property
    def damping_ratio(self) -> float:
        """Of the mass on its spring, by itself."""
        return 0.5 * self.damping / math.sqrt(self.stiffness * self.mass)

    @property
    def mount(self) -> Mount:
        """Sprung."""
        return Mount.SPRUNG

    def law(self, press: ContactLaw) -> ContactLaw:
        """See `Target`: it has no friction of its own."""
        return press

    def add_to(self, spec: mujoco.MjSpec, name: str) -> mujoco.MjsBody:
        """Add body, geom and slide, all of that name, to a scene's world."""
        self.shape.add_assets(spec, name)
        body = spec.worldbody.add_body(name=name, pos=self.position)
        body.explicitinertial = True
        body.mass = self.mass
        body.inertia = [self.mass * TURNING] * 3
        body.gravcomp = 1.0
        body.add_joint(
            name=name,
            type=mujoco.mjtJoint.mjJNT_SLIDE,
            axis=self.axis,
            stiffness=self.stiffness,
            damping=self.damping,
        )
        self.shape.add_geom(body, name)
        return body

    def placer(self, model: mujoco.MjModel, data: mujoco.MjData, name: str, tip_geom: str) -> Placer:
        """See `Target`: MuJoCo moves it."""
        return Nowhere()
