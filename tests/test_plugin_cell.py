"""An arm, a sensor and a fingertip of a stranger's package, in one robot file, through the commands."""

import importlib
import json
import signal
from pathlib import Path

import pytest

from palpate.hw.ft_stream import StreamSettings
from palpate.hw.serial_ft import SerialSensor
from palpate.testing import check_arm, check_sensor
from support.installed_plugin import InstalledPlugin
from support.ur_wire_sessions import own_address

CELL = Path(__file__).parents[1] / "examples" / "plugin_cell"
PATIENT = (("sample_age_s: 0.3", "sample_age_s: 1.0"), ("silent_after_s: 0.3", "silent_after_s: 3.0"),
           ("watchdog_s: 0.3", "watchdog_s: 1.0"))  # fmt: skip

NOISE = (0.003, 0.003, 0.003, 1.6e-5, 1.6e-5, 1.6e-5)

pytestmark = pytest.mark.xdist_group("wire")


@pytest.fixture(scope="module")
def palpate(tmp_path_factory):
    typed = InstalledPlugin(CELL, tmp_path_factory)
    text = (CELL / "bench.yaml").read_text().replace("127.0.0.40", own_address(90))
    for before, after in (*PATIENT, ("/tmp/bench-box", str(typed.folder / "box"))):
        assert before in text
        text = text.replace(before, after)
    (typed.folder / "bench.yaml").write_text(text)
    return typed


def test_its_kinds_are_words_of_robot_files_and_mistakes_have_their_place(palpate):
    assert "bench_arm" in palpate("robot", "check", "bench.yaml")
    for before, after, words in (
        ("kind: bench_arm", "kind: bench_armm", ("did you mean bench_arm?", "ur", "line 6")),
        ("watchdog_s: 1.0", "watchdog_s: 100", ("backend.arm.watchdog_s = 100", "0.01 to 1 s")),
        ("diameter_m: 0.016", "diameter_m: 16", ("fingers[0].surface.diameter_m = 16", "another unit?")),
    ):
        text = (palpate.folder / "bench.yaml").read_text()
        assert before in text
        (palpate.folder / "wrong.yaml").write_text(text.replace(before, after))
        refused = palpate("robot", "check", "wrong.yaml", fails=True)
        assert all(word in refused for word in words), refused


def test_its_fingertip_is_swept_in_simulation_and_its_devices_are_refused(palpate):
    (palpate.folder / "bench-sim.yaml").write_text((CELL / "bench-sim.yaml").read_text())
    words = ("sweep", "regulate", "--out", "swept", "--json", "--vary", "force=1,2", "--set", "duration=0.3")
    swept = json.loads(palpate(*words, "robot=bench-sim.yaml"))
    assert swept["outcome"] == "All 2 runs got to their end."
    assert "simulated robots only" in palpate(*words, "robot=bench.yaml", fails=True)


@pytest.mark.slow
def test_its_arm_and_its_sensor_conform(palpate, monkeypatch):
    monkeypatch.syspath_prepend(str(CELL))
    arm, box = (importlib.import_module(f"palpate_bench.{name}") for name in ("arm", "box"))
    emulator = palpate.begun("emulate", "robot", "bench.yaml")
    try:
        while "Runs until" not in (line := emulator.stdout.readline()):
            assert line, "it ended"
        check_arm(lambda: arm.BenchArm(own_address(90), 40_000, watchdog=1.0, silent_after=3.0))
        stream = StreamSettings(NOISE, silent_after=3.0)
        check_sensor(lambda: SerialSensor(str(palpate.folder / "box"), box.BenchLines(), stream), NOISE)
    finally:
        emulator.send_signal(signal.SIGINT)
        emulator.communicate(timeout=20)


@pytest.mark.slow
def test_its_devices_are_emulated_examined_recovered_and_used(palpate):
    emulator = palpate.begun("emulate", "robot", "bench.yaml")
    try:
        while "Runs until" not in (line := emulator.stdout.readline()):
            assert line, "it ended"
        found = json.loads(palpate("recover", "bench.yaml", "--json"))
        assert found["fit"]
        assert found["devices"][1]["state"] == "it stands still"
        outcome = json.loads(
            palpate("regulate", "--robot", "bench.yaml", "--duration", "2", "--out", "held", "--json")
        )
        assert outcome["status"] == "done"
        assert outcome["report"]["felt_force_rms_error_n"] < 0.5
        assert "identical" in palpate("replay", "held")
        area = ("--width", "0.004", "--depth", "0.002", "--object", "box")
        explored = json.loads(palpate("explore", "--robot", "bench.yaml", *area, "--out", "felt", "--json"))
        assert explored["status"] == "done"
        assert explored["figures"]["contacts"] > 50
    finally:
        emulator.send_signal(signal.SIGINT)
        emulator.communicate(timeout=20)
    assert emulator.returncode == 0
