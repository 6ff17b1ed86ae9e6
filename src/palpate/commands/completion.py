"""Completion of the command line in a shell, by tyro's own scripts; imports nothing heavy."""

import io
from contextlib import redirect_stdout, suppress
from dataclasses import dataclass
from typing import Annotated, Any, Literal

import tyro

ShellName = Literal["bash", "zsh", "fish"]

BASH_FILES = """
_palpate() { _tyro_palpate; [[ -n ${COMPREPLY[*]} ]] || COMPREPLY=(); }
complete -o default -F _palpate palpate
"""
"""Bash completes file names where tyro's script has no completion."""


@dataclass(frozen=True, slots=True)
class CompletionConfig:
    """Print a script that makes a shell complete commands, options, their choices, and files.

    For bash, in ~/.bashrc:
    eval "$(palpate completion bash)"

    For zsh, in a folder of $fpath, as ~/.zfunc:
    palpate completion zsh > ~/.zfunc/_palpate

    For fish, once:
    palpate completion fish > ~/.config/fish/completions/palpate.fish

    Print the script again after an update of palpate.

    Example: palpate completion bash > palpate-completion.bash
    """

    shell: Annotated[ShellName, tyro.conf.Positional, tyro.conf.arg(metavar="SHELL")]
    """bash, zsh or fish."""


def completion_script(commands: Any, shell: ShellName) -> str:
    """Return the script for a shell.

    Args:
        commands: Command line as the type that tyro reads.
        shell: Shell that runs the script.
    """
    script = io.StringIO()
    with redirect_stdout(script), suppress(SystemExit):  # tyro prints and leaves
        tyro.cli(commands, prog="palpate", args=["--tyro-write-completion", shell, "-"])
    return script.getvalue() + (BASH_FILES if shell == "bash" else "")
