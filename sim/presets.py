"""Defaults of each kind of scene.

`benchmarks/simulation` justifies every value: each preset lies on the front of speed against error among the
choices that reach as far as its kind of scene needs, and the benchmark fails if one does not.

- MuJoCo's semi-implicit Euler step costs what `implicitfast` does, and follows servo and contact more closely: a
  twentieth to a tenth less force error in a scan on a stage.
- Half a millisecond is about the longest step that takes a contact of 100 kN/m, on a stage of 5 kg or on the arm.
  Steps of a millisecond halve the cost of the physics and do as well for 20 kN/m, and for nothing much stiffer.
  Shorter ones gain nothing.
- The impedance of a scan is low: the contact then pushes by penetration alone, and not by what slides. Half of it
  again gains little, and asks for shorter steps on a light stage. So does the preset's own for a light object that
  is free: `ContactLaw`'s default is for that.
- In a grasp the opposite counts: a high impedance bears contacts that are stiff for the object's mass, as under a
  box on a table, where that of a scan throws it about. What slides fast is pressed somewhat more in return.
"""

from dataclasses import dataclass, field

from palpate.sim.carriers.arm_carrier import ArmCarrier
from palpate.sim.carriers.carrier import Carrier
from palpate.sim.carriers.stage import Stage
from palpate.sim.contact_law import ContactLaw
from palpate.sim.fidelity import Cone, Fidelity, Integrator
from palpate.sim.hand.contact import GraspContact


@dataclass(frozen=True, slots=True)
class TouchPreset:
    """A scene of one fingertip and one object.

    Attributes:
        fidelity: How it is computed.
        law: How tip and object press and rub.
        carrier: What carries the tip.
    """

    fidelity: Fidelity
    law: ContactLaw
    carrier: Carrier


@dataclass(frozen=True, slots=True)
class GraspPreset:
    """A scene of a hand and what it holds.

    Attributes:
        fidelity: How it is computed.
        law: How fingertips and object press and rub; impedance, impratio and friction damping are constants of
            `palpate.sim.hand.contact`.
    """

    fidelity: Fidelity
    law: GraspContact = field(default_factory=GraspContact)


EXPLORE = TouchPreset(
    Fidelity(time_step=0.5e-3, integrator=Integrator.EULER, cone=Cone.ELLIPTIC),
    ContactLaw(stiffness=20e3, impedance=0.02, smallest_force=0.5, lift_speed=1.0, creep_speed=1e-4),
    Stage(),
)
"""A tip that slides over a fixed object, as cheaply as that can be had."""

ARM = TouchPreset(EXPLORE.fidelity, EXPLORE.law, ArmCarrier())
"""The same, carried by a UR5e."""

GRASP = GraspPreset(Fidelity(time_step=1e-3, integrator=Integrator.EULER, cone=Cone.ELLIPTIC))
"""A hand that holds an object for minutes."""
