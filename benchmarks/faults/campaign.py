"""Campaign of faults at random moments, and its command line."""

import json
import random
import sys
import time
import traceback
from collections import Counter, defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from harness.campaign import Listing, tracked
from harness.command import parser_of
from rich.console import Console

from faults.kind import Domain, Kind, Moment, Verdict, Workshop
from faults.table import KINDS


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


def tried(kinds: Sequence[Kind], seed: int, count: int, workshop: Workshop) -> Iterator[Tried]:
    """Try each kind at so many moments; the first moment of all before the second of any.

    Args:
        kinds: Domain by domain, for devices are started once for a domain.
        seed: Of the moments.
        count: Moments of each.
        workshop: Open.
    """
    for index in range(count):
        domain = None
        for kind in kinds:
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


def say(each: Tried, path: Path | None) -> None:
    """Name a failure at once; append the try to a file of JSON lines (-: print it)."""
    if not each.right:
        sys.stderr.write(f"{each.domain}, {each.kind} (seed {each.seed}): {'; '.join(each.problems)}\n")
    if path is not None:
        line = json.dumps(asdict(each)) + "\n"
        if str(path) == "-":
            sys.stdout.write(line)
        else:
            with path.open("a", encoding="utf-8") as file:
                file.write(line)


SHOWN = 3
"""Different problems of a kind that the table shows."""


def main(explanation: str | None = None) -> int:
    """Try what was asked for, print what came of it; return 1 if anything was not right."""
    parser = parser_of(explanation)
    parser.add_argument("--list", action="store_true", help="name the kinds, and end")
    parser.add_argument("--kinds", default="", help="domains, or words that are in a kind's name; all if left out")
    parser.add_argument("--moments", type=int, default=1, help="of each kind")
    parser.add_argument("--seed", type=int, default=0, help="of the moments")
    parser.add_argument("--robot", help="name, robot file, or module:factory")
    parser.add_argument("--search", type=int, default=0, metavar="TRIES", help="instead: search for the worst")
    parser.add_argument("--json", type=Path, help="write what came of each try, one JSON object a line; - prints")
    asked = parser.parse_args()
    kinds = chosen(asked.kinds, anywhere=asked.robot is not None)
    if asked.list:
        for kind in kinds:
            print(f"{kind.domain:12} {kind.name}{'  (anywhere)' if kind.anywhere else ''}")
        return 0
    if not kinds:
        parser.error(f"--kinds {asked.kinds!r}: none has these words; --list names them all")
    if asked.search:
        from faults.search import searched  # builds scenes

        return searched(asked.search, asked.seed)
    found = list[Tried]()
    with Workshop(asked.robot) as workshop:
        try:
            tries = tried(kinds, asked.seed, asked.moments, workshop)
            for each in tracked(tries, len(kinds) * asked.moments, "faults"):
                found.append(each)
                say(each, asked.json)
        except KeyboardInterrupt:
            sys.stderr.write("Interrupted: what was tried until then is below.\n")
    return int(not all(each.right for each in found)) if str(asked.json) == "-" else summary(found)


def chosen(words: str, *, anywhere: bool) -> list[Kind]:
    """Return the kinds of these domains, or with these words in their names."""
    asked = words.split()
    domains = {Domain(word) for word in asked if word in list(Domain)}
    return [
        kind
        for kind in KINDS
        if (kind.anywhere or not anywhere)
        and (not asked or (kind.domain in domains if len(domains) == len(asked) else words in kind.name))
    ]


def summary(found: Sequence[Tried]) -> int:
    """Print the failures and the counts; return 1 if there is a failure."""
    console = Console(width=160)
    wrong = defaultdict(list)
    for each in found:
        if not each.right:
            wrong[each.domain, each.kind].append(each)
    rows = []
    for (domain, kind), those in wrong.items():
        problems = Counter(problem for each in those for problem in each.problems)
        tries = sum(each.kind == kind for each in found)
        what = "; ".join(problem for problem, _ in problems.most_common(SHOWN))
        seeds = " ".join(str(each.seed) for each in those[:SHOWN])
        rows.append((domain, kind, f"{len(those)} of {tries}", what, seeds))
    if rows:
        console.print(Listing("failures", ("domain", "kind", "wrong", "what", "seeds"), rows).printed())
    rows = []
    for domain in Domain:
        those = [each for each in found if each.domain == domain.value]
        if those:
            right, spent = sum(each.right for each in those), sum(each.seconds for each in those)
            rows.append((domain.value, len({one.kind for one in those}), len(those), right, f"{spent:.0f}"))
    console.print(Listing("faults", ("domain", "kinds", "tries", "right", "s"), rows).printed())
    kinds, right = len({each.kind for each in found}), sum(each.right for each in found)
    console.print(f"{kinds} kinds, {len(found)} tries, {right} right")
    return int(right < len(found))
