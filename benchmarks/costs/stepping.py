"""Cost of a simulated period: its parts, and the ways to step it."""

import os
import subprocess
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np
from harness.study import Effort
from harness.timing import Timed

from costs.cost import timed_cost
from palpate.controllers import ExploreController, Raster
from palpate.controllers.paths import Follow
from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.explore.plan import plan
from palpate.experiments.explore.worlds import ExploredWorlds
from palpate.learning import GuardedRobot, TouchEnv, World
from palpate.learning.guarded_robot import approach
from palpate.robots.values import load_named_robot
from palpate.runtime import Command, Finger, MemoryLog, Observation, Recorder, Sample, Supervisor, Touch, run
from palpate.runtime.wrapped_backend import WrappedBackend
from palpate.sensing.compensation import SensorPayload
from palpate.sim import ContactLaw, MujocoBackend, SphereObject, Tip, build_scene
from palpate.surfaces import Sphere

SLIDE = (0.0, 0.002, 0.0)
"""[m/s] Slowly sideways, in touch."""

ACTION = 20
"""Periods of one action of `TouchEnv`."""


def period_parts(_: Effort) -> Mapping[str, Timed]:
    """Return the parts of a period with the tip resting on a sphere."""
    tip = Tip(Sphere(0.008))
    backend = MujocoBackend(build_scene(tip, SphereObject(0.04), ContactLaw(), (0.0, 0.0, 0.0479)))
    sample, config = backend.start(), ExploreConfig(spacing=0.004)
    touch, supervisor = Touch(Finger(tip.surface, SensorPayload(tip.mass))), Supervisor()
    recorder, observation, command = Recorder(MemoryLog()), touch.sense(sample), Command()
    parameters = plan(config, load_named_robot(config.robot), {}).parameters
    controller = ExploreController(parameters, Follow(Raster(0.04, 0.04, 0.004)), backend.period)
    controller.start(observation)
    recorder.start(sample, observation, backend.period)
    return {
        "simulate two steps and read": Timed(lambda: backend.step(command)),
        "sense": Timed(lambda: touch.sense(sample)),
        "control": Timed(lambda: controller.step(observation)),
        "supervise": Timed(lambda: supervisor.check(observation, command)),
        "record": Timed(lambda: recorder.record(sample, observation, command, 0.0, 0.0)),
    }


class Slide:
    """A controller that only slides."""

    def start(self, first: Observation) -> None:
        pass

    def step(self, now: Observation) -> Command:
        return Command(SLIDE)


class Resumed(WrappedBackend):
    """A back end that is running already: `start` continues from its state."""

    def start(self) -> Sample:
        return self.step(Command())


@dataclass
class Landed:
    """A world in which the tip touches the object; `land` builds it anew, on a stage with a Nano17 over a
    sphere."""

    world: World
    robot: GuardedRobot
    touch: Touch

    def land(self) -> None:
        self.world = ExploredWorlds()(np.random.default_rng(0))
        self.touch = Touch(self.world.finger)
        self.robot = GuardedRobot(self.world.backend, Touch(self.world.finger), Supervisor(self.world.limits))
        self.robot.start()
        assert approach(self.robot, self.world.approach, self.world.farthest)


def stepping_ways(effort: Effort) -> Mapping[str, Timed]:
    """Return five ways through the same contact, 1 kHz."""
    periods = ACTION * effort.of(100, 25)
    at, command = Landed.__new__(Landed), Command(SLIDE)
    env, action = TouchEnv(duration=0.02 * (periods // ACTION + 1)), np.array(SLIDE, np.float32)

    def in_loop() -> None:
        backend, supervisor = Resumed(at.world.backend), Supervisor(at.world.limits)
        run(backend, Touch(at.world.finger), Slide(), supervisor, duration=periods * backend.period)

    def repeated(step: Callable[[], object], count: int = periods) -> Callable[[], None]:
        def steps() -> None:
            for _ in range(count):
                step()

        return steps

    ways: dict[str, Callable[[], object]] = {
        "back end alone": repeated(lambda: at.world.backend.step(command)),
        "with sensing": repeated(lambda: at.touch.sense(at.world.backend.step(command))),
        "GuardedRobot": repeated(lambda: at.robot.step(SLIDE)),
        "run, the loop": in_loop,
    }
    acting = repeated(lambda: env.step(action), periods // ACTION)
    return {
        **{name: Timed(way, periods, before=at.land) for name, way in ways.items()},
        "TouchEnv": Timed(acting, periods, before=partial(env.reset, seed=0)),
        "a reset": Timed(env.reset),
    }


STARTS = {
    "import numpy": ("-c", "import numpy"),
    "import palpate": ("-c", "import palpate"),
    "palpate --help": ("-m", "palpate", "--help"),
    "palpate explore --help": ("-m", "palpate", "explore", "--help"),
    "palpate completion bash": ("-m", "palpate", "completion", "bash"),
}


def starts(_: Effort) -> Mapping[str, Timed]:
    """Return processes that start, do next to nothing, and end."""
    start = partial(subprocess.run, check=True, capture_output=True, env=os.environ)
    return {name: Timed(partial(start, [sys.executable, *words])) for name, words in STARTS.items()}


COSTS = {
    "simulated": timed_cost("Parts of a simulated period, tip in contact", period_parts, (20, 5)),
    "learning": timed_cost("Ways to step the same contact", stepping_ways, (5, 2), item="period or reset"),
    "start": timed_cost("Start", starts, (15, 3), {"palpate --help": 5.0, "import palpate": 4.0}, "process"),
}
