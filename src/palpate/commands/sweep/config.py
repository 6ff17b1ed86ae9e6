"""Options of `palpate sweep`; imports nothing heavy, so that `palpate --help` is quick."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from palpate.errors import InvalidValueError
from palpate.reporting.data import FigureKind

MOST_SEEDS, MOST_JOBS = 100_000, 10_000
"""Largest numbers of seeds and processes; more are a typing error."""


@dataclass(frozen=True, slots=True)
class SweepConfig:
    """Do an experiment for every combination of some options, each with several seeds; tables, figure and report.

    Each run is simulated by itself, several at a time, on this computer or on a ray cluster. It is one row of
    runs.csv: varied options, seed, outcome, and metrics with their units in the column names. A run that fails is
    a row with the reason, and does not affect other runs. Finished runs are always kept: the same command
    continues an interrupted sweep.

    Options that are varied or set have the names that `palpate EXPERIMENT --help` lists, without the dashes; mu
    stands for friction. All values are in SI units: metres, newtons, seconds.

    Example, 3 x 2 combinations with 5 seeds each:
    palpate sweep explore --vary speed=0.01,0.02,0.05 --vary friction=0.2,0.5 --seeds 5 --set force_noise=0.01

    Example, five forces evenly from 1 to 5 N, as a list of the planned runs:
    palpate sweep regulate --vary force=1:5:5 --set surface=sine --dry-run

    Example, texts, and options that are several numbers:
    palpate sweep explore --vary object=sphere,box --vary tip=[0.008],[0.008,0.008,0.012] --set strategy=spiral

    Example, on a ray cluster (pip install "palpate[cluster]"):
    palpate sweep grasp --vary offset=0:0.01:6 --seeds 20 --ray 10.0.0.1:6379
    """

    experiment: Annotated[str, tyro.conf.Positional, tyro.conf.arg(metavar="EXPERIMENT")]
    """Name of an experiment, or one of your own, as mine.py:Mine for the class Mine in mine.py."""
    vary: Annotated[
        tuple[tuple[str, ...], ...], tyro.conf.UseAppendAction, tyro.conf.arg(metavar="NAME=VALUES ...")
    ] = ()
    """An option and its values: `speed=0.01,0.02`, or `speed=0.01:0.05:5` for 5 values evenly from the first to
    the last. Several of them make every combination."""
    set: Annotated[
        tuple[tuple[str, ...], ...], tyro.conf.UseAppendAction, tyro.conf.arg(metavar="NAME=VALUE ...")
    ] = ()
    """Other options, the same in every run. They override --config."""
    seeds: int = 1
    """How many runs each combination has, with seeds 0, 1, 2 and so on (or from that of --set seed=...). Every
    combination has the same seeds."""
    config: Annotated[Path | None, tyro.conf.arg(metavar="FILE.YAML")] = None
    """Experiment file, as the experiment takes it: lines like `force: 3`, with the names of its options."""
    jobs: Annotated[int | None, tyro.conf.arg(metavar="N")] = None
    """How many runs at a time. Left out: as many as there are cores, or as the cluster has."""
    ray: Annotated[str | None, tyro.conf.arg(metavar="auto|local|ADDRESS")] = None
    """Run on a ray cluster: the one that this computer belongs to (auto), one of its own on this computer (local),
    or that at an address, as 10.0.0.1:6379 or ray://10.0.0.1:10001."""
    show: Annotated[tuple[str, ...], tyro.conf.arg(metavar="COLUMN ...")] = ()
    """Which metrics figure and report show, by their columns in runs.csv. Left out: the two that matter most."""
    keep_reports: bool = False
    """Write report and log of each run, too, into reports/NUMBER in the folder."""
    repeat_failed: bool = False
    """When a sweep continues: repeat failed runs."""
    dry_run: bool = False
    """Check everything, list the runs, and say about how long they take: run nothing, write nothing."""
    out: Annotated[Path | None, tyro.conf.arg(metavar="FOLDER")] = None
    """Folder for what comes out, made if need be. Left out: runs/sweep-EXPERIMENT."""
    figures: FigureKind | None = None
    """Write each figure of the report as a file, too, in the style of a paper, into the folder figures."""

    def __post_init__(self) -> None:
        if not 1 <= self.seeds <= MOST_SEEDS:
            raise InvalidValueError(f"seeds = {self.seeds}: must be from 1 to {MOST_SEEDS}")
        if self.jobs is not None and not 1 <= self.jobs <= MOST_JOBS:
            raise InvalidValueError(
                f"jobs = {self.jobs}: must be from 1 to {MOST_JOBS}; leave it out for all cores"
            )
        if self.ray is not None and not self.ray.strip():
            raise InvalidValueError("ray: write auto, local, or the address of a cluster, as 10.0.0.1:6379")

    @property
    def varied_words(self) -> tuple[str, ...]:
        """Words typed after every --vary."""
        return tuple(word for words in self.vary for word in words)

    @property
    def set_words(self) -> tuple[str, ...]:
        """Words typed after every --set."""
        return tuple(word for words in self.set for word in words)
