"""Emulated devices in the foreground, until Ctrl-C."""

import os
from collections.abc import Iterable, Mapping
from types import FrameType

from rich.console import Console

from palpate.commands.command_result import CommandResult
from palpate.commands.say import say
from palpate.errors import InvalidValueError
from palpate.hw.emulators.host import Host
from palpate.interruption import handling, note

TOKEN_VARIABLE = "PALPATE_CONTROL_TOKEN"
"""Of the environment: the token of a program that chooses it, as it chooses the port."""

SHORTEST_TOKEN = 16
"""Characters: 64 bits, if they are random hexadecimal digits."""


def served(
    console: Console, host: Host, instructions: Iterable[str], facts: Mapping[str, object]
) -> CommandResult:
    """Say how to use emulated devices, and serve them until a signal that ends a process."""

    def stop(number: int, frame: FrameType | None) -> None:
        note(number)
        host.stop()

    with handling(stop):
        for line in instructions:
            say(console, line)
        say(console, "Runs until Ctrl-C.")
        host.run()
    say(console, "Ended.")
    return CommandResult(outcome="Ended.", facts=facts)


def how_to_switch(fault: str) -> str:
    """Return how faults are switched, from the words of one."""
    return f"Faults: palpate emulate fault {fault}"


def chosen_token() -> str | None:
    """Return the token that whoever starts us has chosen; the environment, unlike options, is not for all to see.

    Raises:
        InvalidValueError: It is short enough to be guessed.
    """
    token = os.environ.get(TOKEN_VARIABLE)
    if token is not None and len(token) < SHORTEST_TOKEN:
        raise InvalidValueError(
            f"{TOKEN_VARIABLE}: {len(token)} characters can be guessed; take {SHORTEST_TOKEN} or more, or unset it"
        )
    return token
