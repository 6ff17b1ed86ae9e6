"""What `palpate bench` is to measure; imports nothing heavy, so that `palpate --help` is quick."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro

from palpate.experiments.kit.config_checks import check_seed

StudyName = Literal["contact", "mapping", "friction", "control", "simulation", "grasp"]


@dataclass(frozen=True, slots=True)
class BenchConfig:
    """Measure speed against error on this computer: one study per topic, all in one report with pictures.

    contact: a contact from a wrench, by palpate, plain formulas and solvers, against contacts built to be known.
    mapping: a sphere from contacts on a cap. friction: ways to rub a surface. control: a force held on a surface
    that moves, the faster the harder. simulation: its time step. grasp: least forces of a grasp.

    Methods take turns, so that what else this computer does hits all of them: trust the ratios. Ctrl-C keeps the
    studies that are finished. Writes bench.html and bench.json (SI units) into the folder.

    Example: palpate bench contact grasp --quick
    """

    studies: Annotated[tuple[StudyName, ...], tyro.conf.Positional, tyro.conf.arg(metavar="STUDY ...")] = ()
    """contact, mapping, friction, control, simulation, grasp. Left out: all of them."""
    quick: bool = False
    """Fewer cases and repeats: a minute or two instead of ten, and less sure."""
    seed: int = 0
    """Of cases and noise: the same seed gives the same errors."""
    out: Annotated[Path, tyro.conf.arg(metavar="FOLDER")] = Path("runs/bench")
    """Folder for the report, made if need be."""

    def __post_init__(self) -> None:
        check_seed(self.seed)
