"""MuJoCo scenes made of pieces that name physical quantities, and the back end that runs them."""

from palpate.sim import headless as headless
from palpate.sim import mujoco_version as mujoco_version
from palpate.sim.backend import MujocoBackend
from palpate.sim.carriers.arm_carrier import ArmCarrier
from palpate.sim.carriers.arm_file import ArmFile
from palpate.sim.carriers.arm_model import ArmModel
from palpate.sim.carriers.carrier import CarriedMass, Carrier, Drive
from palpate.sim.carriers.fixed import Fixed
from palpate.sim.carriers.lift import Lift
from palpate.sim.carriers.servoed_arm import ServoedArm
from palpate.sim.carriers.stage import Stage
from palpate.sim.carriers.turning_stage import TurningStage
from palpate.sim.carriers.ur5e import ur5e
from palpate.sim.contact_law import ContactLaw, PairParameters
from palpate.sim.contact_truth import Truth
from palpate.sim.fidelity import Cone, Fidelity, Integrator
from palpate.sim.objects.body import Mount, ObjectBody
from palpate.sim.objects.heights import HeightField, bumps, height_field
from palpate.sim.objects.mesh import ConvexMesh, TracedMesh
from palpate.sim.objects.mesh_file import Triangles, read_triangles
from palpate.sim.objects.motion import DrivenJoint, JointKind, MovingTarget, Ramp, Sine
from palpate.sim.objects.primitives import (
    Box,
    CylinderObject,
    EllipsoidObject,
    SceneObject,
    SphereObject,
)
from palpate.sim.objects.scene_file import FrozenScene, SceneFile
from palpate.sim.objects.scene_target import SceneTarget
from palpate.sim.objects.sprung import SprungTarget
from palpate.sim.objects.table import Table
from palpate.sim.objects.target import StaticObject, Target
from palpate.sim.objects.torus import Torus
from palpate.sim.open_loop import OpenLoopCarrier, Presses, rollout_presses
from palpate.sim.scene import Scene, build_scene
from palpate.sim.sensor.model import SeededSensor, SensorModel, white_noise
from palpate.sim.sensor.presets import PresetSensor, sensor_preset
from palpate.sim.tip import Tip

__all__ = [
    "ArmCarrier",
    "ArmFile",
    "ArmModel",
    "Box",
    "CarriedMass",
    "Carrier",
    "Cone",
    "ContactLaw",
    "ConvexMesh",
    "CylinderObject",
    "Drive",
    "DrivenJoint",
    "EllipsoidObject",
    "Fidelity",
    "Fixed",
    "FrozenScene",
    "HeightField",
    "Integrator",
    "JointKind",
    "Lift",
    "Mount",
    "MovingTarget",
    "MujocoBackend",
    "ObjectBody",
    "OpenLoopCarrier",
    "PairParameters",
    "PresetSensor",
    "Presses",
    "Ramp",
    "Scene",
    "SceneFile",
    "SceneObject",
    "SceneTarget",
    "SeededSensor",
    "SensorModel",
    "ServoedArm",
    "Sine",
    "SphereObject",
    "SprungTarget",
    "Stage",
    "StaticObject",
    "Table",
    "Target",
    "Tip",
    "Torus",
    "TracedMesh",
    "Triangles",
    "Truth",
    "TurningStage",
    "build_scene",
    "bumps",
    "height_field",
    "read_triangles",
    "rollout_presses",
    "sensor_preset",
    "ur5e",
    "white_noise",
]
