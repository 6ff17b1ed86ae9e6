"""Options of `palpate replay`; imports nothing heavy, so that `palpate --help` is quick."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from palpate.reporting.data import FigureKind

LogPlace = Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="LOG")]


@dataclass(frozen=True, slots=True)
class ReplayConfig:
    """Feed the log of a run through sensing, control and supervision again, and compare the commands.

    With nothing else given, every command must come out as recorded, bit for bit; if not, exit code 1 and the
    first difference. With --set or --controller commands may differ: a table and a report with figures show how.

    The samples stay as recorded, and no robot moves: a replay shows the commands at every instant of that run, not
    their consequences.

    Example: palpate replay runs/explore

    Example: palpate replay runs/regulate --set force=3 profile=constant

    Example: palpate replay runs/explore --set force=3 speed=0.03

    Example: palpate replay runs/explore/2026-11-21_02-30-05.mcap --controller mine:make
    """

    log: LogPlace
    """Log file (.mcap) of an experiment; a folder stands for its latest.mcap."""
    set: Annotated[tuple[str, ...], tyro.conf.arg(metavar="NAME=VALUE ...")] = ()
    """Other values for what sensing, control and supervision go by, named as the options of the experiment that
    recorded it, as force=3; what cannot be changed is refused with the reason. Several numbers with commas, as in
    tip=0.008,0.008,0.012."""
    controller: Annotated[str | None, tyro.conf.arg(metavar="MODULE:FUNCTION")] = None
    """Another controller: what this function returns when it is called with the run's plan. The module is looked
    for in the present folder first."""
    out: Annotated[Path | None, tyro.conf.arg(metavar="FOLDER")] = None
    """Folder for the report, made if need be. Left out: beside the log. It is named after the log."""
    figures: FigureKind | None = None
    """Write each figure of the report as a file, too, in the style of a paper, into the folder figures."""
