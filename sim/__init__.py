"""MuJoCo scenes made of pieces that name physical quantities, and the back end that runs them."""

from palpate.sim.arm_carrier import ArmCarrier
from palpate.sim.backend import MujocoBackend, Truth
from palpate.sim.carrier import Carrier, Drive
from palpate.sim.contact_law import ContactLaw, PairParameters
from palpate.sim.object_body import Mount, ObjectBody
from palpate.sim.object_heights import HeightField, bumps, height_field
from palpate.sim.object_mesh import ConvexMesh, TracedMesh
from palpate.sim.object_mesh_file import Triangles, read_triangles
from palpate.sim.object_torus import Torus
from palpate.sim.objects import Box, CapsuleObject, CylinderObject, EllipsoidObject, SceneObject, SphereObject
from palpate.sim.scene import Scene, build_scene
from palpate.sim.sensor import SeededSensor, SensorModel, white_noise
from palpate.sim.sensor_presets import PresetSensor, sensor_preset
from palpate.sim.stage import Stage
from palpate.sim.tip import Tip
from palpate.sim.ur5e import Ur5e

__all__ = [
    "ArmCarrier",
    "Box",
    "CapsuleObject",
    "Carrier",
    "ContactLaw",
    "ConvexMesh",
    "CylinderObject",
    "Drive",
    "EllipsoidObject",
    "HeightField",
    "Mount",
    "MujocoBackend",
    "ObjectBody",
    "PairParameters",
    "PresetSensor",
    "Scene",
    "SceneObject",
    "SeededSensor",
    "SensorModel",
    "SphereObject",
    "Stage",
    "Tip",
    "Torus",
    "TracedMesh",
    "Triangles",
    "Truth",
    "Ur5e",
    "build_scene",
    "bumps",
    "height_field",
    "read_triangles",
    "sensor_preset",
    "white_noise",
]
