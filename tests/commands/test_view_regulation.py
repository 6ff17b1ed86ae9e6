"""`palpate view` of a regulation of force: the surface as it was, no map and no plan."""

import numpy as np
import pytest
from PIL import Image

from palpate.commands.view import command as view_command
from palpate.commands.view.command import run_view
from palpate.commands.view.config import ViewConfig
from palpate.experiments.kit.from_log import LoggedRun
from palpate.runtime.log import read_log
from palpate.viewing import frames_of_log
from support.regulate_runs import logged, planned
from support.shown_player import Shown


@pytest.fixture(scope="module")
def moving(tmp_path_factory):
    path = tmp_path_factory.mktemp("moving") / "run.mcap"
    logged(planned(duration=0.5, surface="sine", landing_speed=0.004), path)
    return path


@pytest.fixture(scope="module")
def still(tmp_path_factory):
    path = tmp_path_factory.mktemp("still") / "run.mcap"
    logged(planned(duration=0.5, object="sphere"), path)
    return path


def test_a_moving_surface_is_where_the_contact_was(moving):
    """The fingertip touched it, so that in every frame of contact they are a radius apart, as felt."""
    log = read_log(moving)
    scene = LoggedRun.of(log).plan().view()
    frames = frames_of_log(log)
    touching = np.flatnonzero(frames.finger(0).touching)
    gaps, heights = [], []
    for i in touching[:: max(1, len(touching) // 20)].tolist():
        poses = scene.placement.poses(frames.posture(i))
        heights.append(poses["object"].position[2])
        gaps.append(poses["tip"].position[2] - heights[-1])
    assert np.ptp(heights) > 3e-3, "it moved"
    assert np.ptp(gaps[3:]) < 0.6e-3, "and the tip with it, to within the contact's compression"


@pytest.mark.parametrize("log", ["still", "moving"])
def test_it_is_played_without_map_and_plan(log, request, monkeypatch, capsys):
    monkeypatch.setattr(view_command, "Player", Shown)
    assert run_view(ViewConfig(str(request.getfixturevalue(log)))).exit_code == 0
    assert Shown.given is not None
    scene, frames, plans = Shown.given
    assert scene.title.startswith("Force on a")
    assert scene.surface is None
    assert scene.map_spacing is None
    assert not plans
    assert len(frames) > 500
    assert "plan is not shown" not in capsys.readouterr().out


@pytest.mark.parametrize("log", ["still", "moving"])
def test_a_picture_of_it(log, request, tmp_path):
    still_picture = tmp_path / "a.png"
    answer = run_view(ViewConfig(str(request.getfixturevalue(log)), picture=still_picture))
    if answer.error:
        pytest.skip(answer.error)
    with Image.open(still_picture) as picture:
        assert len(picture.getcolors(640 * 480)) > 50, "something is in it"
