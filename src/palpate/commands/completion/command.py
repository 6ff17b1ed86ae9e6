"""`palpate completion`: the script for a shell."""

import sys
from collections.abc import Callable, Mapping

from palpate.commands.answer import Answer
from palpate.commands.completion.bash import bash_script
from palpate.commands.completion.config import CompletionConfig, ShellName
from palpate.commands.completion.described import Node
from palpate.commands.completion.fish import fish_script
from palpate.commands.completion.zsh import zsh_script

SCRIPTS: Mapping[ShellName, Callable[[Node], str]] = {
    "bash": bash_script,
    "zsh": zsh_script,
    "fish": fish_script,
}


def print_completion(config: CompletionConfig, root: Node) -> Answer:
    """Print the script for a shell.

    Args:
        config: Which shell.
        root: The command line.
    """
    script = SCRIPTS[config.shell](root)
    sys.stdout.write(script)
    return Answer(facts={"shell": config.shell, "script": script})
