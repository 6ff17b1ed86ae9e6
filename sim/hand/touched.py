"""What a held object touches: a surface beside hand and object."""

from dataclasses import dataclass, field

import mujoco

from palpate.kinematics.pose import Pose
from palpate.sim.carriers.arm_model import quat_wxyz
from palpate.sim.contact_law import ContactLaw, PairParameters
from palpate.sim.contact_pair import add_contact_sensor, add_pair
from palpate.sim.contact_truth import Truth
from palpate.sim.hand.contact import GraspContact, grasp_pair_parameters
from palpate.sim.objects.primitives import SceneObject
from palpate.sim.objects.target import Placer, placer_of

TOUCHED = "touched"
"""Of body and geom."""

TOUCHED_READINGS = 10
"""Numbers of its contact sensor: `palpate.sim.contact_pair.CONTACT_FIELDS`."""


@dataclass(frozen=True, slots=True)
class Touched:
    """A fixed surface that a held object is to touch.

    Attributes:
        shape: The surface.
        law: Of the contact; its impedance is that of grasps, which bear what is stiff for a light object.
        pose: Of the surface in the base frame.
    """

    shape: SceneObject
    law: ContactLaw
    pose: Pose = field(default_factory=Pose)

    def add_to(self, spec: mujoco.MjSpec) -> None:
        """Add body and geom to a scene."""
        self.shape.add_assets(spec, TOUCHED)
        at = self.pose
        body = spec.worldbody.add_body(name=TOUCHED, pos=at.position, quat=quat_wxyz(at.rotation))
        self.shape.add_geom(body, TOUCHED)

    def add_contact(
        self, spec: mujoco.MjSpec, held: str, inverse_mass: float, time_step: float, impratio: float
    ) -> PairParameters:
        """Let a held object's geom touch it, and add what tells the truth of that.

        Args:
            spec: The scene.
            held: Name of the geom.
            inverse_mass: Of the held object [1/kg].
            time_step: Of the simulation [s].
            impratio: Of the whole scene.

        Raises:
            InvalidValueError: The contact is too stiff for mass and time step; the message says what would do.
        """
        law = self.law
        sticking = GraspContact(law.stiffness, law.friction, law.spin_length, law.damping_ratio, impratio)
        pair = grasp_pair_parameters(sticking, inverse_mass, time_step, law.smallest_force, law.lift_speed)
        add_pair(spec, held, TOUCHED, pair)
        add_contact_sensor(spec, held, TOUCHED)
        return pair

    def placer(self, model: mujoco.MjModel, data: mujoco.MjData, held: str) -> Placer:
        """Return what it asks for before each time step.

        Args:
            model: The scene.
            data: Its state, which must live on.
            held: Name of the held object's geom.

        Raises:
            InvalidValueError: It cannot be touched by that.
        """
        return placer_of(self.shape, model, data, TOUCHED, held)

    def truth(self, readings: list[float]) -> Truth:
        """Return what it exerts on the held object, from the readings of their contact sensor."""
        found, fx, fy, fz, tx, ty, tz, x, y, z = readings
        # the contact sensor gives what its first geom, the held object, exerts on the surface
        return Truth(found > 0.0, (x, y, z), (-fx, -fy, -fz), (-tx, -ty, -tz), self.pose)
