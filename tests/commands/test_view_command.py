"""`palpate view` as people type it, mistakes included."""

import json
import signal
import subprocess
import sys
import time
import urllib.request

import numpy as np
import pytest
from PIL import Image, ImageSequence

from palpate.cli import main
from palpate.commands.command_result import ExitCode
from palpate.commands.view import command as view_command
from palpate.commands.view.command import _run_config, run_view, watched_backend
from palpate.commands.view.config import ViewConfig
from palpate.errors import InvalidValueError
from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.explore.experiment import Explore
from palpate.experiments.kit.from_log import LoggedRun
from palpate.experiments.kit.recorded_run import carry_out
from palpate.experiments.kit.recording import log_writer
from palpate.experiments.kit.registry import experiment_named
from palpate.runtime.log import read_log
from palpate.runtime.pacing import SimulatedTime
from palpate.runtime.real_time import RealTime
from palpate.sim.render import gl as render_gl
from palpate.viewing import frames_of_log
from support.explore_runs import plan_of
from support.regulate_runs import logged, planned
from support.shown_player import Shown
from support.tiny_experiment import TINY
from support.waiting import until

SMALL = ("width=0.01", "depth=0.004", "speed=0.05")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    made = tmp_path_factory.mktemp("recorded")
    planned = plan_of(ExploreConfig(object="box", width=0.01, depth=0.004, speed=0.05))
    carry_out(planned, sinks=(log_writer(Explore(), planned, made),))
    return made


def started(wanted, *typed):
    """A view in a process of its own, and what it has said until a text occurs."""
    process = subprocess.Popen(
        [sys.executable, "-m", "palpate", "view", *typed, "--port", "0"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    said = ""
    for line in process.stdout:
        said += line
        if wanted in line:
            return process, said
    raise AssertionError(said + process.communicate()[1])


def ended(process):
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=60)
    return process.returncode, out, err


def url_in(said):
    return next(word for word in said.split() if word.startswith("http://"))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("experiment", "words"),
    [("explore", (*SMALL, "object=ellipsoid", "size=0.05,0.04,0.03")), ("grasp", ()), (TINY, ())],
)
def test_any_experiment_is_watched_recorded_and_stays_open(experiment, words, tmp_path):
    words = (*words, f"out={tmp_path / 'run'}")
    process, said = started("stays open", experiment, "--time-scale", "inf", "--set", *words)
    assert "process" not in said, "none has ended"
    assert list((tmp_path / "run").glob("*.mcap"))
    with urllib.request.urlopen(url_in(said)) as page:
        assert page.status == 200
    assert ended(process) == (0, "", "")


@pytest.mark.slow
def test_ctrl_c_in_the_run_ends_it_with_the_shells_code(tmp_path):
    words = (*SMALL, f"out={tmp_path / 'run'}")
    process, _ = started("View:", "explore", "--time-scale", "0.1", "--set", *words)
    until(lambda: list((tmp_path / "run").glob("*.mcap")), within=60.0)  # there is a log once the run has begun
    time.sleep(0.5)
    code, out, err = ended(process)
    assert code == 130, err
    assert "at rest" in out
    assert err == ""


@pytest.mark.parametrize("name", ["picture", "video"])
def test_a_picture_into_no_folder_is_refused_before_it_is_drawn(folder, tmp_path, name):
    path = tmp_path / "none" / ("a.png" if name == "picture" else "a.gif")
    with pytest.raises(InvalidValueError, match=r"there is no folder .*none"):
        run_view(ViewConfig(str(folder), **{name: path}))


@pytest.mark.slow
def test_pictures_of_a_log(folder, tmp_path, capsys):
    still, video = tmp_path / "a.png", tmp_path / "a.gif"
    config = ViewConfig(str(folder), time_scale=4.0, picture=still, video=video)
    answer = run_view(config)
    if answer.error:
        pytest.skip(answer.error)
    with Image.open(still) as picture:
        assert picture.size == (640, 480)
        assert len(picture.getcolors(640 * 480)) > 50, "something is in it"
    with Image.open(video) as frames:
        # 2.4 s at four times real time, 20 pictures a second
        assert 8 <= len(list(ImageSequence.Iterator(frames))) <= 20
    assert "images" in capsys.readouterr().out


def test_without_a_renderer_the_remedy_is_told(folder, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(render_gl.ctypes.util, "find_library", lambda name: None)
    typed = ["view", str(folder), "--picture", str(tmp_path / "a.png")]
    assert main([*typed, "--json"]) == ExitCode.UNFINISHED
    assert "apt install libegl1" in json.loads(capsys.readouterr().out)["error"]
    assert main(typed) == ExitCode.UNFINISHED
    said = capsys.readouterr().err
    assert "apt install libegl1" in said
    assert "robot was stopped" not in said
    assert not list(tmp_path.iterdir())


def test_the_pace_is_what_was_asked_for_but_of_devices():
    plan = plan_of(ExploreConfig())
    assert isinstance(watched_backend(plan, float("inf")).pacer, SimulatedTime)
    assert isinstance(watched_backend(plan, 2.0).pacer, RealTime)
    with pytest.raises(InvalidValueError, match="time_scale = 2: this robot keeps real time"):
        watched_backend(plan_of(ExploreConfig(robot="ur5e-netft")), 2.0)


def asked(*words, **more):
    return _run_config(experiment_named("explore"), ViewConfig("explore", set=words, **more))


def test_values_go_before_the_file(tmp_path):
    file = tmp_path / "a.yaml"
    file.write_text("force: 3\nspeed: 0.03\nrobot: stage-nano17\nwidth: 0.01\ndepth: 0.004\n")
    config = asked("force=4", config=file)
    assert (config.force, config.speed, config.robot) == (4.0, 0.03, "stage-nano17")
    with pytest.raises(InvalidValueError, match="forse"):
        asked("forse=4")


def test_set_takes_what_it_takes_elsewhere():
    config = asked(*SMALL, "mu=0.5", "tip=0.008,0.008,0.012", "object=ellipsoid")
    assert (config.friction, config.tip, config.object) == (0.5, (0.008, 0.008, 0.012), "ellipsoid")
    with pytest.raises(InvalidValueError, match=r"--config FILE\.YAML"):
        asked("config=a.yaml")


def test_a_view_does_not_record_among_the_files_of_another_command(tmp_path, capsys):
    (tmp_path / "sweep.json").touch()
    typed = ["view", "explore", "--time-scale", "inf", "--port", "0", "--set", *SMALL, f"out={tmp_path}"]
    assert main(typed) == ExitCode.MISTAKE
    assert "holds a run of `palpate sweep`" in capsys.readouterr().err


# --- `palpate view` of a regulation of force: the surface as it was, no map and no plan ---


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
    assert scene.title.startswith("Regulation of force on a")
    assert scene.surface is None
    assert scene.map_spacing is None
    assert not plans
    assert len(frames) > 500
    assert "plan is not shown" not in capsys.readouterr().out


@pytest.mark.parametrize("log", ["still", "moving"])
def test_a_picture_of_it(log, request, tmp_path):
    still_figure = tmp_path / "a.png"
    answer = run_view(ViewConfig(str(request.getfixturevalue(log)), picture=still_figure))
    if answer.error:
        pytest.skip(answer.error)
    with Image.open(still_figure) as picture:
        assert len(picture.getcolors(640 * 480)) > 50, "something is in it"
