"""Uses everything once that palpate compiles and keeps, as a process of its own, which can be killed at any time.

It writes a line of JSON at the start of every step, and one at its end.
"""

import json
import os
import signal
import sys
from collections.abc import Callable, Iterator
from functools import partial

import numpy as np

from palpate import compiling, surfaces
from palpate.commands.calibrate.run import preset_sensor
from palpate.controllers.grip.hanging_load import ForceErrors, OpposedLoad
from palpate.controllers.grip.load_ahead import LoadAhead
from palpate.controllers.grip.wrench_ahead import WrenchAhead
from palpate.controllers.normal_tracker import NormalTracker
from palpate.controllers.paths.slides import prepare
from palpate.controllers.rub_meter import RubMeter
from palpate.friction.slip.load_fall import LoadFall
from palpate.friction.slip.load_noise import LoadNoise
from palpate.grasp import GraspContacts, GraspForceOptimizer, GraspUncertainty, Objective, RobustLeastEffort
from palpate.grasp.problem.scaled import ScaledGrasp
from palpate.grasp.solvers.least_effort import least_violation
from palpate.kinematics import UR5E, ArmKinematics, InverseVelocity
from palpate.mapping import HeightMap, SurfaceMap, TouchCloud, surface_mesh
from palpate.mapping.compare_surface import TriangleSurface
from palpate.mapping.curvature_layers import curvature_layers
from palpate.mapping.primitives import PrimitiveKind, fit_primitive
from palpate.mapping.primitives.choose import choose_primitive
from palpate.runtime import ArmSample, Command, Supervisor
from palpate.runtime.servo_following import PositionServo
from palpate.sensing import contact_from_wrench
from palpate.sensing.ft import FTPipeline
from palpate.sim import (
    ArmCarrier,
    ContactLaw,
    MujocoBackend,
    PresetSensor,
    SceneObject,
    SeededSensor,
    SphereObject,
    Tip,
    Torus,
    TracedMesh,
    Triangles,
    build_scene,
    bumps,
    sensor_preset,
)
from palpate.sim.friction.law import FrictionLaw
from palpate.sim.hand.hand import two_finger_hand
from palpate.spatial import IDENTITY, ZERO

_PERIOD = 1e-3
"""Control period [s]."""

_WRENCH = np.array((0.3, 0.1, -2.0, 0.004, 0.008, 0.001))
_CORNERS = 0.01 * np.vstack([np.eye(3), -np.eye(3)])
_ANGLE = 2.0 * np.pi * np.arange(3) / 3
_OUT = np.column_stack([np.cos(_ANGLE), np.sin(_ANGLE), np.zeros(3)])
_UP = np.tile((0.0, 0.0, 1.0), (3, 1))
_AXES = np.stack([-_OUT, _UP, np.cross(-_OUT, _UP)], axis=2)
_GRASP = GraspContacts(0.03 * _OUT, _AXES, 0.6, 0.005, 0.0, 20.0)
"""Three fingers around a ball of 30 mm."""

_FACETS = np.array([(0, 1, 2), (1, 3, 2), (3, 4, 2), (4, 0, 2), (1, 0, 5), (3, 1, 5), (4, 3, 5), (0, 4, 5)])
"""Corners [m] and triangles of an octahedron."""


def steps() -> Iterator[tuple[str, Callable[[], object]]]:
    """Yield the name of each step and the function that carries it out, most common uses first."""
    tips = (
        ("a sphere", surfaces.Sphere(0.01)),
        ("a paraboloid", surfaces.Paraboloid((0.01, 0.01))),
        ("a capsule", surfaces.Capsule(0.01, 0.03)),
        ("a superellipsoid", surfaces.Superellipsoid((0.01, 0.01, 0.01), 4.0)),
        ("a sphere with deviations", surfaces.NearSphere(0.01, (1e-5,))),
        ("a mesh", surfaces.MeshSurface(_CORNERS, _FACETS)),
    )
    yield "contact on a sphere", partial(contact_from_wrench, tips[0][1], _WRENCH)
    yield "a sensor's samples", partial(FTPipeline, preset_sensor("nano17"))
    yield "the supervisor", _supervise
    yield "the simulation", partial(_simulate, SphereObject(0.04))
    yield "controllers", _control
    yield "arm kinematics", _move_arm
    yield "shapes of a touched surface", _choose_shape
    yield "a surface map", _map
    yield "comparison of meshes", partial(TriangleSurface(_CORNERS, _FACETS).nearest, _CORNERS)
    for objective in Objective:
        yield f"grasp forces, {objective.value.replace('_', ' ')}", partial(_hold, objective)
    yield "grasp forces with a reserve", _hold_with_reserve
    yield "grasp forces with shared actuators", _hold_by_tendon
    for name, surface in tips[1:]:
        yield f"contact on {name}", partial(contact_from_wrench, surface, _WRENCH)
    for name, target in (
        ("ring", Torus(0.06, 0.025)),
        ("height field", bumps()),
        ("mesh", TracedMesh(Triangles(4.0 * _CORNERS, _FACETS))),
    ):
        yield f"simulation of a {name}", partial(_simulate, target)
    yield "simulation of friction", partial(_simulate, SphereObject(0.04), FrictionLaw())


def _simulate(target: SceneObject, friction: FrictionLaw | None = None) -> None:
    tip = Tip(surfaces.Sphere(0.008))
    scene = build_scene(tip, target, ContactLaw(), (0.0, 0.0, target.top + 0.02), friction=friction)
    backend = MujocoBackend(scene, sensor=SeededSensor(sensor_preset(PresetSensor.NANO17)))
    backend.start()
    backend.step(Command())
    backend.close()
    points = _CORNERS.copy()
    target.signed_distance(points)
    points.setflags(write=False)
    target.signed_distance(points)
    target.height(points[:, 0], points[:, 1])
    target.height(*np.meshgrid(points[:, 0], points[:, 1]))
    target.reachable(0.0, 0.0, 0.008)


def _control() -> None:
    prepare()
    NormalTracker(_PERIOD, 0.01, 0.02)
    RubMeter()
    LoadAhead(0.01, _PERIOD)
    WrenchAhead(0.01, _PERIOD)
    OpposedLoad(two_finger_hand(), ForceErrors(0.01), LoadNoise(), 0.004, _PERIOD)
    LoadFall(_PERIOD)


def _supervise() -> None:
    Supervisor().start(1e-3)
    PositionServo(1e4, 0.02, 0.02).following(20.0)(1e-3, ArmSample(0.0, ZERO, IDENTITY, ZERO))


def _move_arm() -> None:
    kinematics = ArmKinematics(UR5E)
    kinematics.pose((0.0,) * 6)
    kinematics.jacobian((0.0,) * 6)
    InverseVelocity(kinematics)
    scene = build_scene(
        Tip(surfaces.Sphere(0.008)), SphereObject(0.04), ContactLaw(), (0.0, 0.0, 0.05), ArmCarrier()
    )
    MujocoBackend(scene).close()


def _choose_shape() -> None:
    """Fit shapes to 25 contacts on a cap of a ball of 40 mm."""
    x, y = (each.ravel() for each in np.meshgrid(*[np.linspace(-0.4, 0.4, 5)] * 2))
    normal = np.column_stack([x, y, np.sqrt(1.0 - x**2 - y**2)])
    force, none = np.ones(len(x)), np.zeros((len(x), 3))
    choose_primitive(TouchCloud(np.arange(float(len(x))), 0.04 * normal, normal, force, none, 0.0 * force))


def _map() -> None:
    """Map the contacts of two rows on a ball of 40 mm."""
    row = np.linspace(-0.3, 0.3, 400)
    angle = np.column_stack([np.concatenate([row, row[::-1]]), np.repeat((0.0, 0.03), len(row))])
    normal = np.column_stack([np.sin(angle), np.cos(angle[:, 0])])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    n = len(normal)
    time, load = np.linspace(0.0, 1.0, n), np.ones(n)
    cloud = TouchCloud(time, 0.04 * normal, normal, load, np.zeros((n, 3)), np.zeros(n))
    surface = SurfaceMap.learned(cloud)
    curvature_layers(surface, surface_mesh(surface))
    HeightMap.from_cloud(cloud, 5e-4)
    fit_primitive(cloud.thinned(1e-3), PrimitiveKind.SPHERE)


def _hold(objective: Objective) -> None:
    GraspForceOptimizer(_GRASP, objective).solve(-_WRENCH)


def _hold_by_tendon() -> None:
    GraspForceOptimizer(_GRASP, shared_actuators=(np.full((1, 12), 0.01), -1.0, 1.0)).solve(-_WRENCH)


def _hold_with_reserve() -> None:
    RobustLeastEffort(_GRASP, GraspUncertainty(np.full(3, 0.05), np.full(3, 5e-4))).solve(-_WRENCH)
    load, size = ScaledGrasp.of(_GRASP).load(1e3 * _WRENCH)
    least_violation(ScaledGrasp.of(_GRASP).sized(size), load, 0.01)


def main() -> None:
    """Carry out all steps."""
    # ended by Ctrl-C as by a kill, in the middle of LLVM too: the parent process reports it
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    out = os.fdopen(os.dup(1), "w", buffering=1)
    os.dup2(2, 1)
    everything = list(steps())
    for number, (name, use) in enumerate(everything, start=1):
        out.write(json.dumps({"step": name, "number": number, "of": len(everything)}) + "\n")
        use()
    modules = [vars(module) for name, module in sys.modules.items() if name.startswith("palpate.")]
    folders = {folder for names in modules for each in names.values() if (folder := compiling.kept_in(each))}
    out.write(json.dumps({"compiled": compiling.KEPT, "folders": sorted(folders)}) + "\n")


if __name__ == "__main__":
    main()
