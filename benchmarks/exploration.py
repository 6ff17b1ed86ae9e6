"""What an exploration in simulation achieves and costs.

    python benchmarks/exploration.py [--quick]

Accuracy against the simulation's truth on the stage (1 kHz, 2 N, mu 0.3, 20 kN/m), the radius of a sphere with
sensor noise, and what the parts of a period cost. The sensed contact against the true one at 100 kN/m, with spin,
is checked in tests/sim/test_friction_plant.py.
"""

import argparse
import time
from dataclasses import replace

import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table

from palpate.controllers import ExploreController, Raster
from palpate.controllers.paths import Follow
from palpate.experiments.explore import explore
from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.explore.exploration import Exploration
from palpate.experiments.explore.plan import plan
from palpate.robots.values import load_named_robot
from palpate.runtime import Command, Finger, MemoryLog, Recorder, Supervisor, Touch
from palpate.sensing.compensation import SensorPayload
from palpate.sim import ContactLaw, MujocoBackend, SphereObject, Tip, build_scene
from palpate.surfaces import Sphere

BASE = ExploreConfig(spacing=0.004)


def accuracy_row(config: ExploreConfig, found: Exploration) -> list[str]:
    """Return a table's row for one run."""
    touched = found.truth.touching[found.scanning].mean()
    radius = "-"
    if found.sphere is not None and config.object == "sphere":
        radius = f"{1e3 * (found.sphere.radius - config.size[0]):+.3f}"
    noise = "none" if not any(config.noise) else f"{1e3 * config.noise[0]:g} mN, {1e3 * config.noise[1]:g} mNm"
    outside = ~found.scanning
    peak = np.nanmax(found.true_normal_force[outside])
    return [
        f"{config.object}, {1e3 * config.speed:g} mm/s",
        noise,
        found.run.ending.value,
        f"{100 * touched:.2f} %",
        f"{found.force_rms:.4f}",
        f"{peak:.2f}",
        f"{1e3 * found.point_rms:.4f}",
        radius,
        f"{found.run.real_time_factor:.0f}",
    ]


def accuracy(quick: bool) -> Table:
    """Explore several objects."""
    table = Table(title="Exploration, 2 N, 1 kHz, mu 0.3, 20 kN/m, 40 x 40 mm")
    for heading in (
        "object, speed",
        "noise",
        "ending",
        "in contact",
        "force RMS error N",
        "landing peak N",
        "points RMS mm",
        "radius error mm",
        "real-time factor",
    ):
        table.add_column(heading, justify="right")
    noisy = replace(BASE, force_noise=0.010, moment_noise=0.1e-3)
    configs = [
        BASE,
        replace(BASE, speed=0.05),
        replace(BASE, object="ellipsoid", size=()),
        replace(BASE, object="ellipsoid", size=(), speed=0.05),
        noisy,
    ]
    if not quick:
        configs += [
            replace(noisy, seed=1),
            replace(noisy, seed=2),
            replace(BASE, object="cylinder", size=()),
            replace(BASE, object="box", size=()),
            replace(BASE, tip=(0.010, 0.008, 0.012)),
        ]
    for config in track(configs, "exploring", transient=True):
        table.add_row(*accuracy_row(config, explore(config)))
    return table


def parts() -> Table:
    """Time the parts of a period with the tip resting on a sphere."""
    tip = Tip(Sphere(0.008))
    scene = build_scene(tip, SphereObject(0.04), ContactLaw(), (0.0, 0.0, 0.0479))
    backend = MujocoBackend(scene)
    sample = backend.start()
    touch, supervisor = Touch(Finger(tip.surface, SensorPayload(tip.mass))), Supervisor()
    recorder = Recorder(MemoryLog())
    observation, command = touch.sense(sample), Command()
    parameters = plan(BASE, load_named_robot(BASE.robot), {}).parameters
    controller = ExploreController(parameters, Follow(Raster(0.04, 0.04, 0.004)), backend.period)
    controller.start(observation)
    recorder.start(sample, observation, backend.period)
    table = Table(title="One period of the stage, tip in contact, called in a loop")
    table.add_column("part")
    table.add_column("us (median of 20 x 500)", justify="right")
    for name, action in {
        "simulate two steps and read": lambda: backend.step(command),
        "sense": lambda: touch.sense(sample),
        "control": lambda: controller.step(observation),
        "supervise": lambda: supervisor.check(observation, command),
        "record": lambda: recorder.record(sample, observation, command, 0.0, 0.0),
    }.items():
        taken = []
        for _ in range(20):
            started = time.perf_counter()
            for _ in range(500):
                action()
            taken.append((time.perf_counter() - started) / 500)
        table.add_row(name, f"{1e6 * float(np.median(taken)):.1f}")
    return table


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="only what the README quotes")
    arguments = parser.parse_args()
    console = Console(width=130)
    console.print(accuracy(arguments.quick))
    console.print(parts())


if __name__ == "__main__":
    main()
