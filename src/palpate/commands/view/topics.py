"""`palpate view` with a program of others: which, and a recorded run sent to it."""

from contextlib import suppress
from time import sleep

from rich.console import Console

from palpate.commands.command_result import CommandResult
from palpate.commands.say import say
from palpate.commands.view.config import ViewConfig
from palpate.experiments.kit.from_log import LoggedRun
from palpate.experiments.kit.recording import robot_notes
from palpate.runtime.log import Log
from palpate.viewing import LOOPBACK
from palpate.viewing.live_topics import play_topics
from palpate.viewing.publisher import TopicViewer
from palpate.viewing.topic_viewers import FOXGLOVE, RERUN

HERE = (LOOPBACK, "localhost", "::1")
"""Names of this computer that no other one reaches."""


def tool_of(config: ViewConfig) -> TopicViewer | None:
    """Return the program that is to show a run; None for palpate's own page.

    Raises:
        MissingLibraryError: It cannot be reached for want of a library.
    """
    for tool, asked, option in ((FOXGLOVE, config.foxglove, "--foxglove"), (RERUN, config.rerun, "--rerun")):
        if asked:
            tool.check(f"palpate view {option}")
            return tool
    return None


def port_of(config: ViewConfig, usual: int) -> int:
    """Return the port that was asked for, or the usual one."""
    return usual if config.port is None else config.port


def print_address(console: Console, tool: TopicViewer, url: str, host: str) -> None:
    """Print where topics are sent."""
    say(console, f"{tool.name}: {url} ({tool.hint}; Ctrl-C ends it)")
    if tool is FOXGLOVE and host not in HERE:
        say(console, f"Everybody who reaches {host} can watch; nobody can press buttons or move sliders")


def play_log(config: ViewConfig, tool: TopicViewer, log: Log, console: Console) -> CommandResult:
    """Send a recorded run as it was, and stay until Ctrl-C.

    Raises:
        InvalidValueError: The log is of no experiment.
        ViewUnavailableError: The port is taken, or there is no viewer.
    """
    notes = robot_notes(LoggedRun.of(log).plan())
    publisher = tool.publisher(config.host, port_of(config, tool.port))
    try:
        print_address(console, tool, publisher.url, config.host)
        with suppress(KeyboardInterrupt):  # how a view is ended
            play_topics(publisher, log, notes, config.time_scale)
            say(console, "The run is over; Ctrl-C ends the view")
            while True:
                sleep(1.0)
    finally:
        publisher.close()
    return CommandResult(facts={"log": log.path})
