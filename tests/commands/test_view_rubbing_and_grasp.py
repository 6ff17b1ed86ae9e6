"""`palpate view` of rubbing and of grasps: the object is where it truly was."""

import io
import math
import threading
import time
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from PIL import Image

from palpate.commands.view import command as view_command
from palpate.commands.view.command import run_view, watched_backend
from palpate.commands.view.config import ViewConfig
from palpate.commands.view.scene import free_poses_in, free_poses_of
from palpate.experiments.kit.from_log import LoggedRun
from palpate.experiments.kit.recorded_run import RecordedRun, carry_out
from palpate.experiments.kit.recording import log_writer
from palpate.experiments.kit.registry import experiment_named
from palpate.runtime.log import log_in, read_log
from palpate.sim.hand.scene import OBJECT
from palpate.viewing import ANY_PORT, Player, frames_of_log
from support.friction_runs import FRICTION
from support.friction_runs import planned as planned_friction
from support.grasp_runs import plan_of
from support.shown_player import Shown
from viewing.browser import needs_browser, page

pytestmark = pytest.mark.slow  # they look at runs that take seconds


@pytest.fixture(scope="module")
def rubbed(tmp_path_factory):
    """The folder of a short rubbing run's log."""
    folder = tmp_path_factory.mktemp("rubbed")
    plan = planned_friction(quick=True, loads=(2.0,), out=folder)
    assert carry_out(plan, sinks=(log_writer(FRICTION, plan, folder),)).run.at_rest
    return folder


@pytest.fixture(scope="module")
def spun(tmp_path_factory):
    """The folder of a grasp in which the box spins, for twice its e is believed, and its true poses."""
    folder = tmp_path_factory.mktemp("spun")
    plan = plan_of(rise=0.2, lift_height=0.03, believed_spin_length=0.008)
    run, true = RecordedRun(plan, watched_backend(plan, math.inf)), []
    poses = free_poses_of(run.backend)
    assert poses is not None
    run.run((lambda *_: true.append(poses()),), (log_writer(experiment_named("grasp"), plan, folder),))
    return folder, np.array(true)


def test_a_fingertip_rubs_on_the_surface_with_the_force_that_it_feels(rubbed, monkeypatch, capsys):
    monkeypatch.setattr(view_command, "Player", Shown)
    assert run_view(ViewConfig(str(rubbed))).exit_code == 0
    assert "View: " in capsys.readouterr().out
    assert Shown.given is not None
    scene, frames, plans = Shown.given
    assert scene.title == "Friction of a plate by touch, turning-stage"
    assert scene.surface is None
    assert not plans
    contact = frames.finger(0)
    rubbing = np.flatnonzero(contact.touching & (frames.time > 0.5 * frames.time[-1]))
    poses = scene.placement.poses(frames.posture(int(rubbing[0])))
    # contacts lie on the plate's top, whose frame is the base's, within what the tip is compressed by
    top = max(float(part.vertices[:, 2].max()) for part in scene.parts if part.body not in poses)
    assert frames.centroid[rubbing, 2] == pytest.approx(top, abs=5e-4)
    assert np.median(contact.normal_force[rubbing]) == pytest.approx(2.0, rel=0.05)


def test_the_held_object_is_seen_to_rise_and_to_spin_as_it_truly_did(spun, monkeypatch):
    folder, true = spun
    monkeypatch.setattr(view_command, "Player", Shown)
    assert run_view(ViewConfig(str(folder))).exit_code == 0
    assert Shown.given is not None
    scene, frames, _ = Shown.given
    np.testing.assert_array_equal(frames.rows[:, frames.layout.free_columns], true)
    assert true[:, 2].max() > 0.025
    at = int(np.argmax(2.0 * np.arccos(np.minimum(np.abs(true[:, 3]), 1.0))))
    seen = scene.placement.poses(frames.posture(at))[OBJECT]
    assert seen.position == pytest.approx(true[at, :3])
    turned = math.acos(0.5 * (np.trace(np.array(seen.rotation)) - 1.0))
    assert turned > math.radians(10.0)


def test_what_the_log_does_not_know_is_said_and_stands_still(spun, monkeypatch, capsys):
    """As of a robot; where it is not known yet, the object is where it was known next."""
    log = read_log(log_in(spun[0]))
    late = log.truth.rows.copy()
    late[:100] = np.nan
    poses = free_poses_in(SimpleNamespace(truth=replace(log.truth, rows=late)))
    np.testing.assert_array_equal(poses[:101], np.broadcast_to(spun[1][100], (101, 7)))
    monkeypatch.setattr(view_command, "free_poses_in", lambda log: None)
    monkeypatch.setattr(view_command, "Player", Shown)
    assert run_view(ViewConfig(str(spun[0]))).exit_code == 0
    assert "the log does not record the object's pose" in " ".join(capsys.readouterr().out.split())
    assert Shown.given[1].layout.free == 0


@pytest.mark.parametrize("name", ["rubbed", "spun"])
def test_a_picture_of_it(name, request, tmp_path):
    folder, still = request.getfixturevalue(name), tmp_path / "a.png"
    folder = folder if name == "rubbed" else folder[0]
    answer = run_view(ViewConfig(str(folder), picture=still))
    if answer.error:
        pytest.skip(answer.error)
    red, _, blue = np.moveaxis(np.asarray(Image.open(still).convert("RGB")).astype(int), 2, 0)
    assert ((blue > red + 40) & (blue > 90)).sum() > 5000, "the object"
    assert ((red < 0.2 * blue) & (blue > 60)).sum() > 30, "arrows, without the red that the object has"


@needs_browser
@pytest.mark.parametrize("name", ["rubbed", "spun"])
def test_a_browser_shows_it_and_its_slider_winds_it_on(name, request, tmp_path):
    folder = request.getfixturevalue(name)
    log, going = read_log(log_in(folder if name == "rubbed" else folder[0])), threading.Event()
    scene, frames = LoggedRun.of(log).plan().view(), frames_of_log(log, free_poses_in(log))
    middle = 0.6 * float(frames.time[-1])
    with Player(scene, frames, 1.0, port=ANY_PORT) as player:
        player._playing.value = False
        playing = threading.Thread(target=player.play, args=(lambda: not going.is_set(),))
        playing.start()
        try:
            with page(tmp_path, player.url) as browser:
                browser.wait_for(f"document.body.innerText.includes('{scene.title}')")
                browser.wait_for("document.querySelectorAll('[role=slider]').length == 1")
                player._slider.value = middle
                browser.wait_for("/t = [2-9]\\.\\d+ s . (hold|scan|settle|lift)/.test(document.body.innerText)")
                browser.wait_for("/\\d\\.\\d\\d N/.test(document.body.innerText)")
                assert browser.evaluate("document.querySelectorAll('.uplot canvas').length") == 2
                time.sleep(3.0)  # the scene fades in
                shot = browser.screenshot()
                assert browser.errors == []
        finally:
            going.set()
            playing.join()
    picture = np.asarray(Image.open(io.BytesIO(shot)).convert("RGB")).astype(int)[:, :900]
    red, green, blue = np.moveaxis(picture, 2, 0)
    assert ((blue > red + 20) & (blue > 120)).sum() > 10_000, "the object"
    orange = (red > blue + 60) & (red > 120)
    assert orange.sum() > 300, "fingertips and arrows"
    assert (orange & (green < 0.55 * red)).sum() > 20, "arrows"
    (tmp_path / "shot.png").write_bytes(shot)
