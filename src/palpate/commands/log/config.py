"""Options of `palpate log`; imports nothing heavy, so that `palpate --help` is quick."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

_LogPlace = Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="LOG")]


@dataclass(frozen=True, slots=True)
class LogInfoConfig:
    """Summarise the log of a run: duration, timing, events, gaps and damage.

    Every check sum is verified. The log of a run that was killed, or that still goes on, is read to its end.

    Example: palpate log info runs/demo
    """

    log: _LogPlace
    """Log file (.mcap); a folder stands for its latest.mcap."""


@dataclass(frozen=True, slots=True)
class LogRos2Config:
    """Write the log of a run as a bag of ROS 2, a folder that `ros2 bag play` takes.

    The bag holds all topics of the log: wrenches, joints, transforms, contacts and a map in standard types, and
    topics in palpate's own types, whose package examples/ros2/palpate_msgs is built by colcon. From a damaged log,
    or the log of a killed run, everything readable is written.

    Example: palpate log ros2 runs/demo --out bag
    """

    log: _LogPlace
    """Log file (.mcap); a folder stands for its latest.mcap."""
    out: Annotated[Path | None, tyro.conf.arg(metavar="FOLDER")] = None
    """New folder for the bag. Left out: beside the log, named as the log with _bag behind it."""


@dataclass(frozen=True, slots=True)
class LogExportConfig:
    """Write the log of a run, or all logs of a sweep, as one data set: an episode a run, a row a period.

    Names of columns end in their unit: SI throughout, contacts in the sensor frame, the arm in base coordinates.
    Periods that a log lacks leave a gap in `sequence`. docs/files.md lists the columns.

    Formats: csv (17 digits); parquet, hdf5 and lerobot (LeRobot dataset v3) keep every bit, but lerobot writes 0
    for numbers that are not finite. A format of your own is named as module:Class.

    Example: palpate log export runs/demo --to csv --out tables
    """

    log: _LogPlace
    """Log file (.mcap); a folder stands for its latest.mcap, or is that of a sweep made with --keep-reports."""

    to: Annotated[str, tyro.conf.arg(metavar="FORMAT")] = "csv"
    """Format: csv, hdf5, lerobot, parquet, one of an installed package, or module:Class."""

    out: Annotated[Path | None, tyro.conf.arg(metavar="FOLDER")] = None
    """Folder, made if need be. Left out: beside the log, named as the log; for a sweep, `dataset` in it."""
