"""What really happened, kept beside a run: each row as the back end reported it; a real robot has none."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.runtime import Command, Limits, MemoryLog, Recorder, Supervisor, run
from palpate.runtime.log import LogWriter, read_log
from palpate.runtime.replay import ReplayWithTruth
from palpate.runtime.truth import truth_source
from palpate.runtime.wrapped_backend import WrappedBackend
from runtime.log.log_examples import any_bits
from runtime.puppets import PERIOD, PuppetBackend, PuppetController, touch
from runtime.simulated_backends import BACKENDS


class TellingBackend(PuppetBackend):
    """A puppet that tells numbers of any 64 bits."""

    def __init__(self, width, seed=0):
        super().__init__()
        self.truth_columns, self._seed = tuple(f"number_{i}" for i in range(width)), seed

    def truth_row(self):
        return any_bits(np.random.default_rng([self._seed, len(self.commands)]), len(self.truth_columns)).tolist()


def recorded(folder, backend, controller, fingers=1, duration=0.06):
    """What memory and log have of a run, and what was reported in each of its periods."""
    source, memory, reported = truth_source(backend), MemoryLog(), []
    recorder = Recorder(memory, LogWriter(folder / "a.mcap"))
    notes = () if source is None else (lambda *_: reported.append(source.truth_row()),)
    fast = Supervisor(Limits().allowing(0.25))
    run(backend, touch(fingers), controller, fast, duration=duration, recorder=recorder, observers=notes)
    return memory.truth(), read_log(folder / "a.mcap"), np.array(reported)


@settings(max_examples=15, deadline=None)
@given(st.integers(1, 80), st.integers(0, 2**31))
def test_every_bit_comes_back_and_again_in_a_replay(tmp_path_factory, width, seed):
    telling_backend = WrappedBackend(TellingBackend(width, seed))
    memory, log, reported = recorded(tmp_path_factory.mktemp("log"), telling_backend, PuppetController())
    assert memory.columns == log.truth.columns == telling_backend.backend.truth_columns
    assert memory.rows.tobytes() == log.truth.rows.tobytes() == reported.tobytes()
    again = ReplayWithTruth(log.samples(), PERIOD, log.truth)
    again.start()
    replayed = [again.truth_row()]
    for _ in reported[1:]:
        again.step(Command())
        replayed.append(again.truth_row())
    assert np.array(replayed).tobytes() == reported.tobytes()


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["stage, noise", "UR5e, noise", "hand, friction plant, noise"])
def test_a_simulation_tells_what_its_log_keeps(kind, tmp_path):
    backend, command = BACKENDS[kind](1)
    fingers, script = 2 if "hand" in kind else 1, {k: command(k) for k in range(400)}
    memory, log, reported = recorded(tmp_path, backend, PuppetController(script), fingers, 0.4)
    assert len(reported) == len(log) >= 400, "a row per sample, until the robot is at rest"
    assert memory.rows.tobytes() == log.truth.rows.tobytes() == reported.tobytes()
    assert np.ptp(reported, axis=0).any(), "nothing happened"


def test_of_a_robot_there_is_none(tmp_path):
    memory, log, _ = recorded(tmp_path, PuppetBackend(), PuppetController())
    assert not memory.known
    assert not log.truth.known
    assert log.truth.rows.shape == (len(log), 0)
