"""Robot `stage-pin`, a pin of 80 mm between two fingers: place and force of touches along it, and slips of it.

The robot is `stage-pin`; each seed is another pair of sensors, and other noise. Along the pin: its side is pressed
against a small ball with 1 N, in the direction of the squeeze and across it, at several heights; what is felt in
`WINDOW` is compared with MuJoCo's contact. Slips: while the pin explores a sphere with 1 N and 20 mm/s, it is
knocked, the squeeze fades, or it is pulled slowly through the fingers; the time is from when the pin has moved by
`TOLD` to the stop.
"""

import argparse
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np
from harness.campaign import Listing

from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.explore.plan import plan
from palpate.robots.finger_sensor import model_of_finger
from palpate.robots.idle import LEAST_TOUCH_FORCE
from palpate.robots.in_scene import build
from palpate.robots.robot import ROBOT_TEXT, Robot, load_robot, read_robot
from palpate.robots.task import Task
from palpate.runtime import Command, Supervisor, Touch
from palpate.runtime.supervision.guard import Guard
from palpate.runtime.supervision.tool_slip import ToolGrip, ToolHeld
from palpate.sim import SeededSensor, SphereObject
from palpate.sim.hand.held_tool import GraspedTool
from palpate.sim.presets import EXPLORE
from palpate.spatial import Vector, norm, scale

ROBOT = "stage-pin"

FORCE, SPEED = 1.0, 0.02
"""[N], [m/s]"""

HEIGHTS = (-0.027, -0.022, -0.017)
"""Of the touches along the pin, from the middle of the fingertips [m]; the pads end at -0.01."""

ASIDE: tuple[tuple[str, Vector], ...] = (("along the squeeze", (1.0, 0.0, 0.0)), ("across it", (0.0, 1.0, 0.0)))

BALL = SphereObject(0.005)

PERIODS, WINDOW = 1200, 50
"""Of a touch, and of its end that counts [ms]."""

APPROACH, GAIN = 0.002, 2e-3
"""[m/s], [m/s/N] of the touch."""

TOLD = 1e-3
"""[m]"""

BEGIN, END = 3000, 4500
"""Periods of an exploration: when something happens, and when it is over."""

CROSS_TALK = (0.001, 0.01)
"""Of the full load: calibrated, and as makers state it."""

MISBELIEVED = 1.5
"""Times the true friction that is believed."""


def specimen(seed: int, cross_talk: float = CROSS_TALK[0]) -> Robot:
    """Return the robot with another pair of sensors."""
    robot = load_robot(ROBOT)
    text = robot.texts[ROBOT_TEXT]
    for i in (1, 2):
        before, after = (_sensor(k, share) for k, share in ((i, 0.001), (2 * seed + i, cross_talk)))
        assert before in text
        text = text.replace(before, after)
    return read_robot({**robot.texts, ROBOT_TEXT: text})


def _sensor(number: int, cross_talk: float) -> str:
    return f"specimen: {number}, cross_talk: {cross_talk:g},"


@dataclass(frozen=True, slots=True)
class Felt:
    """A touch: what was felt, less what there was.

    Attributes:
        along: Of the place along the pin [m].
        force: Of the force's length, over it.
    """

    along: float
    force: float


def touches(seed: int, cross_talk: float) -> Iterator[tuple[str, Felt]]:
    """Yield touches along the pin of one pair of sensors, and in which direction they are."""
    robot = specimen(seed, cross_talk)
    for name, towards in ASIDE:
        for height in HEIGHTS:
            yield name, _touch(robot, seed, towards, height)


def _touch(robot: Robot, seed: int, towards: Vector, height: float) -> Felt:
    finger = robot.file.fingers[0]
    gap = BALL.radius + max(finger.surface.half_extents) + 0.5e-3
    task = Task(
        tip=finger.surface,
        compression=0.0,
        target=BALL,
        law=EXPLORE.law,
        start=(-gap * towards[0], -gap * towards[1], -height),
        period=robot.file.period,
        sensor=SeededSensor(model_of_finger(finger), seed),
        touch_force=LEAST_TOUCH_FORCE,
    )
    ready = build(robot, task)
    backend, touch = ready.backend, Touch(*ready.fingers)
    assert isinstance(backend, GraspedTool)
    now = touch.sense(backend.start())
    rows = []
    for i in range(PERIODS):
        speed = min(APPROACH, GAIN * (FORCE - norm(now.fingers[0].force)))
        now = touch.sense(backend.step(Command(scale(speed, towards))))
        if i >= PERIODS - WINDOW:
            felt, truth = now.fingers[0], backend.truth()
            true_along = truth.position[2] - now.arm.position_base_tip[2]
            rows.append((felt.contact.centroid[2], true_along, norm(felt.force), norm(truth.force)))
    along, true_along, force, true_force = np.nanmean(rows, axis=0)
    return Felt(float(along - true_along), float(force / true_force - 1.0))


@dataclass(frozen=True, slots=True)
class Watched:
    """How a watched exploration went.

    Attributes:
        moved: How far the pin moved in the hand until the stop [m].
        late: From when it had moved by `TOLD` to the stop [s], negative if before that; NaN: it was not stopped.
        words: Why it was.
    """

    moved: float
    late: float
    words: str


Happening = Callable[[GraspedTool, int, np.random.Generator], None]


def nothing(backend: GraspedTool, period: int, rng: np.random.Generator) -> None:
    """Leave it alone."""


def knock(least: float, most: float, backend: GraspedTool, period: int, rng: np.random.Generator) -> None:
    """Push along the pin with a force between these [N] for 3 ms; friction holds less than 12.5 N."""
    if period == 0:
        backend.push((0.0, 0.0, float(rng.uniform(least, most) * rng.choice([-1.0, 1.0]))))
    elif period == 3:
        backend.push((0.0, 0.0, 0.0))


def fade(backend: GraspedTool, period: int, rng: np.random.Generator) -> None:
    """Let the squeeze fade to 0.3 N within 0.3 s."""
    if period <= 300:
        backend.squeeze(7.0 - 6.7 * period / 300)


def drag(backend: GraspedTool, period: int, rng: np.random.Generator) -> None:
    """Pull along the pin, with a force that grows by 20 N within a second."""
    backend.push((0.0, 0.0, 0.02 * period))


def watched(seed: int, happens: Happening, belief: float) -> Watched:
    """Return how the stop of an exploration goes in which something happens."""
    robot, rng = specimen(seed), np.random.default_rng(seed)
    planned = plan(
        ExploreConfig(robot=ROBOT, object="sphere", force=FORCE, speed=SPEED, width=0.02, depth=0.008, seed=seed),
        robot,
        {},
    )
    grip = ToolGrip(belief * 0.8, 0.6, 7.0, 0.25, 1e-4, ((0.0, 1.0, 0.0), (0.0, 0.0, 1.0)))
    backend, touch, controller = planned.backend(), Touch(*planned.fingers), planned.controller()
    assert isinstance(backend, GraspedTool)
    supervisor = Supervisor(planned.limits, (Guard(ToolHeld(grip, planned.period)),))
    supervisor.start(planned.period)
    touch.start()
    now = touch.sense(backend.start())
    controller.start(now)
    moved, slipped = 0.0, None
    begun = BEGIN + int(rng.integers(500))
    for i in range(END + 500):
        if i >= begun:
            happens(backend, i - begun, rng)
        if not supervisor.admits(now):
            break
        now = touch.sense(backend.step(supervisor.check(now, controller.step(now))))
        moved = norm(backend.pose_tip_tool().position)
        if slipped is None and moved > TOLD:
            slipped = now.time
    trip = supervisor.trip
    if trip is None:
        return Watched(moved, float("nan"), "")
    return Watched(moved, 0.0 if slipped is None else trip.time - slipped, trip.measure)


CASES: tuple[tuple[str, Happening], ...] = (
    ("nothing", nothing),
    ("knock", partial(knock, 12.5, 14.0)),
    ("hard knock", partial(knock, 20.0, 40.0)),
    ("fading squeeze", fade),
    ("dragged", drag),
)


def pin_touches(options: argparse.Namespace) -> Iterator[Listing]:
    """Compare touches along the pin with MuJoCo's contacts."""
    rows = []
    for share in CROSS_TALK:
        found: dict[str, list[Felt]] = {}
        for seed in range(options.seeds or 20):
            for name, felt in touches(seed, share):
                found.setdefault(name, []).append(felt)
        for name, each in found.items():
            along, force = 1e3 * np.array([f.along for f in each]), 1e2 * np.array([f.force for f in each])
            rows.append((name, f"{share:g}", _sizes(along), _sizes(force)))
    heads = ("touch of 1 N", "cross-talk", "along the pin, RMS / largest [mm]", "force, RMS / largest [%]")
    yield Listing("touches along the pin", heads, rows)


def pin_runs(options: argparse.Namespace) -> Iterator[Listing]:
    """Disturb explorations, and see which are stopped."""
    rows, seeds = [], options.seeds or 20
    for name, happens in CASES:
        for belief in (1.0, MISBELIEVED):
            runs = [watched(seed, happens, belief) for seed in range(seeds)]
            stopped = [run for run in runs if run.words]
            moved = 1e3 * np.array([run.moved for run in stopped or runs])
            late = max((run.late for run in stopped), default=float("nan"))
            words = sorted({run.words for run in stopped})
            rows.append(
                (
                    name,
                    f"{belief:g} times",
                    f"{len(stopped)} of {seeds}",
                    f"{np.median(moved):.2g} / {moved.max():.2g}",
                    f"{late:.3g}",
                    ", ".join(f"{sum(run.words == each for run in runs)} {each}" for each in words),
                )
            )
    heads = ("disturbance", "friction estimate", "stopped", "moved, median / most [mm]", "late [s]", "by")
    yield Listing("disturbed explorations", heads, rows)


def _sizes(errors: np.ndarray) -> str:
    return f"{np.sqrt(np.mean(errors**2)):.2g} / {np.abs(errors).max():.2g}"


PARTS = {"pin-touches": pin_touches, "pin-runs": pin_runs}
