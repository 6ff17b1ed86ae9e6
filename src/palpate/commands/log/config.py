"""What `palpate log` is to do; imports nothing heavy, so that `palpate --help` is quick."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

LogPlace = Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="LOG")]


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
    """Write the log of a run, or all logs of a sweep, as one data set: an episode a run, a row a period.

    Names tell every unit: SI throughout, contacts in the sensor frame, the arm in base coordinates. Periods that a
    log has not got leave a gap in `sequence`. Which columns there are: docs/files.md.

    Formats: csv (17 digits); parquet, hdf5 and lerobot (LeRobot dataset v3) keep every bit, but in lerobot what is
    not a finite number is 0. One of your own is named as module:Class.

    Example: palpate log export runs/demo --to csv --out tables
    """

    log: LogPlace
    """Log file (.mcap); a folder stands for its latest.mcap, or is a sweep's made with --keep-reports."""

    to: Annotated[str, tyro.conf.arg(metavar="FORMAT")] = "csv"
    """Format: csv, hdf5, lerobot, parquet, one of an installed package, or module:Class."""

    out: Annotated[Path | None, tyro.conf.arg(metavar="FOLDER")] = None
    """Folder, made if need be. Left out: named as the log, beside it; of a sweep, `dataset` in it."""
