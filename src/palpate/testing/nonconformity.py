"""Rules that a piece breaks: collected by a check, raised together."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from types import TracebackType
from typing import Self

from palpate.errors import InvalidValueError, PalpateError, shown


@dataclass(frozen=True, slots=True)
class Nonconformity:
    """One rule of a protocol that a piece breaks.

    Attributes:
        rule: Name of the rule.
        seen: Observed behaviour.
        expected: Expected behaviour.
        remedy: How to correct the piece.
    """

    rule: str
    seen: str
    expected: str
    remedy: str

    def __str__(self) -> str:
        """One line for the error message."""
        return f"{self.rule}: {self.seen}; expected {self.expected}; mend: {self.remedy}"


class ConformanceError(PalpateError, AssertionError):
    """A piece breaks rules of its protocol. The message lists all of them.

    Attributes:
        nonconformities: Broken rules.
    """

    def __init__(self, piece: str, nonconformities: Sequence[Nonconformity]) -> None:
        """Take the piece's name and the broken rules."""
        self.nonconformities = tuple(nonconformities)
        count = f"{len(self.nonconformities)} rule{'s' if len(self.nonconformities) > 1 else ''}"
        super().__init__("\n- ".join([f"{piece} breaks {count}:", *map(str, self.nonconformities)]))


class Inspection:
    """Collects nonconformities, the first of each rule; leaving its `with` block raises them.

    An exception raised by the piece is a broken rule, too; the other rules are still examined.
    """

    def __init__(self, piece: str) -> None:
        """Take the piece's name."""
        self._piece = piece
        self._found: dict[str, Nonconformity] = {}

    def require(self, holds: object, rule: str, seen: str, expected: str, remedy: str) -> bool:
        """Record a broken rule unless `holds`; return whether the rule holds."""
        if not holds:
            self._found.setdefault(rule, Nonconformity(rule, seen, expected, remedy))
        return bool(holds)

    def found(self, rule: str) -> bool:
        """Return whether a rule is broken."""
        return rule in self._found

    @contextmanager
    def part(self, doing: str) -> Iterator[None]:
        """Record an exception in the block as a broken rule, and continue after the block."""
        try:
            yield
        except Exception as error:
            seen = f"{doing}: {type(error).__name__}: {shown(str(error), 200)}"
            remedy = "raise only for what the protocol names, and only then"
            self.require(False, f"exceptions ({doing})", seen, "no exception", remedy)

    def refuses(
        self, what: str, call: Callable[..., object], *given: object, names: str = "", **named: object
    ) -> None:
        """Require that a call with a bad value raises `InvalidValueError`, whose message holds `names`."""
        try:
            call(*given, **named)
        except InvalidValueError as error:
            if names in str(error):
                return
            seen = f"{what} was refused with {shown(str(error), 120)}, which does not name it"
        except Exception as error:
            seen = f"{what} raised {type(error).__name__}: {shown(str(error), 120)}"
        else:
            seen = f"{what} was taken without a word"
        remedy = "check values where they come in, and name value, limit and remedy (`palpate.errors`)"
        self.require(False, "refusals", seen, "InvalidValueError, never a silent NaN", remedy)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Raise the broken rules.

        Raises:
            ConformanceError: If rules are broken.
        """
        if error is None and self._found:
            raise ConformanceError(self._piece, tuple(self._found.values()))
