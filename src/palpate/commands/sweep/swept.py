"""Which experiments a sweep can do, and what each has to tell about itself; imports nothing heavy."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import Any, Protocol, cast

from palpate.experiments.explore import options as explore_options
from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.friction import options as friction_options
from palpate.experiments.friction.config import FrictionConfig
from palpate.experiments.grasp import options as grasp_options
from palpate.experiments.grasp.config import GraspConfig
from palpate.experiments.kit.figure import Figure, FigureValue
from palpate.experiments.kit.option_words import option_unit
from palpate.experiments.regulate import options as regulate_options
from palpate.experiments.regulate.config import RegulateConfig


@dataclass(frozen=True, slots=True)
class Found:
    """What a run came to.

    Attributes:
        done: Whether it got to its end.
        ending: How it ended, in words.
        figures: By column.
    """

    done: bool
    ending: str
    figures: Mapping[str, FigureValue]


class Carrier(Protocol):
    """What carries out an experiment: a module of this package with these names."""

    FIGURES: tuple[Figure, ...]
    """Every figure of a run, in the order of the tables."""

    MERITS: tuple[str, ...]
    """Columns that matter most, the first ones first: shown are the two first ones that a sweep has."""

    SECONDS: float
    """Wall time that a simulated second takes, on one core of a computer of 2023 [s]."""

    def duration_of(self, config: Any) -> float:
        """Plan a run and return about how long it is, simulated [s].

        Raises:
            InvalidValueError: It cannot be realised.
        """
        ...

    def carry_out(self, config: Any, keep: bool) -> Found:
        """Do a run; with `keep`, write its report and log into the folder of the configuration."""
        ...


@dataclass(frozen=True, slots=True)
class Swept:
    """An experiment that a sweep can do.

    Attributes:
        name: As typed.
        kind: Its configuration.
        defaults: Returns the options that hold if only these words are typed.
        carrier_name: Of the module that carries it out, which takes seconds to import.
    """

    name: str
    kind: type[Any]
    defaults: Callable[[Sequence[str]], Any]
    carrier_name: str

    @property
    def carrier(self) -> Carrier:
        """What carries it out."""
        return cast("Carrier", import_module(self.carrier_name))

    def unit(self, option: str) -> str:
        """Return the unit of an option; empty if it has none."""
        return option_unit(self.name, option)


EXPERIMENTS: Mapping[str, Swept] = {
    swept.name: swept
    for swept in (
        Swept("explore", ExploreConfig, explore_options.default_options, "palpate.commands.sweep.explored"),
        Swept("regulate", RegulateConfig, regulate_options.default_options, "palpate.commands.sweep.regulated"),
        Swept("friction", FrictionConfig, friction_options.default_options, "palpate.commands.sweep.rubbed"),
        Swept("grasp", GraspConfig, grasp_options.default_options, "palpate.commands.sweep.grasped"),
    )
}
