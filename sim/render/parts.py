"""Roles of the bodies of a compiled scene, from names and the tree: machine, tips, ground, objects."""

from collections.abc import Iterator
from enum import Enum

import mujoco

from palpate.sim.hand.hand import finger_name
from palpate.sim.hand.mount import PALM
from palpate.sim.tip import SENSOR_SITE, TIP_GEOM


class Role(Enum):
    """What a geom belongs to."""

    TIP = "tip"
    MACHINE = "machine"
    """Arm, palm, fingers."""
    GROUND = "ground"
    """A plane that objects stand on."""
    OBJECT = "object"
    """All else: what is touched."""


def body_names(model: mujoco.MjModel) -> tuple[str, ...]:
    """Return the names of a scene's bodies, by number."""
    return tuple(model.body(i).name for i in range(model.nbody))


def palm_of(model: mujoco.MjModel) -> int | None:
    """Return the number of the palm's body; None for a scene without hand."""
    names = body_names(model)
    return names.index(PALM) if PALM in names else None


def carried_body(model: mujoco.MjModel) -> int | None:
    """Return the number of the body whose frame a sample's arm tells: the palm's, or a single tip's, if any."""
    palm = palm_of(model)
    if palm is not None:
        return palm
    if SENSOR_SITE not in (model.site(i).name for i in range(model.nsite)):
        return None
    return int(model.site(SENSOR_SITE).bodyid[0])


def ancestors(model: mujoco.MjModel, body: int) -> Iterator[int]:
    """The body and all that carry it, the world left out."""
    while body:
        yield body
        body = int(model.body_parentid[body])


def descendants(model: mujoco.MjModel, body: int) -> Iterator[int]:
    """What hangs on a body."""
    return (other for other in range(body + 1, model.nbody) if body in ancestors(model, other))


def finger_bodies(model: mujoco.MjModel) -> tuple[str, ...]:
    """Return the body of each fingertip, in order: its frame is that of the sensor behind it."""
    sites = {model.site(i).name: int(model.site_bodyid[i]) for i in range(model.nsite)}
    names = [SENSOR_SITE] if SENSOR_SITE in sites else []
    while (name := f"{finger_name(len(names))}_{SENSOR_SITE}") in sites:
        names.append(name)
    return tuple(model.body(sites[name]).name for name in names)


def roles_of(model: mujoco.MjModel) -> tuple[Role, ...]:
    """Return what each geom of a scene is, by number."""
    carried = carried_body(model)
    machine = set() if carried is None else {*ancestors(model, carried), *descendants(model, carried)}
    return tuple(_role(model, geom, machine) for geom in range(model.ngeom))


def _role(model: mujoco.MjModel, geom: int, machine: set[int]) -> Role:
    name = model.geom(geom).name
    if name == TIP_GEOM or name.endswith(f"_{TIP_GEOM}"):
        return Role.TIP
    if int(model.geom_bodyid[geom]) in machine:
        return Role.MACHINE
    if int(model.geom_type[geom]) == int(mujoco.mjtGeom.mjGEOM_PLANE):
        return Role.GROUND
    return Role.OBJECT
