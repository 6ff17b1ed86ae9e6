"""Two geometries that touch, and the sensor that tells what passes between them: the only collisions there are."""

import mujoco

from palpate.sim.contact_law import PairParameters

CONTACT_FIELDS = (
    mujoco.mjtConDataField.mjCONDATA_FOUND,
    mujoco.mjtConDataField.mjCONDATA_FORCE,
    mujoco.mjtConDataField.mjCONDATA_TORQUE,
    mujoco.mjtConDataField.mjCONDATA_POS,
)
"""What the sensor gives, in this order: 1 + 3 + 3 + 3 numbers."""

_NET_FORCE = 3
"""Contact sensor reduction (MuJoCo XML reference, sensor/contact, reduce="netforce")."""


def add_pair(spec: mujoco.MjSpec, first: str, second: str, pair: PairParameters) -> None:
    """Let two geometries collide."""
    spec.add_pair(
        geomname1=first,
        geomname2=second,
        condim=pair.condim,
        friction=pair.friction,
        solref=pair.solref,
        solreffriction=pair.solreffriction,
        solimp=pair.solimp,
    )


def add_contact_sensor(spec: mujoco.MjSpec, first: str, second: str) -> None:
    """Add the net force and torque of two geometries' contacts, and where they act: `CONTACT_FIELDS`."""
    geom = mujoco.mjtObj.mjOBJ_GEOM
    spec.add_sensor(
        type=mujoco.mjtSensor.mjSENS_CONTACT,
        objtype=geom,
        objname=first,
        reftype=geom,
        refname=second,
        intprm=[sum(1 << int(field) for field in CONTACT_FIELDS), _NET_FORCE, 1],
    )
