"""Which experiments can be replayed from their logs, and how each of them is planned again."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from palpate.commands.replay.settings import Changeable
from palpate.errors import InvalidValueError
from palpate.experiments.explore.replay import EXPLORATION, planned_exploration
from palpate.experiments.friction.replay import RUBBING, planned_rubbing
from palpate.experiments.friction.text import FRICTION_TEXT
from palpate.experiments.grasp.replay import GRASPING, planned_grasp
from palpate.experiments.grasp.text import GRASP_TEXT
from palpate.experiments.kit.experiment_file import EXPERIMENT_TEXT
from palpate.experiments.regulate.file import REGULATION_TEXT
from palpate.experiments.regulate.replay import REGULATION, planned_regulation
from palpate.runtime import Controller, FingerDescription, Limits, Touch
from palpate.runtime.log import Log


class _Planned(Protocol):
    """What of any plan a replay needs."""

    @property
    def config(self) -> object:
        """What was asked for."""
        ...

    @property
    def limits(self) -> Limits:
        """For the supervisor."""
        ...

    def controller(self) -> Controller:
        """Return a fresh controller."""
        ...


class FingerPlan(_Planned, Protocol):
    """A plan for one finger."""

    @property
    def finger(self) -> FingerDescription:
        """For touch."""
        ...


@runtime_checkable
class HandPlan(_Planned, Protocol):
    """A plan for a hand."""

    @property
    def fingers(self) -> Sequence[FingerDescription]:
        """For touch, one per finger."""
        ...


ReplayablePlan = FingerPlan | HandPlan
"""What of a plan a replay needs."""


def touch_of(planned: ReplayablePlan) -> Touch:
    """Return fresh touch of all fingers that a plan has."""
    return Touch(*planned.fingers) if isinstance(planned, HandPlan) else Touch(planned.finger)


@dataclass(frozen=True, slots=True)
class LogKind:
    """One kind of experiment, as its logs tell it.

    Attributes:
        command: That recorded it.
        text: That its logs have, and no others.
        may: What a replay can change.
        plan: From a log's texts, and what is set otherwise, to the plan; raises InvalidValueError.
    """

    command: str
    text: str
    may: Changeable
    plan: Callable[[Mapping[str, str], Mapping[str, object]], ReplayablePlan]

    @property
    def experiment(self) -> str:
        """Its name: the command without the program's."""
        return self.command.removeprefix("palpate ")


KINDS = (
    LogKind("palpate explore", EXPERIMENT_TEXT, EXPLORATION, planned_exploration),
    LogKind("palpate regulate", REGULATION_TEXT, REGULATION, planned_regulation),
    LogKind("palpate friction", FRICTION_TEXT, RUBBING, planned_rubbing),
    LogKind("palpate grasp", GRASP_TEXT, GRASPING, planned_grasp),
)
"""Every experiment that can be replayed."""


def kind_of(log: Log) -> LogKind:
    """Return what a log is of.

    Raises:
        InvalidValueError: Of nothing that can be replayed.
    """
    for kind in KINDS:
        if kind.text in log.attachments:
            return kind
    commands = " or ".join(f"`{kind.command}`" for kind in KINDS)
    raise InvalidValueError(
        f"{log.path} is no log of {commands}: it has neither {' nor '.join(kind.text for kind in KINDS)}, so that "
        "nobody knows what sensed and controlled; palpate.runtime.replay replays any log, if you say what"
    )
