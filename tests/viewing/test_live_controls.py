"""Changing a controller from the browser: what is asked for arrives once, checked, ramped and recorded."""

import multiprocessing

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.runtime.live import LiveParameter, LiveParameters
from palpate.viewing import FrameLayout, Frames, ViewScene
from palpate.viewing.live_controls import STEPS, LiveControls, slider_step
from palpate.viewing.request_board import BoardReader, BoardWriter, RequestBoard
from viewing.test_frames import observer_without_process
from viewing.test_server import served

CONTEXT = multiprocessing.get_context("spawn")
FORCE = LiveParameter("force", 2.0, 0.5, 10.0, 5.0, "N", "normal force")
RATIO = LiveParameter("ratio", 0.5, 0.0, 1.0, 1.0, "", "<b>of</b> two things")
LAYOUT = FrameLayout(live=2)


def said(force, ratio, force_target=None, ratio_target=None):
    """What a run says: values and what they are moving to."""
    row = np.zeros((1, LAYOUT.width))
    targets = (force if force_target is None else force_target, ratio if ratio_target is None else ratio_target)
    row[0, LAYOUT.live_columns] = (force, ratio, *targets)
    return Frames(row, LAYOUT)


NOTHING = Frames(np.empty((0, LAYOUT.width)), LAYOUT)


@pytest.fixture
def panel():
    asked = []
    with served() as server:
        controls = LiveControls(server, (FORCE, RATIO), lambda name, value: asked.append((name, value)))
        controls.step(said(2.0, 0.5))
        assert asked == []
        yield controls, [slider.handle for slider in controls._sliders], asked


@given(st.lists(st.lists(st.tuples(st.sampled_from("abc"), st.floats(-1e6, 1e6)), max_size=6), max_size=6))
def test_the_newest_wish_for_each_parameter_arrives_once(bursts):
    board = RequestBoard(CONTEXT, ("a", "b", "c"))
    writer, reader = BoardWriter(board), BoardReader(board)
    for burst in bursts:
        for name, value in burst:
            writer.request(name, value)
        assert reader.is_new == bool(burst)
        assert dict(reader.take()) == dict(burst)
        assert not reader.is_new
        assert reader.take() == []


def write_wishes(board, count):
    writer = BoardWriter(board)
    for i in range(count):
        writer.request("a", float(i))


@pytest.mark.slow
def test_the_last_wish_is_never_lost_between_processes():
    board, count = RequestBoard(CONTEXT, ("a",)), 5_000
    reader, process = BoardReader(board), CONTEXT.Process(target=write_wishes, args=(board, count))
    process.start()
    values = []
    while process.is_alive() or reader.is_new:
        values += [value for _, value in reader.take()]
    assert process.exitcode == 0
    assert values[-1] == count - 1
    assert values == sorted(values)


@given(st.floats(1e-9, 1e9))
def test_sliders_are_fine_enough_and_have_round_steps(span):
    step = slider_step(span)
    assert STEPS * (1.0 - 1e-9) <= span / step <= 2.5 * STEPS * (1.0 + 1e-9)
    digit = step / 10.0 ** np.floor(np.log10(step) + 1e-9)
    assert min(abs(digit - wanted) for wanted in (1.0, 2.0, 5.0)) < 1e-6


def test_what_is_moved_is_asked_for_once(panel):
    controls, (force, _), asked = panel
    force.value = 3.0
    for _ in range(5):
        controls.step(said(2.0, 0.5))  # the loop has not taken it up yet
    assert asked == [("force", 3.0)]
    assert force.value == 3.0
    controls.step(said(2.1, 0.5, force_target=3.0))
    assert "now 2.1 N" in controls._sliders[0]._now.content
    controls.step(said(3.0, 0.5))
    assert (asked, force.value) == ([("force", 3.0)], 3.0)


def test_a_change_from_elsewhere_moves_the_slider_and_asks_for_nothing(panel):
    controls, (force, ratio), asked = panel
    controls.step(said(2.0, 0.5, force_target=4.0))
    assert (force.value, ratio.value, asked) == (4.0, 0.5, [])
    controls.step(NOTHING)
    assert asked == []


def test_a_slider_that_is_still_being_moved_is_not_pulled_back(panel):
    controls, (force, _), asked = panel
    for value in (3.0, 4.0):
        force.value = value
        controls.step(said(2.0, 0.5))
    controls.step(said(2.1, 0.5, force_target=3.0))  # the loop has seen the first of the two
    assert force.value == 4.0
    controls.step(said(2.2, 0.5, force_target=4.0))
    assert (force.value, asked) == (4.0, [("force", 3.0), ("force", 4.0)])


def test_a_value_out_of_range_is_refused_and_the_slider_goes_back(panel):
    """Browsers keep a slider in its range; another client of their protocol need not."""
    controls, (force, _), asked = panel
    for wrong in (11.0, -1.0, float("nan"), float("inf")):
        controls._status.content = ""
        force.value = wrong
        controls.step(said(2.0, 0.5))
        assert (asked, force.value) == ([], 2.0)
        assert "refused: force" in controls._status.content
        assert "must lie between 0.5 and 10 N" in controls._status.content
    controls.step(said(2.0, 0.5))
    assert asked == []


def test_when_the_run_is_over_nothing_can_be_asked(panel):
    controls, (force, ratio), asked = panel
    force.value = 3.0
    controls.end()
    assert force.disabled
    assert ratio.disabled
    assert force.value == 2.0
    force.value = 4.0
    controls.step(said(2.0, 0.5))
    assert asked == []
    assert "the run is over" in controls._status.content


def test_the_observer_asks_the_loop_and_what_is_wrong_ends_no_run(short_run):
    live = LiveParameters(FORCE, RATIO)
    observe, reader, writer = observer_without_process(ViewScene("t", ()), live)
    live.step(0.0)
    writer.request("force", 4.0)
    writer.request("ratio", 7.0)  # the view would not have let it through
    observe(*short_run.periods[0])
    assert [(change.name, change.value) for change in live.step(0.001)] == [("force", 4.0)]
    for i in range(2, 30):
        live.step(0.001 * i)
        observe(*short_run.periods[20 * i])
    frames = reader.read()
    assert frames.live_targets[-1].tolist() == [4.0, 0.5]
    assert 2.0 < frames.live_values[-1, 0] < 4.0, "ramped"
