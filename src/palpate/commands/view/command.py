"""`palpate view`: a run in the browser, live or from its log; or as pictures."""

from collections.abc import Sequence
from contextlib import ExitStack, suppress
from dataclasses import replace
from pathlib import Path

from rich.console import Console

from palpate.commands.answer import Answer, ExitCode
from palpate.commands.earlier_run import earlier_run
from palpate.commands.output_folder import make_folder
from palpate.commands.progress import doing, step_progress
from palpate.commands.run_told import kept_if_interrupted, log_writer, written
from palpate.commands.said import say
from palpate.commands.sweep.explored import figures_of
from palpate.commands.view.config import ViewConfig
from palpate.commands.view.growth import plans_of_log, surface_view
from palpate.commands.view.held import held_poses
from palpate.commands.view.pictures import write_still, write_video
from palpate.commands.view.plan import ViewedPlan, recorded_plan, simulated_model, view_scene, watched_plan
from palpate.errors import InvalidValueError
from palpate.experiments.explore.explored_map import STEPS
from palpate.experiments.explore.plan import ExplorationPlan
from palpate.experiments.explore.plan_watch import PlanWatch
from palpate.experiments.explore.pressing import prepared
from palpate.experiments.explore.report import outcome
from palpate.experiments.explore.run import Attempt
from palpate.experiments.grasp.plan import GraspPlan
from palpate.robots.drivers import check_drivers
from palpate.runtime import Ending, result_until
from palpate.runtime.log import Log, log_in, read_log
from palpate.runtime.shown_plan import PlanChange
from palpate.sim.render.gl import NoRendererError
from palpate.viewing import LOOPBACK, Frames, LiveView, Player, ViewUnavailableError, check_host, frames_of_log

STARTING = "starting the view"
"""Said at once: the process that makes the map's surface, and the server, take seconds on a busy computer."""

ENDED = "Stopping: writing the log, and working out what was found (Ctrl-C again: stop without that)"
"""Said at once after a Ctrl-C while it explores."""


def run_view(config: ViewConfig) -> Answer:
    """Show a run until Ctrl-C.

    Returns:
        What was written; unfinished if it cannot be shown, or the exploration did not finish, and interrupted if
        that was.

    Raises:
        InvalidValueError: The configuration cannot be realised, or there is no such log.
        OSError: The log cannot be read or written.
    """
    if config.picture is None and config.video is None:
        check_host(config.host)
    console = Console()
    try:
        return _watch(config, console) if config.log is None else _show(config, console)
    except (NoRendererError, ViewUnavailableError) as error:
        return Answer(ExitCode.UNFINISHED, error=str(error))


def _watch(config: ViewConfig, console: Console) -> Answer:
    """Explore, recorded, while people watch; the view stays open when the run is over."""
    planned = watched_plan(config.set, config.config, config.time_scale)
    check_drivers(planned.config.robot)
    earlier_run(planned.config.out, "explore", ())  # a log among another command's files would be taken for theirs
    make_folder(planned.config.out)
    planned = prepared(planned)
    attempt = Attempt(planned)
    controller = attempt.controller
    scene = replace(view_scene(planned), surface=surface_view(planned))
    with ExitStack() as shown:
        with doing(console, STARTING):
            live = LiveView(scene, config.host, config.port, live=controller.live, plan=PlanWatch(controller))
            view = shown.enter_context(live)
        _say_where(console, view.url, config.host)
        log, interrupted = log_writer(planned), False
        try:
            result = attempt.run((view.observe,), (log,))
        except KeyboardInterrupt as interruption:
            found = result_until(interruption)
            if found is None:
                raise
            result, interrupted = found, True
            say(console, ENDED)
        view.run_over()
        if not view.makes_surface:
            say(console, "The process that makes the map's surface has ended: the view goes on without it")
        with kept_if_interrupted(result), step_progress(console, STEPS) as tell:
            exploration = attempt.found(result, tell)
        answer = Answer(
            ExitCode.DONE if result.ending is Ending.DONE else ExitCode.UNFINISHED,
            outcome(exploration),
            figures_of(exploration),
            files=written(result, ()),
        )
        say(console, answer.outcome)
        if result.recording is not None and result.recording.path is not None:
            say(console, f"Log: {result.recording.path}; watch it again: palpate view {result.recording.path}")
        if interrupted:
            return replace(answer, exit_code=ExitCode.INTERRUPTED)
        _wait(view, console)
    return answer


def _check_folder(path: Path) -> None:
    """Refuse a file for which there is no folder, before time goes into drawing it."""
    if not path.parent.is_dir():
        raise InvalidValueError(f"{path}: there is no folder {path.parent}; make it, or choose another")


def _show(config: ViewConfig, console: Console) -> Answer:
    """Play a log, or draw it."""
    assert config.log is not None  # run_view has looked
    for path in (config.picture, config.video):
        if path is not None:
            _check_folder(path)
    log = read_log(log_in(config.log))
    planned = recorded_plan(log)
    scene, model = view_scene(planned), simulated_model(planned)
    if log.damage is not None:
        say(console, f"{log.path}: {log.damage}; what can be read is shown")
    frames = _frames(log, planned, console)
    if config.picture is not None:
        write_still(model, scene, frames, config.picture)
        say(console, f"Written: {config.picture}")
    if config.video is not None:
        count = write_video(model, scene, frames, config.video, config.time_scale)
        say(console, f"Written: {config.video}, {count} pictures")
    files = tuple(path for path in (config.picture, config.video) if path is not None)
    if files:
        return Answer(facts={"log": log.path}, files=files)
    plans: Sequence[PlanChange] = ()
    if isinstance(planned, ExplorationPlan):  # nothing else makes a map, or goes anywhere of its own
        plans = _plans(log, console)
        scene = replace(scene, surface=surface_view(planned))
    with ExitStack() as shown:
        with doing(console, STARTING):
            player = Player(scene, frames, config.time_scale, config.host, config.port, plans)
            shown.enter_context(player)
        _say_where(console, player.url, config.host)
        with suppress(KeyboardInterrupt):  # how a view is ended
            player.play()
    return Answer(facts={"log": log.path})


def _frames(log: Log, planned: ViewedPlan, console: Console) -> Frames:
    """What every period shows; of a grasp with the held object, as far as that can be told."""
    if not isinstance(planned, GraspPlan):
        return frames_of_log(log)
    if planned.hand.robot is not None:  # no simulation goes as wires, or a real hand, let it go
        say(console, f"{log.path}: no log says where the object was: it stands where it stood at the start")
        return frames_of_log(log)
    with doing(console, "working out where the object was"):
        held = held_poses(log, planned)
    if not held.known:
        say(
            console,
            f"{log.path}: where the object was is not shown: no log says it, and the simulation does not start as "
            "it did (another palpate, or another MuJoCo); it stands where it stood at the start",
        )
    elif not held.complete:
        last = log.rows[held.known - 1, log.codec.columns["time"]].item()
        say(
            console,
            f"{log.path}: where the object was is known until {last:.2f} s, for from there on the simulation does "
            "not go as it did (another MuJoCo, or periods are missing); afterwards it stands where it was last",
        )
    return frames_of_log(log, held.rows)


def _plans(log: Log, console: Console) -> Sequence[PlanChange]:
    """Where the tip was going, worked out again from the log; what cannot be is not shown."""
    try:
        with doing(console, "working out where the tip was going"):
            return plans_of_log(log)
    except InvalidValueError as error:
        say(console, f"{log.path}: the plan is not shown: {error}")
        return ()


def _wait(view: LiveView, console: Console) -> None:
    say(console, "The view stays open: Ctrl-C ends it")
    try:
        view.wait()
    except KeyboardInterrupt:
        return


def _say_where(console: Console, url: str, host: str) -> None:
    say(console, f"View: {url} (open it in a browser; Ctrl-C ends it)")
    if host not in (LOOPBACK, "localhost", "::1"):
        say(console, f"Everybody who reaches {host} can watch, press the view's buttons and move its sliders")
