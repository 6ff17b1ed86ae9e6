"""A scene for grasping: hand, object, a table if wanted, and nothing else."""

from dataclasses import dataclass, field, replace

import mujoco
import numpy as np

from palpate.errors import InvalidValueError, positive
from palpate.kinematics.pose import Pose, checked_pose
from palpate.sim.carriers.carrier import Carrier
from palpate.sim.carriers.fixed import Fixed
from palpate.sim.contact_law import ContactLaw, PairParameters
from palpate.sim.contact_pair import add_contact_sensor, add_pair
from palpate.sim.fidelity import Fidelity
from palpate.sim.friction.law import FrictionLaw
from palpate.sim.friction.pairs import FrictionPair
from palpate.sim.friction.texture import Texture
from palpate.sim.hand.contact import GraspContact, frictionless_grasp_parameters, grasp_pair_parameters
from palpate.sim.hand.hand import finger_name
from palpate.sim.hand.hand_model import HandModel
from palpate.sim.hand.mount import PALM, mount_hand
from palpate.sim.hand.touched import Touched
from palpate.sim.objects.primitives import Solid
from palpate.sim.objects.table import Table
from palpate.sim.objects.traced import TracedObject
from palpate.sim.presets import GRASP
from palpate.sim.scene import OBJECT_GEOM, TABLE_GEOM
from palpate.sim.tip import SENSOR_SITE, TIP_GEOM
from palpate.spatial import Vector, add, subtract

OBJECT = "object"

FIXTURE = "fixture"
"""Name of the constraint that holds an object in place."""

FIXTURE_TURNING = 0.03
"""[m] Of its stiffness against turning, over that against motion (MuJoCo's `torquescale`): with 0.01 a box between
round fingertips turns by 8 mrad as they close, with 0.1 a pin between flat ones stays askew."""

WORLD = "world"
"""MuJoCo's name of the body that never moves."""


@dataclass(frozen=True, slots=True)
class HeldObject:
    """What is to be grasped.

    Attributes:
        shape: Its surface, in its own frame.
        mass: Evenly spread [kg].
        pose_base_object: Where it starts.
    """

    shape: Solid
    mass: float = 0.1
    pose_base_object: Pose = field(default_factory=Pose)

    def __post_init__(self) -> None:
        positive("mass", self.mass, "kg")
        checked_pose("pose_base_object", self.pose_base_object)
        if isinstance(self.shape, TracedObject):
            raise InvalidValueError(
                f"shape is a {type(self.shape).__name__}: its simulated surface follows one tip and stands still; "
                "take a convex object"
            )


@dataclass(frozen=True, slots=True)
class GraspScene:
    """A compiled scene and what is known of it.

    Attributes:
        model: The compiled model.
        hand: The hand.
        carrier: What carries it.
        target: What is to be grasped.
        law: The wanted contact between fingertips and object.
        pair: As realised at the first fingertip; with what the object touches, if there is such a thing.
        fidelity: How it is computed.
        palm: Where the hand frame starts, base frame [m]; its axes are the base frame's.
        rubbing: Whom a friction plant serves; all else rubs by MuJoCo's law.
        touched: What the held object touches, besides a table; None: nothing.
    """

    model: mujoco.MjModel
    hand: HandModel
    carrier: Carrier
    target: HeldObject
    law: GraspContact
    pair: PairParameters
    fidelity: Fidelity
    palm: Vector
    rubbing: tuple[FrictionPair, ...] = ()
    touched: Touched | None = None


def build_grasp_scene(
    hand: HandModel,
    target: HeldObject,
    law: GraspContact | None = None,
    carrier: Carrier | None = None,
    table: Table | None = None,
    palm: Vector | None = None,
    fidelity: Fidelity | None = None,
    friction: FrictionLaw | None = None,
    texture: Texture | None = None,
    *,
    exploring: ContactLaw | None = None,
    touched: Touched | None = None,
    fixture: str | None = None,
) -> GraspScene:
    """Compile a scene of a hand over an object.

    Args:
        hand: The hand, reaching down.
        target: What is to be grasped. It falls, unless it stands on a table.
        law: Contact between each fingertip and the object.
        carrier: What carries the hand, whose frame it moves; fixed if not given.
        table: None if not given.
        palm: Where the hand frame starts, base frame [m]; if not given, so that the tips' centres are level with
            the object's frame, around it.
        fidelity: How it is computed; as in `palpate.sim.presets.GRASP` if not given.
        friction: How fingertips and object rub, by the friction plant; MuJoCo's own friction with `law` if not
            given. Table and object rub by MuJoCo's law in any case. A light object needs a softer bristle than the
            law has by itself: at the first contact the plant refuses one too stiff, and says what would do.
        texture: How the plant's friction varies over the object.
        exploring: Of the first fingertip, which slides over the object where the others stick: its lift-off speed
            and the force at which that is stated. None: it sticks as the others do.
        touched: What the held object touches; nothing if not given.
        fixture: Name of the body that holds the object in place until `HandBackend.release`: `WORLD` or `PALM`.
            None: nothing does.

    Raises:
        InvalidValueError: The contact law cannot be kept with these masses and this time step, or a fingertip
            would start inside the object; a texture without a friction law.
    """
    law, carrier = law or GraspContact(), carrier or Fixed()
    if texture is not None and friction is None:
        raise InvalidValueError("texture without friction: MuJoCo's own friction has none; give a FrictionLaw")
    fidelity = fidelity or GRASP.fidelity
    if palm is None:
        palm = subtract(target.pose_base_object.position, hand.center)
    _check_clear(hand, target, palm)
    spec, time_step = fidelity.new_spec(), fidelity.time_step

    mount_hand(spec, hand, carrier, palm)  # first: drives find their joints ahead of all others
    target.shape.add_assets(spec, OBJECT_GEOM)
    quat_wxyz = np.zeros(4)
    mujoco.mju_mat2Quat(quat_wxyz, np.array(target.pose_base_object.rotation).ravel())
    body = spec.worldbody.add_body(name=OBJECT, pos=target.pose_base_object.position, quat=quat_wxyz)
    body.add_freejoint(name=OBJECT)
    target.shape.add_geom(body, OBJECT_GEOM)
    spec.geom(OBJECT_GEOM).mass = target.mass
    if touched is not None:
        touched.add_to(spec)
    if fixture is not None:
        weld = spec.add_equality(
            name=FIXTURE,
            type=mujoco.mjtEq.mjEQ_WELD,
            objtype=mujoco.mjtObj.mjOBJ_BODY,
            name1=OBJECT,
            name2=fixture,
        )
        # at the object's origin, as MuJoCo's own default lies a metre aside; and soft in turning, so that it lies
        # flat between flat fingertips before it is let go of
        weld.data[:3], weld.data[10] = 0.0, FIXTURE_TURNING
        # as stiff as the time step allows; MuJoCo's own would let the object sag by g (20 ms)^2
        weld.solref, weld.solimp = (2.0 * time_step, 1.0), (0.9999, 0.9999, 1e-3, 0.5, 2.0)

    model = spec.compile()  # what MuJoCo takes for the bodies' inverse masses, before there are pairs
    inverse_mass = model.body_invweight0[:, 0]
    of_object = float(inverse_mass[model.body(OBJECT).id])
    tips = [f"{finger_name(i)}_{TIP_GEOM}" for i in range(hand.fingers)]
    pairs = []
    for i, tip in enumerate(tips):
        of_tip = float(inverse_mass[model.body(f"{finger_name(i)}_tip").id])
        A = of_object + of_tip
        if friction is not None:
            pairs.append(frictionless_grasp_parameters(law, A, time_step))
        elif exploring is not None and i == 0:
            force, speed = exploring.smallest_force, exploring.lift_speed
            pairs.append(grasp_pair_parameters(law, A, time_step, force, speed))
        else:
            pairs.append(grasp_pair_parameters(law, A, time_step))
        add_pair(spec, tip, OBJECT_GEOM, pairs[-1])
    pair = pairs[0]
    spec.option.impratio = pair.impratio
    if table is not None:
        _add_table(spec, table, law, of_object, time_step)
    _add_sensors(spec, hand.fingers)
    if touched is not None:
        pair = touched.add_contact(spec, OBJECT_GEOM, of_object, time_step, law.impratio)
    carrier.add_sensors(spec)  # last: there drives find theirs
    rubbing = () if friction is None else tuple(FrictionPair(tip, OBJECT_GEOM, friction, texture) for tip in tips)
    return GraspScene(spec.compile(), hand, carrier, target, law, pair, fidelity, palm, rubbing, touched)


def _check_clear(hand: HandModel, target: HeldObject, palm: Vector) -> None:
    """Refuse fingertips whose very centres start inside the object, whatever their shape."""
    pose_object_base = target.pose_base_object.inverse()
    for i, (pose, tip) in enumerate(zip(hand.sensor_poses(hand.start), hand.tips, strict=True)):
        center = add(palm, (pose @ Pose(tip.center_of_mass)).position)
        gap = float(target.shape.signed_distance(np.array([(pose_object_base @ Pose(center)).position]))[0])
        if gap <= 0.0:
            raise InvalidValueError(
                f"finger {i}: the centre of its tip starts {-gap:.4g} m inside the object: must start clear of "
                "it; take a larger opening, another palm position or a smaller object"
            )


def _add_table(
    spec: mujoco.MjSpec, table: Table, law: GraspContact, inverse_mass: float, time_step: float
) -> None:
    table.add_to(spec, TABLE_GEOM)
    on_table = replace(law, friction=table.friction)
    standing = grasp_pair_parameters(on_table, inverse_mass, time_step)
    # without spin friction: it stands on more than one point
    add_pair(spec, OBJECT_GEOM, TABLE_GEOM, replace(standing, condim=3))


SENSORS_PER_FINGER = 19
SENSORS_AT_ALL = 19


def _add_sensors(spec: mujoco.MjSpec, fingers: int) -> None:
    """Add sensors in the order in which `palpate.sim.hand.backend` reads them."""
    site, body = mujoco.mjtObj.mjOBJ_SITE, mujoco.mjtObj.mjOBJ_BODY
    # xbody: the frame as it was given; body: its centre of mass
    frame = mujoco.mjtObj.mjOBJ_XBODY
    for name in (PALM, OBJECT):
        spec.add_sensor(type=mujoco.mjtSensor.mjSENS_FRAMEPOS, objtype=frame, objname=name)
        spec.add_sensor(type=mujoco.mjtSensor.mjSENS_FRAMELINVEL, objtype=frame, objname=name)
    spec.add_sensor(type=mujoco.mjtSensor.mjSENS_FRAMEQUAT, objtype=frame, objname=OBJECT)
    spec.add_sensor(type=mujoco.mjtSensor.mjSENS_FRAMEANGVEL, objtype=body, objname=OBJECT)
    for i in range(fingers):
        for kind in (
            mujoco.mjtSensor.mjSENS_FORCE,
            mujoco.mjtSensor.mjSENS_TORQUE,
            mujoco.mjtSensor.mjSENS_ACCELEROMETER,
        ):
            spec.add_sensor(type=kind, objtype=site, objname=f"{finger_name(i)}_{SENSOR_SITE}")
        add_contact_sensor(spec, f"{finger_name(i)}_{TIP_GEOM}", OBJECT_GEOM)
