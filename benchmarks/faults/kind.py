"""A kind of fault, how it is tried at a moment, and what came of it."""

import tempfile
from contextlib import AbstractContextManager, ExitStack
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from types import TracebackType
from typing import Protocol, Self, TypeVar

Resource = TypeVar("Resource")


class Domain(StrEnum):
    """Where a fault comes from."""

    PROCESS = "process"
    RESOURCE = "resource"
    PROTOCOL = "protocol"
    SUPERVISION = "supervision"
    INPUT = "input"
    NETWORK = "network"


@dataclass(frozen=True, slots=True)
class Moment:
    """When a fault comes, and what else of it is random.

    Attributes:
        share: Of the time of a run that is over by then, from 0 to below 1.
        seed: For everything else.
    """

    share: float
    seed: int


@dataclass(frozen=True, slots=True)
class Verdict:
    """What came of a fault.

    Attributes:
        reported: What palpate says of it: ending, exit code, message.
        problems: What is not as it must be, a clause each; none if all is right.
    """

    reported: str
    problems: tuple[str, ...] = ()


class Workshop:
    """What trials share: folders, a stranger's robot, and devices that are started once. A context manager."""

    def __init__(self, robot: str | None = None) -> None:
        """Open nothing yet.

        Args:
            robot: Name or file of a robot, or `module:factory` of a `Robot`; None: those that each trial has.
        """
        self.robot = robot
        self._own, self._devices = ExitStack(), ExitStack()
        self._shared: dict[object, object] = {}

    def __enter__(self) -> Self:
        self.folder = Path(self._own.enter_context(tempfile.TemporaryDirectory(prefix="faults-")))
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close_shared()
        self._own.close()

    def shared(self, made: AbstractContextManager[Resource], key: object) -> Resource:
        """Return what is open under a key already; else open it, until the end."""
        if key not in self._shared:
            self._shared[key] = self._devices.enter_context(made)
        return self._shared[key]  # type: ignore[return-value]

    def close_shared(self) -> None:
        """Close what is shared: another domain wants the computer for itself."""
        self._shared.clear()
        self._devices.close()


class Trial(Protocol):
    """Brings a fault about and judges what comes of it; may be called any number of times."""

    def __call__(self, moment: Moment, workshop: Workshop) -> Verdict:
        """Try it once."""
        ...


@dataclass(frozen=True, slots=True)
class Kind:
    """One line of the table.

    Attributes:
        name: Unique.
        domain: Where it comes from.
        trial: How it is tried.
        anywhere: Whether it can be tried on a stranger's robot, too.
    """

    name: str
    domain: Domain
    trial: Trial = field(repr=False)
    anywhere: bool = False
