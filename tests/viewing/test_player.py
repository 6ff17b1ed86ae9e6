"""A player of logs: bodies, arrows, map, plan and time in the scene of its server. No browser."""

from typing import Any

import numpy as np
import pytest

from palpate.errors import InvalidValueError
from palpate.runtime.shown_plan import ShownMark, ShownPlan
from palpate.viewing import ANY_PORT, Player, ViewScene, frames_of_log
from viewing.test_server import messages_until


@pytest.fixture(scope="module")
def started(short_run):
    with Player(short_run.scene, frames_of_log(short_run.log), port=ANY_PORT, plans=short_run.plans) as made:
        yield made


@pytest.fixture
def player(started):
    """The module's player, wound back to its beginning."""
    wind_to(started, 0.0)
    started._playing.value = True
    return started


def wind_to(player, time):
    player._playing.value = False
    player._slider.value = time
    player.step(0.0)


def map_points(player):
    chunks = [player.server.scene.get_handle_by_name(f"/map/chunk_{i}") for i in range(100)]
    return np.concatenate([np.empty((0, 3)), *(chunk.points for chunk in chunks if chunk is not None)])


def test_a_log_is_in_the_scene(player, short_run):
    frames = frames_of_log(short_run.log)
    player.step(1e9)
    assert player.time == pytest.approx(frames.time[-1] - frames.time[0])
    points = map_points(player)
    assert len(points) > 50
    assert np.abs(short_run.planned.target.signed_distance(points.astype(float))).max() < 2e-4
    assert player.server.scene.get_handle_by_name("/body_0").position == pytest.approx(frames.position[-1])
    sent = messages_until(player.url, b"/map/chunk_0")
    for name in (b"/body_0/part_", b"/part_1", b"/contact_force_0"):
        assert name in sent


def test_the_arrow_is_the_contact_force(player, short_run):
    frames = frames_of_log(short_run.log)
    middle = int(np.flatnonzero(frames.finger(0).touching)[len(frames) // 3])
    arrow = player.server.scene.get_handle_by_name("/contact_force_0")
    assert not arrow.visible, "nothing is touched at the beginning"
    player.step(float(frames.time[middle] - frames.time[0]) + 1e-9)
    assert arrow.visible
    start, end = arrow.position + arrow.points[0]
    assert start == pytest.approx(frames.centroid[middle], abs=1e-6)
    assert (end - start) / 0.015 == pytest.approx(frames.force[middle], abs=1e-3)
    assert frames.force[middle, 2] > 1.5, "the object pushes the finger up"


def test_winding_back_takes_the_map_back_and_a_stop_stops_time(player):
    player.step(1.5)
    player.drawing.refresh(player._frames[:1])
    early = map_points(player)
    assert len(early) > 10
    player.step(1e9)
    player._slider.value = 1.5
    player.step(0.03)  # still playing: the slider comes first
    assert player.time == 1.5
    player.drawing.refresh(player._frames[:1])
    assert map_points(player) == pytest.approx(early)
    player._playing.value = False
    player.step(1.0)
    assert player.time == 1.5


@pytest.mark.parametrize(
    ("speed", "periods", "message"),
    [(0.0, 9, "speed"), (-1.0, 9, "speed"), (float("nan"), 9, "speed"), (1.0, 0, "no periods")],
)
def test_an_impossible_speed_and_an_empty_log_are_refused(short_run, speed, periods, message):
    with pytest.raises(InvalidValueError, match=message):
        Player(short_run.scene, frames_of_log(short_run.log)[:periods], speed, port=ANY_PORT)


def test_a_title_is_text_and_time_goes_on_with_the_speed(short_run):
    scene = ViewScene("<img src=x onerror=alert(1)> {1+1} /a/b", ())
    with Player(scene, frames_of_log(short_run.log), speed=2.5, port=ANY_PORT) as player:
        sent = messages_until(player.url, b"onerror")
        player.step(0.2)
        assert player.time == pytest.approx(0.5)
    assert b"&lt;img src=x" in sent
    assert b"<img" not in sent


def test_lines_and_marks_of_a_plan_go_when_it_is_wound_back(player, short_run):
    scene: Any = player.server.scene
    plans = short_run.plans
    wind_to(player, float(plans[1].time) + 0.3)
    to_go = scene.get_handle_by_name("/plan/to_go").points
    assert to_go[-1, 1, :2] == pytest.approx(plans[1].plan.path[-1][:2], abs=1e-6)
    assert (to_go[:, :, 2] > short_run.planned.target.top).all(), "above the surface"
    player.drawing.follow(ShownPlan("", (), (0.0, 0.0, 1.0), (ShownMark("edge", (0.0, 0.0, 0.1)),)))
    assert scene.get_handle_by_name("/marks/mark_0").position == pytest.approx((0.0, 0.0, 0.1))
    assert scene.get_handle_by_name("/marks/word_0").text == "edge"
    player.drawing.refresh(player._frames[:1])
    assert "1 x edge" in player.drawing._numbers.content
    wind_to(player, 0.0)
    assert {scene.get_handle_by_name(f"/marks/{kind}_0") for kind in ("mark", "word")} == {None}
    wind_to(player, 1e3)
    player.drawing.refresh(player._frames[-1:])
    assert scene.get_handle_by_name("/plan/to_go") is None, "nothing is left at the end"
    assert len(scene.get_handle_by_name("/plan/done").points) > 50
