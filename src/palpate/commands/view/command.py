"""`palpate view`: a run in the browser, live or from its log; or as pictures."""

from collections.abc import Sequence
from contextlib import ExitStack, suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

from rich.console import Console

from palpate.commands.command_result import CommandResult, ExitCode
from palpate.commands.progress import doing
from palpate.commands.run import earlier_run, kept_if_interrupted, tell
from palpate.commands.say import say
from palpate.commands.typed_values import set_options
from palpate.commands.view.config import ViewConfig
from palpate.commands.view.free_bodies import free_poses_in, free_poses_of
from palpate.commands.view.pictures import write_still, write_video
from palpate.commands.view.plan import plans_of_log, shown_scene, watched_backend
from palpate.commands.view.topics import HERE, play_log, port_of, print_address, tool_of
from palpate.errors import InvalidValueError
from palpate.experiments.kit.config_file import load_overlay
from palpate.experiments.kit.experiment import Experiment, Plan
from palpate.experiments.kit.from_log import LoggedRun
from palpate.experiments.kit.metric import metrics_of
from palpate.experiments.kit.output_folder import make_folder
from palpate.experiments.kit.recorded_run import RecordedRun
from palpate.experiments.kit.recording import log_writer, robot_notes, written
from palpate.experiments.kit.registry import experiment_named, experiment_names
from palpate.experiments.kit.run_report import run_report
from palpate.experiments.kit.script import plan_for
from palpate.interruption import requested
from palpate.runtime import result_until
from palpate.runtime.live import live_parameters_of
from palpate.runtime.log import Log, log_in, read_log
from palpate.runtime.shown_plan import PlanChange
from palpate.sim.render.gl import NoRendererError
from palpate.viewing import (
    USUAL_PORT,
    Frames,
    LiveView,
    Player,
    ViewScene,
    ViewUnavailableError,
    check_host,
    frames_of_log,
)
from palpate.viewing.live_topics import LiveTopics
from palpate.viewing.publisher import TopicViewer

OWN = {"config": "give it as --config FILE.YAML"}
"""What --set does not take, and what to type."""

STARTING = "starting the view"
"""Printed at once: the process that makes the map's surface, and the server, take seconds on a busy computer."""

ENDED = "Stopping: writing the log, and working out what was found (Ctrl-C again: stop without that)"
"""Printed at once after a Ctrl-C while it runs."""


def run_view(config: ViewConfig) -> CommandResult:
    """Show a run until Ctrl-C.

    Returns:
        What was written; unfinished if it cannot be shown, or the run did not finish, and interrupted if
        that was.

    Raises:
        InvalidValueError: The configuration cannot be realised, or there is no such log or experiment.
        OSError: The log cannot be read or written.
    """
    tool = tool_of(config)
    if config.picture is None and config.video is None and not config.rerun:
        check_host(config.host)
    console = Console()
    try:
        return _watch(config, tool, console) if config.log is None else _show(config, tool, console)
    except (NoRendererError, ViewUnavailableError) as error:
        return CommandResult(ExitCode.UNFINISHED, error=str(error))


def _watch(config: ViewConfig, tool: TopicViewer | None, console: Console) -> CommandResult:
    """Carry an experiment out, recorded, while people watch; the view stays open when the run is over."""
    if ":" not in config.what and config.what not in experiment_names():
        raise InvalidValueError(
            f"what = {config.what}: there is neither an experiment nor a folder of this name; experiments are "
            f"{', '.join(experiment_names())}; a run is named by its folder or its log (.mcap)"
        )
    experiment = experiment_named(config.what)
    asked = _asked(experiment, config)
    plan = plan_for(experiment, asked)
    if plan.robot is not None:
        plan.robot.file.backend.check_drivers()
    earlier_run(asked.out, experiment.name, ())  # a log among another command's files would be taken for theirs
    make_folder(asked.out)
    if plan.preparation:
        with doing(console, plan.preparation):
            plan = plan.prepared()
    run = RecordedRun(plan, watched_backend(plan, config.time_scale))
    with ExitStack() as shown:
        with doing(console, STARTING):
            view = _page(config, experiment, plan, run) if tool is None else _topics(config, tool, plan)
            shown.enter_context(view)
        _print_where(console, view.url, config.host, tool)
        log, interrupted = log_writer(experiment, plan, asked.out), False
        try:
            result = run.run((view.observe,), (log, *view.sinks))
        except KeyboardInterrupt as interruption:
            found_until = result_until(interruption)
            if found_until is None:
                raise
            result, interrupted = found_until, True
            say(console, ENDED)
        for note in view.run_over():
            say(console, note)
        with kept_if_interrupted(result), doing(console, "working out what was found"):
            found = experiment.evaluate(plan, run.recorded(result, progress=lambda step: say(console, step)))
            tell(console, plan, result, experiment.cloud(found))
        report = run_report(experiment, plan, found)
        done = result.done and report.reached
        command_result = CommandResult(
            ExitCode.DONE if done else ExitCode.UNFINISHED,
            report.outcome,
            metrics_of(experiment, found),
            facts={"ending": result.ending.value, "rest": result.rest},
            files=written(result, ()),
        )
        say(console, command_result.outcome)
        if result.recording is not None and result.recording.path is not None:
            say(console, f"Log: {result.recording.path}; watch it again: palpate view {result.recording.path}")
        if interrupted or requested() is not None:
            return replace(command_result, exit_code=ExitCode.INTERRUPTED)
        _wait(view, console)
    return command_result


def _page(config: ViewConfig, experiment: Experiment, plan: Plan, run: RecordedRun) -> LiveView:
    """Start palpate's own view of a run that is about to begin."""
    scene, controller = shown_scene(experiment, plan), run.controller
    return LiveView(
        scene,
        config.host,
        port_of(config, USUAL_PORT),
        live=live_parameters_of(controller),
        free_poses=free_poses_of(run.backend) if len(scene.placement.start.free) == 1 else None,
        plan=plan.shown_plan(controller),
    )


def _topics(config: ViewConfig, tool: TopicViewer, plan: Plan) -> LiveTopics:
    """Begin to send the topics of a run that is about to begin."""
    return LiveTopics(tool, robot_notes(plan), config.host, port_of(config, tool.port))


def _asked(experiment: Experiment, config: ViewConfig) -> Any:
    """Return the experiment's configuration; --set overrides --config."""
    kind = experiment.Config
    overlay = {} if config.config is None else load_overlay(config.config, experiment.name, kind)
    return kind(**overlay | set_options(config.set, kind, OWN))


def _check_folder(path: Path) -> None:
    """Refuse a file for which there is no folder, before time goes into drawing it."""
    if not path.parent.is_dir():
        raise InvalidValueError(f"{path}: there is no folder {path.parent}; make it, or choose another")


def _show(config: ViewConfig, tool: TopicViewer | None, console: Console) -> CommandResult:
    """Play a log, or draw it."""
    assert config.log is not None  # run_view has looked
    for path in (config.picture, config.video):
        if path is not None:
            _check_folder(path)
    log = read_log(log_in(config.log))
    if log.damage is not None:
        say(console, f"{log.path}: {log.damage}; what can be read is shown")
    if tool is not None:
        return play_log(config, tool, log, console)
    logged = LoggedRun.of(log)
    scene = shown_scene(logged.experiment, logged.plan())
    frames = _frames(log, scene, console)
    if config.picture is not None:
        write_still(scene, frames, config.picture)
        say(console, f"Written: {config.picture}")
    if config.video is not None:
        count = write_video(scene, frames, config.video, config.time_scale)
        say(console, f"Written: {config.video}, {count} pictures")
    files = tuple(path for path in (config.picture, config.video) if path is not None)
    if files:
        return CommandResult(facts={"log": log.path}, files=files)
    plans = _plans(logged, console)
    with ExitStack() as shown:
        with doing(console, STARTING):
            player = Player(scene, frames, config.time_scale, config.host, port_of(config, USUAL_PORT), plans)
            shown.enter_context(player)
        _print_where(console, player.url, config.host, tool)
        with suppress(KeyboardInterrupt):  # how a view is ended
            player.play()
    return CommandResult(facts={"log": log.path})


def _frames(log: Log, scene: ViewScene, console: Console) -> Frames:
    """What every period shows, with a body that moves freely or yields, if the log knows where it was.

    Of several bodies none is known: what a scene from a file has besides what is touched stands where it starts.
    """
    if len(scene.placement.start.free) != 1:
        return frames_of_log(log)
    poses = free_poses_in(log)
    if poses is None:
        say(console, f"{log.path}: no log has where the object was: it stands where it stood at the start")
    return frames_of_log(log, poses)


def _plans(logged: LoggedRun, console: Console) -> Sequence[PlanChange]:
    """Where the tip was going, worked out again from the log; what cannot be is not shown."""
    plan = logged.plan()
    if plan.shown_plan(plan.controller()) is None:
        return ()
    try:
        with doing(console, "working out where the tip was going"):
            return plans_of_log(logged)
    except InvalidValueError as error:
        say(console, f"{logged.log.path}: the plan is not shown: {error}")
        return ()


def _wait(view: LiveView | LiveTopics, console: Console) -> None:
    say(console, "The view stays open: Ctrl-C ends it")
    try:
        view.wait()
    except KeyboardInterrupt:
        return


def _print_where(console: Console, url: str, host: str, tool: TopicViewer | None) -> None:
    if tool is not None:
        print_address(console, tool, url, host)
        return
    say(console, f"View: {url} (open it in a browser; Ctrl-C ends it)")
    if host not in HERE:
        say(console, f"Everybody who reaches {host} with this address can watch, press buttons and move sliders")
