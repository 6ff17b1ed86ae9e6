"""Kinds at random moments: tried one after the other, and counted."""

import json
import random
import sys
import time
import traceback
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from faults.kind import Kind, Moment, Verdict, Workshop


@dataclass(frozen=True, slots=True)
class Tried:
    """A kind at a moment, and what came of it.

    Attributes:
        kind: Its name.
        domain: Its domain.
        share: See `Moment`.
        seed: See `Moment`.
        seconds: That it took.
        reported: See `Verdict`.
        problems: See `Verdict`.
    """

    kind: str
    domain: str
    share: float
    seed: int
    seconds: float
    reported: str
    problems: tuple[str, ...]

    @property
    def right(self) -> bool:
        """Whether all is as it must be."""
        return not self.problems


def moments(seed: int, kind: Kind, count: int) -> list[Moment]:
    """Return the moments of a kind: the same for the same seed, whichever other kinds are tried."""
    chance = random.Random(f"{seed}/{kind.domain}/{kind.name}")
    return [Moment(chance.random(), chance.getrandbits(31)) for _ in range(count)]


def tried(
    kinds: Sequence[Kind], seed: int, count: int, workshop: Workshop, until: float = float("inf")
) -> Iterator[Tried]:
    """Try each kind at so many moments; the first moment of all before the second of any.

    Args:
        kinds: Domain by domain, for devices are started once for a domain.
        seed: Of the moments.
        count: Moments of each.
        workshop: Open.
        until: `time.monotonic` after which no further one is begun.
    """
    for index in range(count):
        domain = None
        for kind in kinds:
            if time.monotonic() > until:
                return
            if kind.domain is not domain:
                domain = kind.domain
                workshop.close_shared()
            moment = moments(seed, kind, index + 1)[-1]
            begun = time.monotonic()
            verdict = _verdict(kind, moment, workshop)
            yield Tried(
                kind.name,
                kind.domain.value,
                round(moment.share, 4),
                moment.seed,
                round(time.monotonic() - begun, 2),
                verdict.reported,
                verdict.problems,
            )


def _verdict(kind: Kind, moment: Moment, workshop: Workshop) -> Verdict:
    """Try it once; what escapes from the program under test is a problem, too."""
    try:
        return kind.trial(moment, workshop)
    except KeyboardInterrupt:
        raise
    except BaseException as error:
        last = traceback.extract_tb(error.__traceback__)[-1]
        where = f"{Path(last.filename).name}:{last.lineno}"
        return Verdict("", (f"{type(error).__name__} escaped at {where}: {' '.join(str(error).split())[:200]}",))


def written(path: Path, found: Sequence[Tried]) -> None:
    """Write what was found, one JSON object a line."""
    path.write_text("".join(json.dumps(asdict(each)) + "\n" for each in found), encoding="utf-8")


Progress = Callable[[Tried], None]


def say(each: Tried) -> None:
    """Name a failure at once."""
    if not each.right:
        sys.stderr.write(f"{each.domain}, {each.kind} (seed {each.seed}): {'; '.join(each.problems)}\n")
