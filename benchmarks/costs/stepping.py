"""Cost of a simulated period: ways to step it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np
from harness.study import Effort, Study
from harness.tables import grid, quantity
from harness.timing import Timed, rounds

from palpate.experiments.explore.worlds import ExploredWorlds
from palpate.learning import GuardedRobot, TouchEnv, World
from palpate.learning.guarded_robot import approach
from palpate.runtime import Command, Observation, Sample, Supervisor, Touch, run
from palpate.runtime.wrapped_backend import WrappedBackend

SLIDE = (0.0, 0.002, 0.0)
"""[m/s] Slowly sideways, in touch."""

ACTION = 20
"""Periods of one action of `TouchEnv`."""


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


def learning(effort: Effort) -> Study:
    """Measure each way, and its ratio to the first one."""
    found, title = rounds(stepping_ways(effort), effort.of(5, 2)), "Ways to step the same contact"
    rows = []
    for name, each in found.items():
        ratio = each.ratio
        interval = f"{ratio.low:.3g} to {ratio.high:.3g}"
        rows.append((name, quantity(each.median, "s"), f"{ratio.median:.3g}", interval))
    heads = ("", "per period or reset", "to the back end alone", "95 % interval")
    return Study(title, tables=(grid(title, *heads, rows=rows),))


COSTS = {"learning": learning}
