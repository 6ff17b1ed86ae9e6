"""Uses everything once that palpate compiles and keeps, as a process of its own, which can be killed at any time.

The process writes a line of JSON at the start of every step, and one at its end. Experiments are carried out in
small: they use what any experiment uses.
"""

import json
import os
import signal
import sys
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from palpate import compiling, surfaces
from palpate.controllers.grip.wrench_ahead import WrenchAhead
from palpate.experiments.kit.registry import experiment_named, experiment_names
from palpate.experiments.kit.script import perform
from palpate.friction.slip.load_fall import LoadFall
from palpate.grasp import GraspContacts, GraspForceOptimizer, GraspUncertainty, Objective, RobustLeastEffort
from palpate.grasp.problem.scaled import ScaledGrasp
from palpate.grasp.solvers.least_effort import least_violation
from palpate.mapping.compare_surface import TriangleSurface
from palpate.runtime import ArmSample, Command
from palpate.runtime.servo_following import PositionServo
from palpate.sensing import contact_from_wrench
from palpate.sim import (
    ContactLaw,
    MujocoBackend,
    SceneObject,
    SphereObject,
    Tip,
    TracedMesh,
    Triangles,
    build_scene,
    bumps,
)
from palpate.sim.friction.law import FrictionLaw
from palpate.spatial import IDENTITY, ZERO

_PERIOD = 1e-3
"""Control period [s]."""

_WRENCH = np.array((0.3, 0.1, -2.0, 0.004, 0.008, 0.001))
_CORNERS = 0.01 * np.vstack([np.eye(3), -np.eye(3)])
_FACETS = np.array([(0, 1, 2), (1, 3, 2), (3, 4, 2), (4, 0, 2), (1, 0, 5), (3, 1, 5), (4, 3, 5), (0, 4, 5)])
"""Corners [m] and triangles of an octahedron."""

_ANGLE = 2.0 * np.pi * np.arange(3) / 3
_OUT = np.column_stack([np.cos(_ANGLE), np.sin(_ANGLE), np.zeros(3)])
_UP = np.tile((0.0, 0.0, 1.0), (3, 1))
_AXES = np.stack([-_OUT, _UP, np.cross(-_OUT, _UP)], axis=2)
_GRASP = GraspContacts(0.03 * _OUT, _AXES, 0.6, 0.005, 0.0, 20.0)
"""Three fingers around a ball of 30 mm."""


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
    for name in experiment_names():
        for options in getattr(experiment_named(name), "warm_up", ()):
            words = ", ".join(f"{key}={value}" for key, value in options.items())
            yield f"{name} with {words}", partial(_carry_out, name, options)
    yield "comparison of meshes", partial(TriangleSurface(_CORNERS, _FACETS).nearest, _CORNERS)
    for objective in Objective:
        yield f"grasp forces, {objective.value.replace('_', ' ')}", partial(_hold, objective)
    yield "grasp forces with a reserve", _hold_with_reserve
    yield "grasp forces with shared actuators", _hold_by_tendon
    for name, surface in tips[1:]:
        yield f"contact on {name}", partial(contact_from_wrench, surface, _WRENCH)
    yield "simulation of a height field", partial(_touch, bumps())
    yield "simulation of a mesh", partial(_touch, TracedMesh(Triangles(4.0 * _CORNERS, _FACETS)))
    yield "simulation of friction", partial(_touch, SphereObject(0.04), FrictionLaw())
    yield "predictions of loads and arms", _predict


def _carry_out(name: str, options: Mapping[str, object]) -> None:
    experiment = experiment_named(name)
    with TemporaryDirectory() as folder:
        perform(experiment, experiment.Config(**options), Path(folder))


def _touch(target: SceneObject, friction: FrictionLaw | None = None) -> None:
    """Simulate an object and use every function of its shape."""
    start = (0.0, 0.0, target.top + 0.02)
    scene = build_scene(Tip(surfaces.Sphere(0.008)), target, ContactLaw(), start, friction=friction)
    with MujocoBackend(scene) as backend:
        backend.start()
        backend.step(Command())
    points = _CORNERS.copy()
    target.signed_distance(points)
    points.setflags(write=False)
    target.signed_distance(points)
    target.height(points[:, 0], points[:, 1])
    target.height(*np.meshgrid(points[:, 0], points[:, 1]))
    target.reachable(0.0, 0.0, 0.008)


def _predict() -> None:
    LoadFall(_PERIOD)
    WrenchAhead(0.01, _PERIOD)
    PositionServo(1e4, 0.02, 0.02).following(20.0)(_PERIOD, ArmSample(0.0, ZERO, IDENTITY, ZERO))


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
    out.write(json.dumps({"compiled": compiling.KEPT_KERNELS, "folders": sorted(folders)}) + "\n")


if __name__ == "__main__":
    main()
