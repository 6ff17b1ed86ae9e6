"""Advice on how a run ended: by its cause, in commands that exist."""

import re
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace

import pytest

import palpate
from palpate.cli import typed_commands
from palpate.experiments.kit.advice import ANYWHERE, ON_DEVICES, advice_on_ending
from palpate.robots.robot import load_robot
from palpate.runtime import Cause, DeviceWatchdog, Ending, RobotRest, RunResult, Trip

TYPED = re.compile(r"`palpate ([a-z][a-z-]*)")
RESULT = RunResult(Ending.DONE, None, None, RobotRest.at_rest(), 1.0, 1.0, None, None)


@dataclass
class Planned:
    """As much of a plan as advice needs."""

    name: str

    @property
    def robot(self):
        return load_robot(self.name)

    @property
    def config(self):
        return SimpleNamespace(robot=self.name)


def advised(robot, **how):
    return advice_on_ending("explore", Planned(robot), replace(RESULT, **how))


def tripped(cause):
    return {"ending": Ending.TRIPPED, "trip": Trip(0.5, "something", "1", "0", cause)}


def test_a_run_that_was_done_and_came_to_rest_needs_no_advice():
    assert advised("ur5e-netft") == ()


@pytest.mark.parametrize("cause", Cause)
def test_each_cause_has_its_own_advice(cause):
    (found,) = advised("ur5e-netft", **tripped(cause))
    others = [advised("ur5e-netft", **tripped(other)) for other in Cause if other is not cause]
    assert (found,) not in others
    assert ("reduce force" in found) == (cause is Cause.FORCE)
    assert ("palpate recover ur5e-netft" in found) == (cause in (Cause.WIRE, Cause.DEVICE))


def test_a_simulation_has_no_devices_to_recover():
    rest = RobotRest.not_known((DeviceWatchdog("it", "stops", 0.1, "look"),))
    for cause in Cause:
        assert "recover" not in " ".join(advised("stage", rest=rest, **tripped(cause)))
    assert "palpate recover ur5e-netft" in " ".join(advised("ur5e-netft", rest=rest))


def test_every_command_that_a_message_names_exists():
    root = Path(palpate.__file__).parent  # its links are not followed by themselves
    sources = [path.read_text() for folder in (root, *root.iterdir()) for path in folder.rglob("*.py")]
    named = {name for text in (*sources, *ANYWHERE.values(), *ON_DEVICES.values()) for name in TYPED.findall(text)}
    assert "recover" in named
    assert named - {"experiment", *typed_commands()} == set()
