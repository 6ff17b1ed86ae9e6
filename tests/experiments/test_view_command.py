"""`palpate view` as people type it, mistakes included."""

import json
import os
import signal
import subprocess
import sys
import time
import urllib.request

import pytest
from palpate.commands.run_told import log_writer
from PIL import Image, ImageSequence

from palpate.cli import main
from palpate.commands.answer import ExitCode
from palpate.commands.view.command import run_view
from palpate.commands.view.config import ViewConfig
from palpate.commands.view.plan import view_scene, watched_plan
from palpate.errors import InvalidValueError
from palpate.experiments.explore import Attempt
from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.explore.plan import plan
from palpate.runtime.pacing import SimulatedTime
from palpate.runtime.real_time import RealTime
from palpate.sim.render import gl as render_gl
from support.waiting import until

SMALL = ("width=0.01", "depth=0.004", "speed=0.05")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    made = tmp_path_factory.mktemp("recorded")
    planned = plan(ExploreConfig(object="box", width=0.01, depth=0.004, speed=0.05, out=made))
    Attempt(planned).run((), (log_writer(planned),))
    return made


PROGRAM = """
import sys
from palpate.commands.view.command import run_view
from palpate.commands.view.config import ViewConfig
if __name__ == "__main__":
    sys.exit(run_view(ViewConfig({})).exit_code)
"""


def started(tmp_path, arguments, wanted):
    """A view in a process of its own, and what it has said until a text occurs."""
    program = tmp_path / "program.py"
    program.write_text(PROGRAM.format(arguments))
    process = subprocess.Popen(
        [sys.executable, str(program)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=os.environ
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
def test_a_log_is_shown_until_ctrl_c(folder, tmp_path):
    process, said = started(tmp_path, f"__import__('pathlib').Path({str(folder)!r}), port=0", "View:")
    with urllib.request.urlopen(url_in(said)) as page:
        assert page.status == 200
    assert "127.0.0.1" in said
    assert ended(process) == (0, "", "")


@pytest.mark.slow
def test_an_exploration_is_watched_recorded_and_stays_open(tmp_path):
    words = (*SMALL, "object=ellipsoid", "size=0.05,0.04,0.03", f"out={tmp_path / 'run'}")
    process, said = started(tmp_path, f"set={words!r}, port=0, time_scale=float('inf')", "stays open")
    assert "Finished" in said
    assert list((tmp_path / "run").glob("*.mcap"))
    with urllib.request.urlopen(url_in(said)) as page:
        assert page.status == 200
    assert ended(process) == (0, "", "")


@pytest.mark.slow
def test_ctrl_c_in_the_run_ends_it_with_the_shells_code(tmp_path):
    words = (*SMALL, f"out={tmp_path / 'run'}")
    process, _ = started(tmp_path, f"set={words!r}, port=0, time_scale=0.1", "View:")
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
        run_view(ViewConfig(folder, **{name: path}))


@pytest.mark.slow
def test_pictures_of_a_log(folder, tmp_path, capsys):
    still, video = tmp_path / "a.png", tmp_path / "a.gif"
    config = ViewConfig(folder, time_scale=4.0, picture=still, video=video)
    answer = run_view(config)
    if answer.error:
        pytest.skip(answer.error)
    with Image.open(still) as picture:
        assert picture.size == (640, 480)
        assert len(picture.getcolors(640 * 480)) > 50, "something is in it"
    with Image.open(video) as frames:
        # 2.4 s at four times real time, 20 pictures a second
        assert 8 <= len(list(ImageSequence.Iterator(frames))) <= 20
    assert "pictures" in capsys.readouterr().out


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


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"time_scale": 0.0}, "time_scale = 0"),
        ({"port": 70000}, "port = 70000"),
        ({"video": "a.gif"}, "name one"),
        ({"log": "a", "set": ("force=3",)}, "leave them out"),
        ({"log": "a", "video": "a.mp4"}, r"must end in \.gif"),
        ({"log": "a", "picture": "a.jpg"}, r"must end in \.png"),
        ({"log": "a", "video": "a.gif", "time_scale": float("inf")}, "finite"),
    ],
)
def test_mistakes(wrong, message):
    from pathlib import Path

    paths = {name: Path(value) if name in ("log", "video", "picture") else value for name, value in wrong.items()}
    with pytest.raises(InvalidValueError, match=message):
        ViewConfig(**paths)


def test_no_such_log(tmp_path):
    with pytest.raises(InvalidValueError, match="no such file"):
        run_view(ViewConfig(tmp_path / "nothing"))


def test_the_pace_is_what_was_asked():
    assert isinstance(watched_plan(SMALL, None, float("inf")).backend.pacer, SimulatedTime)
    assert isinstance(watched_plan(SMALL, None, 2.0).backend.pacer, RealTime)


def test_values_go_before_the_file_and_that_before_the_robot(tmp_path):
    file = tmp_path / "a.yaml"
    file.write_text("force: 3\nspeed: 0.03\nrobot: stage-nano17\nwidth: 0.01\ndepth: 0.004\n")
    config = watched_plan(("force=4",), file, 1.0).config
    assert (config.force, config.speed, config.robot) == (4.0, 0.03, "stage-nano17")
    assert config.force_noise > 0.0, "the robot's"
    with pytest.raises(InvalidValueError, match="forse"):
        watched_plan(("forse=4",), None, 1.0)


def test_the_scene_has_the_tip_and_the_object():
    planned = watched_plan((*SMALL, "object=box"), None, 1.0)
    assert sorted(part.body for part in view_scene(planned).parts) == ["", "tip"]


def test_set_takes_what_it_takes_elsewhere():
    config = watched_plan((*SMALL, "mu=0.5", "tip=0.008,0.008,0.012", "object=ellipsoid"), None, 1.0).asked
    assert (config.friction, config.tip, config.object) == (0.5, (0.008, 0.008, 0.012), "ellipsoid")
    with pytest.raises(InvalidValueError, match=r"--config FILE\.YAML"):
        watched_plan(("config=a.yaml",), None, 1.0)


@pytest.mark.slow
def test_ctrl_c_while_the_run_is_evaluated_names_its_log(tmp_path, monkeypatch, capsys):
    def interrupted(attempt, result, tell):
        raise KeyboardInterrupt

    monkeypatch.setattr(Attempt, "found", interrupted)
    typed = ["view", "--time-scale", "inf", "--port", "0", "--set", *SMALL, f"out={tmp_path}"]
    assert main(typed) == ExitCode.INTERRUPTED
    (log,) = (path for path in tmp_path.glob("*.mcap") if not path.is_symlink())
    assert f"its log is kept: {log}" in capsys.readouterr().err


def test_a_view_does_not_record_among_the_files_of_another_command(tmp_path, capsys):
    (tmp_path / "report.html").touch()
    (tmp_path / "forces.csv").touch()
    typed = ["view", "--time-scale", "inf", "--port", "0", "--set", *SMALL, f"out={tmp_path}"]
    assert main(typed) == ExitCode.MISTAKE
    assert "holds a run of `palpate regulate`" in capsys.readouterr().err
