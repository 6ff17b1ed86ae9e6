"""`palpate view`: a run in the browser or in another program, live or from its log; or as images."""

from collections.abc import Sequence
from contextlib import ExitStack, closing, suppress
from dataclasses import replace
from time import sleep
from typing import Any

from rich.console import Console

from palpate.commands.command_result import CommandResult, ExitCode
from palpate.commands.run import earlier_run, kept_if_interrupted, tell
from palpate.commands.typed_values import set_options
from palpate.commands.view.config import ViewConfig
from palpate.commands.view.scene import (
    free_poses_in,
    free_poses_of,
    plans_of_log,
    shown_scene,
    write_still,
    write_video,
)
from palpate.errors import InvalidValueError
from palpate.experiments.kit.checks import make_folder
from palpate.experiments.kit.config_file import load_overlay
from palpate.experiments.kit.experiment import Experiment, Plan
from palpate.experiments.kit.from_log import LoggedRun
from palpate.experiments.kit.metric import metrics_of
from palpate.experiments.kit.recorded_run import RecordedRun
from palpate.experiments.kit.recording import log_writer, robot_notes, written
from palpate.experiments.kit.registry import experiment_named, experiment_names
from palpate.experiments.kit.run_report import run_report
from palpate.experiments.kit.script import plan_for
from palpate.interruption import requested
from palpate.runtime import Backend, Command, Pacer, Sample, result_until
from palpate.runtime.live import live_parameters_of
from palpate.runtime.log import log_in, read_log
from palpate.runtime.pacing import SimulatedTime
from palpate.runtime.progress import doing, say
from palpate.runtime.real_time import RealTime
from palpate.runtime.shown_plan import PlanChange
from palpate.runtime.wrapped_backend import WrappedBackend
from palpate.sim.render.gl import NoRendererError
from palpate.viewing import (
    LOOPBACK,
    USUAL_PORT,
    LiveView,
    Player,
    ViewUnavailableError,
    check_host,
    frames_of_log,
)
from palpate.viewing.live_topics import LiveTopics, play_topics
from palpate.viewing.publisher import TopicViewer
from palpate.viewing.topic_viewers import FOXGLOVE, RERUN

_LOOPBACK_NAMES = (LOOPBACK, "localhost", "::1")
_STARTING = "starting the view"
"""Printed at once: the process that makes the map's surface, and the server, take seconds on a busy computer."""


def run_view(config: ViewConfig) -> CommandResult:
    """Show a run until Ctrl-C.

    Returns:
        Files that were written; unfinished if the run cannot be shown or did not finish, interrupted after Ctrl-C
        in a run.

    Raises:
        InvalidValueError: If the configuration cannot be realised, or there is no such log or experiment.
        MissingLibraryError: If a library for Foxglove or rerun is not installed.
        OSError: If the log cannot be read or written.
    """
    tool = FOXGLOVE if config.foxglove else RERUN if config.rerun else None
    if tool is not None:
        tool.check(f"palpate view --{'foxglove' if config.foxglove else 'rerun'}")
    if not (config.picture or config.video or config.rerun):
        check_host(config.host)
    console = Console()
    try:
        return _watch(config, tool, console) if config.log is None else _show(config, tool, console)
    except (NoRendererError, ViewUnavailableError) as error:
        return CommandResult(ExitCode.UNFINISHED, error=str(error))


def _watch(config: ViewConfig, tool: TopicViewer | None, console: Console) -> CommandResult:
    """Carry an experiment out, recorded, while it is watched; the view stays open when the run is over."""
    if ":" not in config.what and config.what not in experiment_names():
        raise InvalidValueError(
            f"what = {config.what}: there is neither an experiment nor a folder of this name; experiments are "
            f"{', '.join(experiment_names())}; a run is named by its folder or its log (.mcap)"
        )
    experiment = experiment_named(config.what)
    run_config = _run_config(experiment, config)
    plan = plan_for(experiment, run_config)
    if plan.robot is not None:
        plan.robot.file.backend.check_drivers()
    # a log among another command's files would be taken for one of theirs
    earlier_run(run_config.out, experiment.name, ())
    make_folder(run_config.out)
    if plan.preparation:
        with doing(console, plan.preparation):
            plan = plan.prepared()
    run = RecordedRun(plan, watched_backend(plan, config.time_scale))
    with ExitStack() as shown:
        with doing(console, _STARTING):
            view = _live_view(config, tool, experiment, plan, run)
            shown.enter_context(view)
        _print_address(console, view.url, config.host, tool)
        log, interrupted = log_writer(experiment, plan, run_config.out), False
        try:
            result = run.run((view.observe,), (log, *view.sinks))
        except KeyboardInterrupt as interruption:
            until = result_until(interruption)
            if until is None:
                raise
            result, interrupted = until, True
            say(console, "Stopping: writing and evaluating the log (Ctrl-C again: stop without the evaluation)")
        for note in view.run_over():
            say(console, note)
        with kept_if_interrupted(result), doing(console, "evaluating the run"):
            found = experiment.evaluate(plan, run.recorded(result, progress=lambda step: say(console, step)))
            tell(console, plan, result, experiment.cloud(found))
        report = run_report(experiment, plan, found)
        answer = CommandResult(
            ExitCode.DONE if result.done and report.reached else ExitCode.UNFINISHED,
            report.outcome,
            metrics_of(experiment, found),
            facts={"ending": result.ending.value, "rest": result.rest},
            files=written(result, ()),
        )
        say(console, answer.outcome)
        if result.recording is not None and result.recording.path is not None:
            say(console, f"Log: {result.recording.path}; watch it again: palpate view {result.recording.path}")
        if interrupted or requested() is not None:
            return replace(answer, exit_code=ExitCode.INTERRUPTED)
        say(console, "The view stays open: Ctrl-C ends it")
        with suppress(KeyboardInterrupt):
            view.wait()
    return answer


class PacedBackend(WrappedBackend[Backend]):
    """A simulation at a multiple of its real speed; an infinite multiple: as fast as it can be computed."""

    def __init__(self, backend: Backend, time_scale: float) -> None:
        """Take the simulation, and its seconds per second of wall time."""
        super().__init__(backend)
        self._pacer = SimulatedTime() if time_scale == float("inf") else RealTime(backend.period / time_scale)

    @property
    def pacer(self) -> Pacer:
        """See `Backend`."""
        return self._pacer

    def step(self, command: Command) -> Sample:
        """See `Backend`."""
        sample = self.backend.step(command)
        self._pacer.wait()
        return sample


def watched_backend(plan: Plan, time_scale: float) -> Backend:
    """Return the back end of a run that is to be watched.

    Args:
        plan: Plan of the run.
        time_scale: Seconds of the run per second of wall time.

    Raises:
        InvalidValueError: If the plan cannot be realised, or the robot keeps real time and the scale is not 1.
    """
    backend = plan.backend()
    if isinstance(backend.pacer, SimulatedTime):
        return PacedBackend(backend, time_scale)
    if time_scale != 1.0:
        raise InvalidValueError(f"time_scale = {time_scale:g}: this robot keeps real time; leave it out")
    return backend


def _live_view(
    config: ViewConfig, tool: TopicViewer | None, experiment: Experiment, plan: Plan, run: RecordedRun
) -> LiveView | LiveTopics:
    """Start palpate's own page, or the topics for another program, of a run that is about to begin."""
    if tool is not None:
        return LiveTopics(tool, robot_notes(plan), config.host, _port(config, tool.port))
    scene, controller = shown_scene(experiment, plan), run.controller
    return LiveView(
        scene,
        config.host,
        _port(config, USUAL_PORT),
        live=live_parameters_of(controller),
        free_poses=free_poses_of(run.backend) if len(scene.placement.start.free) == 1 else None,
        plan=plan.shown_plan(controller),
    )


def _port(config: ViewConfig, default: int) -> int:
    return default if config.port is None else config.port


def _run_config(experiment: Experiment, config: ViewConfig) -> Any:
    """Return the experiment's configuration; --set overrides --config."""
    kind = experiment.Config
    overlay = {} if config.config is None else load_overlay(config.config, experiment.name, kind)
    return kind(**overlay | set_options(config.set, kind, {"config": "give it as --config FILE.YAML"}))


def _show(config: ViewConfig, tool: TopicViewer | None, console: Console) -> CommandResult:
    """Play a log, or draw it."""
    assert config.log is not None  # otherwise there is an experiment to be watched
    for path in (config.picture, config.video):
        if path is not None and not path.parent.is_dir():  # before time goes into drawing
            raise InvalidValueError(f"{path}: there is no folder {path.parent}; make it, or choose another")
    log = read_log(log_in(config.log))
    if log.damage is not None:
        say(console, f"{log.path}: {log.damage}; what can be read is shown")
    logged = LoggedRun.of(log)
    answer = CommandResult(facts={"log": log.path})
    if tool is not None:
        _play_topics(config, tool, logged, console)
        return answer
    scene = shown_scene(logged.experiment, logged.plan())
    poses = None
    if len(scene.placement.start.free) == 1:  # the log records the pose of one body; others stand where they start
        poses = free_poses_in(log)
        if poses is None:
            say(console, f"{log.path}: the log does not record the object's pose; it is shown where it started")
    frames = frames_of_log(log) if poses is None else frames_of_log(log, poses)
    if config.picture is not None:
        write_still(scene, frames, config.picture)
        say(console, f"Written: {config.picture}")
    if config.video is not None:
        count = write_video(scene, frames, config.video, config.time_scale)
        say(console, f"Written: {config.video}, {count} images")
    files = tuple(path for path in (config.picture, config.video) if path is not None)
    if files:
        return replace(answer, files=files)
    plans = _plans(logged, console)
    with ExitStack() as shown:
        with doing(console, _STARTING):
            player = Player(scene, frames, config.time_scale, config.host, _port(config, USUAL_PORT), plans)
            shown.enter_context(player)
        _print_address(console, player.url, config.host, tool)
        with suppress(KeyboardInterrupt):  # how a view is ended
            player.play()
    return answer


def _play_topics(config: ViewConfig, tool: TopicViewer, logged: LoggedRun, console: Console) -> None:
    """Send a recorded run to another program, and stay until Ctrl-C.

    Raises:
        ViewUnavailableError: If the port is taken, or there is no viewer.
    """
    notes = robot_notes(logged.plan())
    with closing(tool.publisher(config.host, _port(config, tool.port))) as publisher:
        _print_address(console, publisher.url, config.host, tool)
        with suppress(KeyboardInterrupt):  # how a view is ended
            play_topics(publisher, logged.log, notes, config.time_scale)
            say(console, "The run is over; Ctrl-C ends the view")
            while True:
                sleep(1.0)


def _plans(logged: LoggedRun, console: Console) -> Sequence[PlanChange]:
    """Return the paths that the tip followed, computed again from the log; none if the log cannot be replayed."""
    plan = logged.plan()
    if plan.shown_plan(plan.controller()) is None:
        return ()
    try:
        with doing(console, "computing the planned path"):
            return plans_of_log(logged)
    except InvalidValueError as error:
        say(console, f"{logged.log.path}: the plan is not shown: {error}")
        return ()


def _print_address(console: Console, url: str, host: str, tool: TopicViewer | None) -> None:
    name, hint = ("View", "open it in a browser") if tool is None else (tool.name, tool.hint)
    say(console, f"{name}: {url} ({hint}; Ctrl-C ends it)")
    if host in _LOOPBACK_NAMES or tool is RERUN:
        return
    if tool is None:
        say(console, f"Everyone who reaches {host} with this address can watch, press buttons and move sliders")
    else:
        say(console, f"Everyone who reaches {host} can watch, but not press buttons or move sliders")
