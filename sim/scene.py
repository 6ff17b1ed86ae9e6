"""A scene: what carries the tip, the tip, an object, a table if wanted, and nothing else."""

import copy
import io
import math
import pickle
import types
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import mujoco
import numpy as np

from palpate.errors import InvalidValueError
from palpate.sim.carriers.arm_model import ArmModel
from palpate.sim.carriers.carrier import Carrier
from palpate.sim.carriers.stage import Stage
from palpate.sim.contact_law import (
    ContactLaw,
    PairParameters,
    frictionless_parameters,
    largest_inverse_mass,
    pair_parameters,
)
from palpate.sim.contact_pair import add_contact_sensor, add_pair
from palpate.sim.fidelity import GRAVITY, Fidelity
from palpate.sim.friction.law import FrictionLaw
from palpate.sim.friction.pairs import FrictionPair
from palpate.sim.friction.texture import Texture
from palpate.sim.objects.primitives import SceneObject
from palpate.sim.objects.table import Table
from palpate.sim.objects.target import Mount, Target, as_target
from palpate.sim.objects.traced import TracedObject
from palpate.sim.tip import SENSOR_SITE, TIP_GEOM, Tip
from palpate.spatial import Vector, add, subtract

_ITSELF = (type, types.FunctionType, mujoco.MjSpec, ArmModel)
"""Compared by which object it is: code, which a notebook may define anew under the same name, and an arm, which is
read once."""


class SceneContent:
    """Parts of a scene that are equal if they are of the same kinds and hold the same numbers.

    A scene that was compiled before is found again by them. Parts from a robot file or an experiment are made anew
    for every run, and many hold arrays: their content is compared, not their identity.

    Attributes:
        parts: As they were given.
    """

    __slots__ = ("_packed", "_themselves", "parts")

    def __init__(self, *parts: Any) -> None:
        """Take the parts.

        Raises:
            Exception: One of them cannot be pickled; each kind has its own way to say so.
        """
        self.parts, self._themselves = parts, list[object]()
        packed = io.BytesIO()
        _Packer(packed, self._themselves).dump(parts)
        self._packed = packed.getvalue()

    def __eq__(self, other: object) -> bool:
        """Whether the same scene comes of them."""
        return isinstance(other, SceneContent) and self._packed == other._packed

    def __hash__(self) -> int:
        """Of what is compared."""
        return hash(self._packed)


class _Packer(pickle.Pickler):
    """Packs what is compared by itself as its number, and keeps it, so that no other object gets that number."""

    def __init__(self, file: io.BytesIO, themselves: list[object]) -> None:
        super().__init__(file, pickle.HIGHEST_PROTOCOL)
        self._themselves = themselves

    def persistent_id(self, found: object) -> int | None:
        if not isinstance(found, _ITSELF):
            return None
        self._themselves.append(found)
        return id(found)


OBJECT_GEOM = "object"
"""Of the object's body, too, but in a scene from a file."""

TABLE_GEOM = "table"

MOST_KEPT = 8
"""Scenes that are kept compiled: a plan asks for one, then its run, and the next runs of a sweep."""


@dataclass(frozen=True, slots=True)
class Scene:
    """A compiled scene and what is known of it.

    Attributes:
        model: The compiled model.
        tip: The fingertip.
        carrier: What carries it.
        target: The object.
        law: The wanted contact of tip and object.
        pair: As realised.
        fidelity: How it is computed.
        rubbing: Whom a friction plant serves; all else rubs by MuJoCo's law.
        table: Under the object, if there is one.
    """

    model: mujoco.MjModel
    tip: Tip
    carrier: Carrier
    target: Target
    law: ContactLaw
    pair: PairParameters
    fidelity: Fidelity
    rubbing: tuple[FrictionPair, ...] = ()
    table: Table | None = None


def build_scene(
    tip: Tip,
    target: SceneObject | Target,
    law: ContactLaw,
    start: Vector,
    carrier: Carrier | None = None,
    fidelity: Fidelity | None = None,
    friction: FrictionLaw | None = None,
    texture: Texture | None = None,
    table: Table | None = None,
) -> Scene:
    """Compile a scene of one tip and one object; one that was compiled before is copied.

    Args:
        tip: The fingertip on its sensor.
        target: The object. A surface alone is fixed at the origin of the base frame; an `ObjectBody` rubs by its
            own friction, and may be pushed if it is free; a `MovingTarget` has a prescribed motion; around a
            `SceneTarget` stands the rest of its scene, which the tip may hit, too.
        law: Contact between the two.
        start: Where the sensor frame's origin starts, base frame [m].
        carrier: What carries the tip; a `Stage` if not given.
        fidelity: How it is computed.
        friction: How the two rub, by the friction plant; MuJoCo's own friction with `law` if not given.
        texture: How that friction varies over the object.
        table: What a free object stands on, pressing and spinning by `law`, rubbing by the table's own friction;
            nothing else touches it. None if not given.

    Raises:
        InvalidValueError: The contact law cannot be kept with these masses and this time step, neither tip nor
            object can move, or one thing would start inside another.
    """
    carrier, target, fidelity = carrier or Stage(), as_target(target), fidelity or Fidelity()
    parts = tip, target, law, start, carrier, fidelity, friction, texture, table
    try:
        content = SceneContent(*parts)
    except Exception:  # something in it cannot be pickled, and says so in a way of its own
        return _compiled(*parts)
    kept = _kept(content)
    # a copy: who has it may change it, and a rolling tip does
    return replace(kept, model=copy.copy(kept.model), tip=tip, target=target, carrier=carrier)


@lru_cache(maxsize=MOST_KEPT)
def _kept(content: SceneContent) -> Scene:
    return _compiled(*content.parts)


def _compiled(
    tip: Tip,
    target: Target,
    law: ContactLaw,
    start: Vector,
    carrier: Carrier,
    fidelity: Fidelity,
    friction: FrictionLaw | None,
    texture: Texture | None,
    table: Table | None,
) -> Scene:
    if texture is not None and isinstance(target.shape, TracedObject):
        raise InvalidValueError(
            f"texture on a {type(target.shape).__name__}: its simulated surface moves with the tip; take a "
            "primitive"
        )
    _check_clear(tip, target, start)
    spec, time_step = fidelity.new_spec(), fidelity.time_step

    tip.add_assets(spec)
    tip.add_to(carrier.mount(spec, tip, start))  # first: drives find their joints ahead of all others
    carried = {each.name for each in spec.geoms}
    body = target.add_to(spec, OBJECT_GEOM).name
    around = [each.name for each in spec.geoms if each.name not in carried and _collides(each)]
    if table is not None:
        table.add_to(spec, TABLE_GEOM)

    compiled = spec.compile()  # what MuJoCo takes for the bodies' inverse masses, before there are pairs
    of_tip, of_target = (float(compiled.body_invweight0[compiled.body(name).id, 0]) for name in ("tip", body))
    law = target.law(law)
    if of_tip + of_target == 0.0:
        raise InvalidValueError(
            f"carrier = {carrier}, target = {target}: neither can move, and nothing would press; take a carrier "
            "that moves, or an object that does"
        )
    if target.mount is Mount.SPRUNG:
        _check_mount_mass(of_target, largest_inverse_mass(law, time_step) - of_tip, law, time_step)
    parameters = pair_parameters if friction is None else frictionless_parameters
    if target.mount is Mount.JOINTED:  # of what hangs on joints MuJoCo takes a mean over all directions
        pair_parameters(law, of_tip + _largest_inverse_mass(compiled), time_step)
    pair = parameters(law, of_tip + of_target, time_step)
    impratio = pair.impratio
    if target.mount is Mount.FIXED:  # tip and carrier are all that moves: there is nothing to sort into islands
        spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_ISLAND
    if table is not None and target.mount is Mount.FREE:
        sinks = GRAVITY * float(compiled.body(OBJECT_GEOM).mass[0]) / law.stiffness
        _check_stands(target, table, sinks)
        standing = pair_parameters(table.law(law), of_target, time_step)
        add_pair(spec, OBJECT_GEOM, TABLE_GEOM, standing)
        # one for the whole model: the larger one lets the other contact creep even less
        impratio = max(impratio, standing.impratio)
    if pair.condim > 1 and impratio > pair.impratio:
        pair = replace(pair, impratio=impratio, creep_speed=pair.creep_speed * pair.impratio / impratio)
    spec.option.impratio = impratio
    add_pair(spec, TIP_GEOM, OBJECT_GEOM, pair)
    for name in around:
        of_other = float(compiled.body_invweight0[int(compiled.geom(name).bodyid[0]), 0])
        add_pair(spec, TIP_GEOM, name, pair_parameters(law, of_tip + of_other, time_step))
    _add_sensors(spec)
    if target.mount is not Mount.FIXED:
        _add_pose_sensors(spec, body)
    carrier.add_sensors(spec)
    model = spec.compile()
    found = float(model.body_invweight0[model.body("tip").id, 0])
    if abs(found - of_tip) > 1e-9 * of_tip:
        raise AssertionError(f"MuJoCo's inverse mass of the tip is {found} 1/kg, not {of_tip}")
    rubbing = () if friction is None else (FrictionPair(TIP_GEOM, OBJECT_GEOM, friction, texture),)
    return Scene(model, tip, carrier, target, law, pair, fidelity, rubbing, table)


def _check_mount_mass(inverse_mass: float, room: float, law: ContactLaw, time_step: float) -> None:
    """Refuse a mount whose mass alone is what the contact is too stiff for.

    Args:
        inverse_mass: Of what moves on the mount [1/kg].
        room: The largest that would do [1/kg]; without any, the tip is too light, whatever the mount.
        law: Of the contact.
        time_step: Of the simulation [s].
    """
    if 0.0 < room < inverse_mass:
        raise InvalidValueError(
            f"mount_mass = {1.0 / inverse_mass:.3g} kg: too light for a contact of {law.stiffness:g} N/m with a "
            f"time step of {time_step:g} s; take at least {math.ceil(1e3 / room) / 1e3:g} kg, or a softer contact"
        )


def _largest_inverse_mass(model: mujoco.MjModel) -> float:
    """Return what the object's middle accelerates by per force in its easiest direction, at its start [1/kg]."""
    data, geom = mujoco.MjData(model), int(model.geom(OBJECT_GEOM).id)
    mujoco.mj_forward(model, data)
    moved, accelerated = np.zeros((3, model.nv)), np.zeros((3, model.nv))
    mujoco.mj_jac(model, data, moved, None, data.geom_xpos[geom], int(model.geom_bodyid[geom]))
    mujoco.mj_solveM(model, data, accelerated, moved)
    return float(np.linalg.eigvalsh(moved @ accelerated.T)[-1])


def _check_clear(tip: Tip, target: Target, start: Vector) -> None:
    """Refuse a tip whose very centre starts inside the object: it would be shot out of it."""
    if target.mount is Mount.DRIVEN:
        return  # where that starts, its motion says
    center = subtract(add(start, tip.center_of_mass), target.position)
    gap = float(target.shape.signed_distance(np.array([center]))[0])
    if gap <= 0.0:
        raise InvalidValueError(
            f"start = {start} m: the centre of the tip starts {-gap:.4g} m inside the object: must start clear "
            f"of it; the object's highest point is at z = {target.position[2] + target.shape.top:.4g} m"
        )


def _check_stands(target: Target, table: Table, sinks: float) -> None:
    """Refuse an object that starts deeper inside the table than its weight would sink it [m]."""
    lowest = target.position[2] + target.shape.bottom
    if table.top - lowest > sinks:
        raise InvalidValueError(
            f"position of the object: z = {target.position[2]:g} m: it starts {table.top - lowest:.4g} m inside "
            f"the table, whose top is at {table.top:g} m; put it at z = {table.top - target.shape.bottom:g} m"
        )


def _collides(geom: mujoco.MjsGeom) -> bool:
    """Whether it stands in the tip's way: geoms of a scene from a file may; ours meet in pairs only."""
    return geom.name != OBJECT_GEOM and bool(geom.contype & 1 or geom.conaffinity & 1)


def _add_pose_sensors(spec: mujoco.MjSpec, body: str) -> None:
    """Add what tells where an object is that moves, ahead of the carrier's own sensors."""
    for kind in (mujoco.mjtSensor.mjSENS_FRAMEPOS, mujoco.mjtSensor.mjSENS_FRAMEQUAT):
        # xbody: the frame as it was given; body would be the centre of mass
        spec.add_sensor(type=kind, objtype=mujoco.mjtObj.mjOBJ_XBODY, objname=body)


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
    add_contact_sensor(spec, TIP_GEOM, OBJECT_GEOM)
