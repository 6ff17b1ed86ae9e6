"""Everything built in passes the checks that a stranger's pieces are given."""

import contextlib
import os
import threading
from dataclasses import replace

import casadi
import numpy as np
import pytest
import trimesh

from palpate import SymbolicSurface
from palpate.experiments.kit.registry import experiment_named, experiment_names
from palpate.experiments.kit.script import plan_for
from palpate.hw.emulators.netft import BoxSettings, NetFtServer, OnRobotServer, onrobot_box
from palpate.hw.emulators.process import EmulatorProcess
from palpate.hw.emulators.serial_ft import BotaServer, ResenseServer
from palpate.hw.emulators.ur import SimpleUr
from palpate.hw.ft_stream import StreamSettings
from palpate.hw.netft import NetFt, NetFtSettings, onrobot_settings
from palpate.hw.rig import Rig, RigSettings
from palpate.hw.rig.finger_sensor import FingerSensor
from palpate.hw.serial_ft import Bota, Resense, SerialSensor
from palpate.hw.ur import UrArm, UrSettings, UrToolSensor
from palpate.runtime import Touch
from palpate.runtime.data import Command
from palpate.runtime.real_time import RealTime
from palpate.runtime.replay import ReplayBackend
from palpate.sim import ContactLaw, MujocoBackend, SphereObject, Tip, TurningStage, build_scene
from palpate.surfaces import MeshSurface, Sphere
from palpate.testing import (
    SpringPlane,
    check_arm,
    check_backend,
    check_controller,
    check_hand,
    check_sensor,
    check_surface,
)
from runtime.simulated_backends import BACKENDS
from sensing.test_invariance import QUADRICS, TIPS
from support.emulated_bus import EmulatedBus, connected
from support.ft_host import served, state
from support.ur_library import needs_ur
from support.waiting import WITHIN
from testing.made_up import LOAD, NOISE, IdealArm, IdealHand, LoadedSensor

RADIUS = 0.01
FRAME = {
    "center": (0.002, -0.03, 0.01),
    "rotation": np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]]),
}
QUICK = [name if name in QUADRICS else pytest.param(name, marks=pytest.mark.slow) for name in TIPS]


@pytest.mark.parametrize("placed", [{}, FRAME], ids=["own frame", "placed"])
@pytest.mark.parametrize("name", QUICK)
def test_fingertips(name, placed):
    check_surface(TIPS[name](1.0, 1.0, **placed))


@pytest.mark.slow  # to compile
def test_formulas_and_meshes():
    p, size = casadi.SX.sym("p", 3), RADIUS
    egg = (p[0] ** 2 + p[1] ** 2) / size**2 * casadi.exp(-0.4 * p[2] / size) + p[2] ** 2 / size**2 - 1.0
    check_surface(SymbolicSurface(p, egg, size=size))
    ball = trimesh.creation.icosphere(subdivisions=4, radius=RADIUS)
    check_surface(MeshSurface(ball.vertices, ball.faces, **FRAME), normal_tolerance=0.1)


def turning_stage():
    scene = build_scene(Tip(Sphere(RADIUS)), SphereObject(), ContactLaw(), (0.0, 0.0, 0.3), TurningStage())
    return MujocoBackend(scene)


SIMULATIONS = {kind: lambda make=make: make(1)[0] for kind, make in BACKENDS.items()}


@pytest.mark.slow
@pytest.mark.parametrize(
    "make", [SpringPlane, turning_stage, *SIMULATIONS.values()], ids=["plane", "turning", *SIMULATIONS]
)
def test_simulations(make):
    check_backend(make)


def test_replays():
    with turning_stage() as backend:
        seen = [backend.start(), *(backend.step(Command()) for _ in range(1000))]
    check_backend(lambda: ReplayBackend(seen, 1e-3), motion=None)


@pytest.mark.slow
@pytest.mark.parametrize("name", experiment_names())
def test_controllers_of_experiments(name):
    experiment = experiment_named(name)
    plan = plan_for(experiment, experiment.Config(seed=1)).prepared()
    check_controller(plan.controller, lambda: (plan.backend(), Touch(*plan.fingers)))


STREAM = StreamSettings(NOISE, silent_after=2.0, start_within=WITHIN)


def netft(box):
    ports = {"rdt_port": box.rdt_port, "calibration_port": box.calibration_port}
    return NetFt(box.address, NetFtSettings(STREAM, patience=5.0, **ports))


def onrobot(box):
    settings = onrobot_settings(NOISE, period=0.002, cutoff=150.0, rdt_port=box.rdt_port)
    return NetFt(box.address, replace(settings, stream=STREAM))


def serial(make):
    return lambda line: SerialSensor(line.address, make, STREAM)


SENSORS = {
    "Net F/T": (lambda: NetFtServer(BoxSettings(rdt_port=0, calibration_port=0)), netft),
    "OnRobot": (lambda: OnRobotServer(onrobot_box(rdt_port=0)), onrobot),
    "Bota": (BotaServer, serial(Bota(51))),
    "Resense": (ResenseServer, serial(Resense((12.0, 12.0, 17.0), (0.12, 0.12, 0.12)))),
}


@contextlib.contextmanager
def shaken(server):
    """A load that is noisy."""
    end, chance = threading.Event(), np.random.default_rng(0)

    def shake():
        while not end.wait(1e-3):
            server.take(state(tuple((LOAD + NOISE * chance.normal(size=6)).tolist())))

    thread = threading.Thread(target=shake)
    thread.start()
    try:
        yield
    finally:
        end.set()
        thread.join()


@pytest.mark.slow
@pytest.mark.parametrize(("emulated", "make"), SENSORS.values(), ids=SENSORS)
def test_sensors(emulated, make):
    server = emulated()
    server.take(state(LOAD))
    with served(server), shaken(server):
        check_sensor(lambda: make(server), NOISE, LOAD)


def rig(arm, sensor, **named):
    """A rig of one finger, in real time."""
    fingers = [FingerSensor(sensor, **named)]
    return Rig(RealTime(0.004), RigSettings(0.004, oldest=1.0), arm=arm, fingers=fingers)


@pytest.mark.slow
def test_devices_of_tests_and_a_rig_of_them():
    check_sensor(LoadedSensor, NOISE, LOAD)
    check_arm(IdealArm)
    check_hand(IdealHand, 2)
    check_backend(lambda: rig(IdealArm(), LoadedSensor()))


@needs_ur
@pytest.mark.slow
def test_ur_arms_and_their_rigs():
    address = f"127.{201 + os.getpid() % 50}.{os.getpid() // 50 % 250}.2"
    with EmulatorProcess(SimpleUr(address)):
        arm = UrArm(address, UrSettings(stale_after=2.0, watchdog=1.0))
        check_arm(lambda: arm)
        check_backend(lambda: rig(arm, UrToolSensor(arm), in_arm=True))


@pytest.mark.slow
def test_hands_of_dynamixel_servos():
    with EmulatedBus() as emulated:
        hand = connected(emulated)
        check_hand(lambda: hand, len(emulated.servos))
