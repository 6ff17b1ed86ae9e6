"""Simulations repeat bit for bit: from a snapshot, after a restart, beside one another, in another process."""

import hashlib
import math
from itertools import zip_longest
from pathlib import Path

import pytest

from palpate.errors import InvalidValueError
from palpate.runtime.batch import quiet, results_of, run_batch
from palpate.runtime.data import Command
from palpate.sim import (
    ArmCarrier,
    Box,
    ContactLaw,
    Fixed,
    Mount,
    MujocoBackend,
    ObjectBody,
    SceneFile,
    SceneTarget,
    SphereObject,
    Stage,
    Table,
    Tip,
    TurningStage,
    build_scene,
    white_noise,
)
from palpate.sim.friction.law import FrictionLaw
from palpate.sim.friction.texture import Grating
from palpate.sim.hand.backend import HandBackend
from palpate.sim.hand.hand import two_finger_hand
from palpate.sim.hand.hand_file import HANDS, HandFile
from palpate.sim.hand.load import RampLoad, ShakenLoad, SumOfLoads
from palpate.sim.hand.scene import HeldObject, build_grasp_scene
from palpate.sim.hand.turning_hand import turning_hand
from palpate.sim.objects.motion import DrivenJoint, JointKind, MovingTarget, Sine
from palpate.spatial import ZERO
from palpate.surfaces import Sphere
from runtime.simulated_backends import (
    BACKENDS,
    CLOSED,
    NOISELESS,
    NOISY,
    RUBBER,
    SOFT,
    Run,
    digest,
    in_hand,
    on_stage,
    steps,
)

SEEDS = (3, 4)
PERIODS = {kind: 1200 if "hand" in kind else 500 for kind in BACKENDS}
"""A hand closes for 0.9 s."""
RUNS = [Run(kind, seed, PERIODS[kind]) for kind in BACKENDS for seed in SEEDS]
TIP = Tip(Sphere(0.008))
LEVER = Path(__file__).parents[2] / "examples" / "scenes" / "handle.xml"
LOAD = SumOfLoads(
    (
        RampLoad(ZERO, (0.0, 0.3, -1.0), 1.0, 0.2, point=(0.0, 0.004, 0.01)),
        ShakenLoad((0.0, 0.3, 0.0), 7.0, begin=1.0, point=(0.0, 0.0, 0.02)),
    )
)


def wander(k):
    """Press, move about and turn."""
    velocity = (0.02 * math.sin(0.03 * k), 0.01, -0.005)
    return Command(velocity, angular_velocity_base_tip=(0.3 * math.sin(0.02 * k), -0.2, 0.4))


def carry(k, plane=True, turns=True):
    """Close a hand; then move and turn it as its carrier can."""
    late = k > 1100
    velocity = (0.01 * plane, -0.02 * plane, 0.01 * math.sin(0.01 * k)) if late else ZERO
    rate = (0.2, 0.1, 0.3) if late and turns else ZERO
    return Command(velocity, grip_force=(3.0, 3.0), angular_velocity_base_tip=rate)


def squeeze(k):
    return Command(grip_force=(3.0 + 0.5 * math.sin(0.02 * k),) * 2)


def walk(k):
    """Grip with three fingers and move them sideways."""
    speed = 0.005 * math.sin(0.01 * k)
    moving = ((0.0, speed, 0.0), (0.0, -speed, 0.0), (0.0, 0.5 * speed, 0.0)) if k % 500 < 400 else None
    return Command(grip_force=(2.0,) * 3, finger_velocity=moving)


def pinch(k):
    return Command(
        grip_force=(0.0, 4.0, 4.0), finger_velocity=((0.005 * math.sin(0.01 * k), 0.0, 0.002), None, None)
    )


def held_on(carrier, **command):
    scene = build_grasp_scene(
        two_finger_hand(), HeldObject(Box((0.06, 0.05, 0.06))), carrier=carrier, table=Table(-0.03)
    )
    return HandBackend(scene, sensor=NOISY), lambda k: carry(k, **command)


def loaded(friction):
    backend, command = in_hand(None, two_finger_hand(), Box((0.06, 0.05, 0.06)), friction=friction)
    return HandBackend(backend.scene, load=LOAD), command


def file_hand():
    hand = HandFile(HANDS / "pinch-and-index.xml", ("index_sensor", "left_sensor", "right_sensor")).read([TIP] * 3)
    ball = HeldObject(SphereObject(0.025), mass=0.2)
    return HandBackend(build_grasp_scene(hand, ball, table=Table(-0.0251), palm=(0.0, 0.0, 0.08))), pinch


def over(target, start, law=None, **more):
    scene = build_scene(TIP, target, law or ContactLaw(), start, **more)
    return MujocoBackend(scene), lambda k: Command((0.02, 0.001, -0.001))


def tilting(friction):
    joint = DrivenJoint(JointKind.HINGE, (0.0, 0.3, 1.0), Sine(0.1, 2.0, 0.5))
    return over(MovingTarget(Box((0.2, 0.2, 0.02)), [joint]), (0.03, 0.0, 0.0179), friction=friction)


def pushed(friction):
    block = ObjectBody(Box((0.06, 0.06, 0.04)), 0.5, 0.1, mount=Mount.FREE, position=(0.0, 0.0, 0.02))
    return over(
        block, (-0.0385, 0.0, 0.015), ContactLaw(stiffness=5e3), friction=friction, table=Table(friction=0.3)
    )


def lever():
    target = SceneTarget.of(SceneFile.read(LEVER), "lever")
    start = (0.0, 0.0, target.shape.top + 0.009)
    backend, _ = over(target, start, ContactLaw(4e3))
    return backend, lambda k: Command((0.0, 0.0, -0.01))


SCENES = {
    **{
        kind: (lambda make=make: make(5), CLOSED + 120 if "hand" in kind else 220)
        for kind, make in BACKENDS.items()
    },
    "turning stage": (lambda: (on_stage(NOISY, carrier=TurningStage())[0], wander), 1100),
    "turning stage, plant": (lambda: (on_stage(NOISY, carrier=TurningStage(), friction=RUBBER)[0], wander), 1100),
    "UR5e that turns": (lambda: (on_stage(NOISY, carrier=ArmCarrier())[0], wander), 1100),
    "hand, fixed": (lambda: (held_on(Fixed())[0], squeeze), 1200),
    "hand on a stage": (lambda: held_on(Stage(), turns=False), 1200),
    "hand on a turning stage": (lambda: held_on(TurningStage()), 1200),
    "hand on an arm": (lambda: held_on(ArmCarrier()), 1200),
    "hand, grating": (
        lambda: in_hand(
            NOISY,
            two_finger_hand(),
            Box((0.06, 0.05, 0.06)),
            friction=SOFT,
            texture=Grating(0.01, 0.2, (0.0, 0.0, 1.0)),
        ),
        1200,
    ),
    "hand under load": (lambda: loaded(None), 1250),
    "hand under load, plant": (lambda: loaded(SOFT), 1250),
    "fingers that move sideways": (
        lambda: (in_hand(white_noise(0.01, 1e-4), turning_hand(), SphereObject(0.03))[0], walk),
        1601,
    ),
    "hand from a file": (file_hand, 700),
    "moving target": (lambda: tilting(None), 150),
    "moving target, plant": (lambda: tilting(FrictionLaw()), 150),
    "free block": (lambda: pushed(None), 150),
    "free block, plant": (lambda: pushed(FrictionLaw()), 150),
    "lever from a file": (lever, 300),
}
"""Back end with its commands; periods after which it is in mid-motion."""


@pytest.mark.slow
@pytest.mark.parametrize("kind", SCENES)
def test_a_run_continues_from_a_snapshot_bit_for_bit(kind):
    """Here, in a back end that was never started and in one that is elsewhere; a restart repeats all of it."""
    make, at = SCENES[kind]
    backend, command = make()

    def go(this, first, count):
        return [
            (this.step(command(k)), this.truth(), getattr(this, "pull", None)) for k in range(first, first + count)
        ]

    backend.start()
    whole = go(backend, 0, 1)
    early = backend.snapshot()
    whole += go(backend, 1, at - 1)
    state, truth, pull = backend.snapshot(), backend.truth(), getattr(backend, "pull", None)
    after = go(backend, at, 100)
    backend.restore(state)
    assert (backend.truth(), getattr(backend, "pull", None)) == (truth, pull)
    assert go(backend, at, 100) == after
    fresh = make()[0]
    fresh.restore(state)
    assert fresh.truth() == truth
    assert go(fresh, at, 100) == after
    fresh.restore(early)
    assert go(fresh, 1, 50) == (whole + after)[1:51]
    backend.start()
    assert go(backend, 0, at) == whole
    assert any(any(map(abs, wrench.wrench)) for wrench in after[-1][0].wrenches)


HAS_PLANT = "MuJoCo's own friction, this one has a friction plant"
HAS_NONE = "a friction plant, this one has none"


@pytest.mark.parametrize(
    ("kind", "other", "message"),
    [
        ("stage", "UR5e, noise", "take one of this scene"),
        ("hand, noise", "hand of three, Nano17", "same scene"),
        ("turning stage", "turning stage, plant", HAS_PLANT),
        ("turning stage, plant", "turning stage", HAS_NONE),
        ("hand under load", "hand under load, plant", HAS_PLANT),
        ("hand under load, plant", "hand under load", HAS_NONE),
    ],
)
def test_a_snapshot_of_another_scene_or_with_other_friction_is_refused(kind, other, message):
    """Simulations with other friction are of one size: bristles would stay as another run stretched them."""
    backend = SCENES[kind][0]()[0]
    backend.start()
    with pytest.raises(InvalidValueError, match=message):
        SCENES[other][0]()[0].restore(backend.snapshot())


@pytest.fixture(scope="module")
def alone():
    """Digest of each run by itself, in this process."""
    return {run: digest(run) for run in RUNS}


@pytest.mark.slow
def test_the_runs_compared_here_touch_something_and_depend_on_the_seed(alone):
    assert all(touched for _, touched in alone.values())
    for kind in BACKENDS:
        one, other = (alone[Run(kind, seed, PERIODS[kind])] for seed in SEEDS)
        assert (one == other) is (kind == NOISELESS)


@pytest.mark.slow
def test_each_back_end_gives_the_same_run_bit_for_bit_in_another_process(alone):
    """New interpreters, not forks: nothing is shared but the code and the seed."""
    assert results_of(run_batch(digest, RUNS, 2, quiet)) == list(alone.values())


def interleaved(runs):
    """Periods of several runs that are stepped in turns."""
    logs = [[] for _ in runs]
    for periods in zip_longest(*map(steps, runs)):
        for shown, period in zip(logs, periods, strict=True):
            if period is not None:
                shown.append(repr(period))
    return logs


@pytest.mark.slow
def test_all_back_ends_at_once_do_not_disturb_one_another(alone):
    logs = ["\n".join(periods) for periods in interleaved(RUNS)]
    assert [hashlib.sha256(text.encode()).hexdigest() for text in logs] == [shown for shown, _ in alone.values()]
