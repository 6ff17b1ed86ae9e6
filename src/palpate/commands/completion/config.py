"""What `palpate completion` is to print; imports nothing heavy, so that `palpate --help` is quick."""

from dataclasses import dataclass
from typing import Annotated, Literal

import tyro

ShellName = Literal["bash", "zsh", "fish"]


@dataclass(frozen=True, slots=True)
class CompletionConfig:
    """Print a script that makes a shell complete commands, options and their values, robots and files.

    For bash, in ~/.bashrc:
    eval "$(palpate completion bash)"

    For zsh, in ~/.zshrc after compinit:
    eval "$(palpate completion zsh)"

    For fish, once:
    palpate completion fish > ~/.config/fish/completions/palpate.fish

    Print it anew after an update of palpate.

    Example: palpate completion bash > palpate-completion.bash
    """

    shell: Annotated[ShellName, tyro.conf.Positional, tyro.conf.arg(metavar="SHELL")]
    """bash, zsh or fish."""
