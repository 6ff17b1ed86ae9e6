"""MuJoCo scenes made of pieces that name physical quantities, and the back end that runs them."""

from palpate.sim.backend import MujocoBackend, Truth
from palpate.sim.contact_law import ContactLaw, PairParameters
from palpate.sim.noise import WrenchNoise
from palpate.sim.objects import Box, CylinderObject, EllipsoidObject, SceneObject, SphereObject
from palpate.sim.scene import StageScene, build_stage_scene
from palpate.sim.stage import Stage
from palpate.sim.tip import Tip

__all__ = [
    "Box",
    "ContactLaw",
    "CylinderObject",
    "EllipsoidObject",
    "MujocoBackend",
    "PairParameters",
    "SceneObject",
    "SphereObject",
    "Stage",
    "StageScene",
    "Tip",
    "Truth",
    "WrenchNoise",
    "build_stage_scene",
]
