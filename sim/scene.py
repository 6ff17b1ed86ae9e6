"""A scene: what carries the tip, the tip and an object, and nothing else."""

from dataclasses import dataclass

import mujoco

from palpate.errors import InvalidValueError
from palpate.sim.carriers.carrier import Carrier
from palpate.sim.carriers.stage import Stage
from palpate.sim.contact_law import ContactLaw, PairParameters, frictionless_parameters, pair_parameters
from palpate.sim.fidelity import Fidelity
from palpate.sim.friction.law import FrictionLaw
from palpate.sim.friction.pairs import FrictionPair
from palpate.sim.friction.texture import Texture
from palpate.sim.objects.primitives import SceneObject
from palpate.sim.objects.traced import TracedObject
from palpate.sim.tip import SENSOR_SITE, TIP_GEOM, Tip
from palpate.spatial import Vector

OBJECT_GEOM = "object"

_CONTACT_FIELDS = (
    mujoco.mjtConDataField.mjCONDATA_FOUND,
    mujoco.mjtConDataField.mjCONDATA_FORCE,
    mujoco.mjtConDataField.mjCONDATA_TORQUE,
    mujoco.mjtConDataField.mjCONDATA_POS,
)
_NET_FORCE = 3
"""Contact sensor reduction (MuJoCo XML reference, sensor/contact, reduce="netforce")."""


@dataclass(frozen=True, slots=True)
class Scene:
    """A compiled scene and what is known of it.

    Attributes:
        model: The compiled model.
        tip: The fingertip.
        carrier: What carries it.
        target: The object, fixed at the origin.
        law: The wanted contact.
        pair: As realised.
        fidelity: How it is computed.
        rubbing: Whom a friction plant serves; all else rubs by MuJoCo's law.
    """

    model: mujoco.MjModel
    tip: Tip
    carrier: Carrier
    target: SceneObject
    law: ContactLaw
    pair: PairParameters
    fidelity: Fidelity
    rubbing: tuple[FrictionPair, ...] = ()


def build_scene(
    tip: Tip,
    target: SceneObject,
    law: ContactLaw,
    start: Vector,
    carrier: Carrier | None = None,
    fidelity: Fidelity | None = None,
    friction: FrictionLaw | None = None,
    texture: Texture | None = None,
) -> Scene:
    """Compile a scene of one tip and one object.

    Args:
        tip: The fingertip on its sensor.
        target: The object, fixed at the origin of the base frame.
        law: Contact between the two.
        start: Where the sensor frame's origin starts, base frame [m].
        carrier: What carries the tip; a `Stage` if not given.
        fidelity: How it is computed.
        friction: How the two rub, by the friction plant; MuJoCo's own friction with `law` if not given.
        texture: How that friction varies over the object.

    Raises:
        InvalidValueError: The contact law cannot be kept with these masses and this time step.
    """
    carrier = Stage() if carrier is None else carrier
    if texture is not None and isinstance(target, TracedObject):
        raise InvalidValueError(
            f"texture on a {type(target).__name__}: its simulated surface moves with the tip; take a primitive"
        )
    fidelity = fidelity or Fidelity()
    spec, time_step = fidelity.new_spec(), fidelity.time_step

    tip.add_assets(spec)
    target.add_assets(spec, OBJECT_GEOM)
    carrier.mount(spec, tip, start)
    body = spec.worldbody.add_body(name="object")
    target.add_geom(body, OBJECT_GEOM)

    inverse_mass = carrier.inverse_mass(spec, tip)  # what MuJoCo's body_invweight0 will say; checked below
    parameters = pair_parameters if friction is None else frictionless_parameters
    pair = parameters(law, inverse_mass, time_step)
    spec.option.impratio = pair.impratio
    spec.add_pair(
        geomname1=TIP_GEOM,
        geomname2=OBJECT_GEOM,
        condim=pair.condim,
        friction=pair.friction,
        solref=pair.solref,
        solreffriction=pair.solreffriction,
        solimp=pair.solimp,
    )
    _add_sensors(spec)
    carrier.add_sensors(spec)
    model = spec.compile()
    found = float(model.body_invweight0[model.body("tip").id, 0])
    if abs(found - inverse_mass) > 1e-9 * inverse_mass:
        raise AssertionError(f"MuJoCo's inverse mass of the tip is {found} 1/kg, not {inverse_mass}")
    rubbing = () if friction is None else (FrictionPair(TIP_GEOM, OBJECT_GEOM, friction, texture),)
    return Scene(model, tip, carrier, target, law, pair, fidelity, rubbing)


def _add_sensors(spec: mujoco.MjSpec) -> None:
    """Add sensors in the order in which `palpate.sim.backend` reads them."""
    site = mujoco.mjtObj.mjOBJ_SITE
    for kind in (
        mujoco.mjtSensor.mjSENS_FRAMEPOS,
        mujoco.mjtSensor.mjSENS_FRAMELINVEL,
        mujoco.mjtSensor.mjSENS_FORCE,
        mujoco.mjtSensor.mjSENS_TORQUE,
        mujoco.mjtSensor.mjSENS_ACCELEROMETER,
    ):
        spec.add_sensor(type=kind, objtype=site, objname=SENSOR_SITE)
    geom = mujoco.mjtObj.mjOBJ_GEOM
    spec.add_sensor(
        type=mujoco.mjtSensor.mjSENS_CONTACT,
        objtype=geom,
        objname=TIP_GEOM,
        reftype=geom,
        refname=OBJECT_GEOM,
        intprm=[sum(1 << int(field) for field in _CONTACT_FIELDS), _NET_FORCE, 1],
    )
