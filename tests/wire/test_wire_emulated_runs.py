"""Whole experiments over real sockets, terminals and client libraries, the MuJoCo scenes behind them.

Time is scaled, for these share two cores with everything else. Every server listens on the loopback net.
"""

import os
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import psutil
import pytest

from palpate.commands.replay.run import replay_log
from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.explore.experiment import Explore
from palpate.experiments.kit.recorded_run import RecordedRun, carry_out
from palpate.experiments.kit.recording import log_writer
from palpate.hw.devices import DeviceError
from palpate.robots.emulated.backend import EmulatedBackend
from palpate.robots.emulated.hand import OLDEST, HandWires, emulated_hand
from palpate.robots.emulated.ur5e import simulated_twin
from palpate.robots.robot import load_robot
from palpate.runtime import Ending
from palpate.runtime.data import Command
from support.emulated_file import unhurried_file
from support.free_ports import PORTS, free
from support.grasp_runs import found_after, plan_of
from support.ur_library import needs_ur
from support.waiting import WITHIN, first_error, until

pytestmark = needs_ur

SCALE = 0.25
"""Of time: a busy machine's stalls of 100 ms are then 25 ms of the robot's."""

HAND_SCALE = 0.125
"""Time scale of the hand: a grip that follows a ramp falls short of the least grip after 25 ms of no command."""

STALL, RECOVERY = 0.005, 0.1
"""Gap between samples that counts as a stall of this computer, and the time in which the grip recovers, both
in the hand's time [s]."""

EXPLORE = Explore()

SUPPORT = Path(__file__).parent.parent / "support"


def robot(address, scale=SCALE):
    given = load_robot("emulated-ur5e")
    entry = msgspec.structs.replace(given.file.backend, address=address, time_scale=scale)
    return replace(given, file=msgspec.structs.replace(given.file, backend=entry))


def children():
    """Return this process's children, but for the one of Python itself that outlives them."""
    return [its for its in psutil.Process().children() if "resource_tracker" not in " ".join(its.cmdline())]


def gone(pids):
    """Return whether processes have ended."""
    return not any(psutil.pid_exists(pid) and psutil.Process(pid).status() != "zombie" for pid in pids)


def after_stalls(time):
    """Return in which periods the grip still suffers from a stall of this computer, shape (n,)."""
    ends = time[1:][np.diff(time) > STALL]
    return ((time[:, None] >= ends) & (time[:, None] < ends + RECOVERY)).any(axis=1)


@pytest.mark.slow
def test_an_exploration_over_the_wire_is_the_one_of_the_simulation(tmp_path):
    config = ExploreConfig(robot="emulated-ur5e", width=0.01, depth=0.004)
    wired = robot("127.0.9.42")
    found = {}
    for name, its in (("wire", wired), ("direct", simulated_twin(wired))):
        planned = EXPLORE.plan(config, its, {})
        sinks = (log_writer(EXPLORE, planned, tmp_path),) if name == "wire" else ()
        found[name] = EXPLORE.evaluate(planned, carry_out(planned, sinks=sinks))
        assert found[name].run.ending is Ending.DONE
        assert found[name].run.at_rest
    one, other = found["wire"], found["direct"]
    assert one.force_rms <= 2.0 * other.force_rms
    assert one.point_rms <= 2.0 * other.point_rms
    names = [[metric.name for metric in EXPLORE.report(its).metrics] for its in (one, other)]
    assert names[0] == names[1]
    assert len(one.cloud) == pytest.approx(len(other.cloud), rel=0.1)
    assert replay_log(tmp_path).identical
    # the truth belongs to its sample: what is felt differs from it by the sensor's noise, and no more
    touching = one.scanning & one.truth.touching
    felt = one.record.normal_force[touching] - one.true_normal_force[touching]
    assert float(np.nanstd(felt)) < 0.02
    assert free("127.0.9.42", *PORTS)


@pytest.mark.slow
def test_a_lost_connection_ends_the_run_as_a_device_that_was_lost():
    config = ExploreConfig(robot="emulated-ur5e", width=0.01, depth=0.004)
    planned = EXPLORE.plan(config, robot("127.0.9.43"), {})
    backend = planned.backend()
    assert isinstance(backend, EmulatedBackend)
    calls = []

    def spoil(sample, now, command):
        calls.append(now.time)
        if len(calls) == 200:
            backend.emulator.control.fault("ur", "drop_rst")

    result = RecordedRun(planned, backend).run((spoil,))
    assert result.ending is Ending.TRIPPED
    assert isinstance(result.error, DeviceError)
    assert "UR arm at 127.0.9.43" in str(result.error)
    assert len(calls) >= 200
    assert not children()
    assert free("127.0.9.43", *PORTS)


@pytest.mark.slow
def test_a_killed_emulator_is_reported_and_a_new_start_works():
    config = ExploreConfig(robot="emulated-ur5e", width=0.01, depth=0.004)
    with EXPLORE.plan(config, robot("127.0.9.44"), {}).backend() as backend:
        assert isinstance(backend, EmulatedBackend)
        backend.start()
        backend.pacer.start()
        backend.step(Command())
        backend.emulator.kill()
        first_error(lambda: backend.step(Command()))
        backend.start()
        backend.pacer.start()
        for _ in range(10):
            backend.step(Command())
        assert backend.truth().pose_base_object.rotation[0][0] == 1.0
    assert not children()


@pytest.mark.slow
@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_however_it_ends_nothing_is_left_behind(how, tmp_path):
    address = f"127.0.9.{50 + int(how)}"
    path = unhurried_file(tmp_path, address, SCALE)
    with subprocess.Popen(
        [sys.executable, str(SUPPORT / "emulated_run.py"), path],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    ) as started:
        try:
            started_by_it = [int(pid) for pid in started.stdout.readline().split()]
            assert len(started_by_it) >= 2, "emulators, and the client of the arm"
            assert not free(address, *PORTS)
            os.kill(started.pid, how)
            started.wait(WITHIN)
        finally:
            started.kill()
    until(lambda: gone(started_by_it))
    assert free(address, *PORTS)


@pytest.mark.slow
@pytest.mark.parametrize("plant", [False, True], ids=["MuJoCo", "friction plant"])
def test_an_object_is_held_by_servos_on_the_wire_and_neither_slips_nor_spins(plant, tmp_path):
    planned = plan_of(plant=plant)
    planned = replace(planned, limits=msgspec.structs.replace(planned.limits, sample_age=OLDEST))
    wires = HandWires("127.0.9.45", ("127.0.9.46", "127.0.9.47"), tmp_path / "bus", HAND_SCALE)
    grasp = found_after(planned, RecordedRun(planned, emulated_hand(planned.task(), wires)))
    assert grasp.run.ending is Ending.DONE, str(grasp.run)
    assert not grasp.dropped
    assert grasp.gave_way == ()
    judged = grasp.carried & np.isfinite(grasp.least) & (grasp.least > 0.0) & ~after_stalls(grasp.truth.time)
    assert judged.sum() > 0.5 * grasp.carried.sum()
    assert (grasp.felt[judged] > grasp.least[judged]).all()
    assert grasp.grip_ratio < 1.4
    assert not children()
    assert not (tmp_path / "bus").exists()
