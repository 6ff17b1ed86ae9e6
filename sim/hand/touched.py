"""What a held object touches: a surface beside hand and object."""

from dataclasses import dataclass

import mujoco

from palpate.kinematics.pose import Pose
from palpate.sim.contact_law import ContactLaw, PairParameters
from palpate.sim.contact_pair import CONTACT_FIELDS, add_contact_sensor, add_pair
from palpate.sim.contact_truth import Truth
from palpate.sim.hand.contact import GraspContact, grasp_pair_parameters
from palpate.sim.objects.target import StaticObject

TOUCHED = "touched"
"""Of body and geom."""

TOUCHED_READINGS = 1 + 3 + 3 + 3
"""Numbers of its contact sensor, the last of the scene: `CONTACT_FIELDS`."""

assert len(CONTACT_FIELDS) == 4


@dataclass(frozen=True, slots=True)
class Touched:
    """A fixed surface that a held object is to touch.

    Attributes:
        target: The surface.
        law: Of the contact; its impedance is that of grasps, which bear contacts that are stiff for a light object.
    """

    target: StaticObject
    law: ContactLaw

    def add_to(self, spec: mujoco.MjSpec) -> None:
        """Add body and geom to a scene."""
        self.target.add_to(spec, TOUCHED)

    def add_contact(
        self, spec: mujoco.MjSpec, held: str, inverse_mass: float, time_step: float, impratio: float
    ) -> PairParameters:
        """Let a held object's geom touch it, and add what tells the truth of that, as the last sensor.

        Args:
            spec: The scene.
            held: Name of the geom.
            inverse_mass: Of the held object [1/kg].
            time_step: Of the simulation [s].
            impratio: Of the whole scene.

        Raises:
            InvalidValueError: The contact is too stiff for mass and time step; the message says what would do.
        """
        law = self.target.law(self.law)
        sticking = GraspContact(law.stiffness, law.friction, law.spin_length, law.damping_ratio, impratio)
        pair = grasp_pair_parameters(sticking, inverse_mass, time_step, law.smallest_force, law.lift_speed)
        add_pair(spec, held, TOUCHED, pair)
        add_contact_sensor(spec, held, TOUCHED)
        return pair


def truth_of_touch(readings: list[float]) -> Truth:
    """Return what the surface exerts on the held object, from a scene's last sensor."""
    found, fx, fy, fz, tx, ty, tz, x, y, z = readings[-TOUCHED_READINGS:]
    # the contact sensor gives what its first geom, the held object, exerts on the surface
    return Truth(found > 0.0, (x, y, z), (-fx, -fy, -fz), (-tx, -ty, -tz), Pose())
