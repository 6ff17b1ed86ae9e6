"""What `palpate log` is to do; imports nothing heavy, so that `palpate --help` is quick."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro

LogPlace = Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="LOG")]

TableFormat = Literal["csv", "parquet"]


@dataclass(frozen=True, slots=True)
class LogInfoConfig:
    """Summarise the log of a run: duration, timing, events, gaps and damage.

    Every check sum is checked. A log of a run that was killed, or that still goes on, is read as far as it goes.

    Example: palpate log info runs/demo
    """

    log: LogPlace
    """Log file (.mcap); a folder stands for its latest.mcap."""


@dataclass(frozen=True, slots=True)
class LogRos2Config:
    """Write the log of a run as a bag of ROS 2, a folder that `ros2 bag play` takes.

    It holds all topics of the log: wrenches, joints, transforms, contacts and a map, of types that every tool
    knows, and palpate's own, whose package examples/ros2/palpate_msgs is built by colcon. Of a log that is
    damaged, or whose run was killed, it is all that is whole.

    Example: palpate log ros2 runs/demo --out bag
    """

    log: LogPlace
    """Log file (.mcap); a folder stands for its latest.mcap."""
    out: Annotated[Path | None, tyro.conf.arg(metavar="FOLDER")] = None
    """New folder for the bag. Left out: named as the log with _bag behind it, beside it."""


@dataclass(frozen=True, slots=True)
class LogExportConfig:
    """Write the log of a run as tables: period (one row per control period), event and parameter.

    The header names every unit: SI throughout, contacts in the sensor frame, the arm in base coordinates. Numbers
    keep every digit (CSV: 17, nan and inf as such). Periods that the log has not got leave a gap in `sequence`.

    Example: palpate log export runs/demo --format csv --out tables
    """

    log: LogPlace
    """Log file (.mcap); a folder stands for its latest.mcap."""
    to: Annotated[TableFormat, tyro.conf.arg(name="format", aliases=("--to",))] = "csv"
    """CSV, or Parquet (which needs: pip install "palpate[parquet]")."""
    out: Annotated[Path | None, tyro.conf.arg(metavar="FOLDER")] = None
    """Folder for the tables, made if need be. Left out: named as the log, beside it."""
