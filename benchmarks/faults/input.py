"""Damaged files for every reader, and options that no robot can follow."""

import random
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

from fuzz.readers import READERS

from faults.kind import Domain, Kind, Moment, Verdict, Workshop

INPUTS = 40
"""Damaged inputs that a reader gets at each moment."""

LONGEST = 60.0
"""[s] for all of them, and for a command that is to be refused."""

IMPOSSIBLE = ("nan", "inf", "-inf", "1e308", "-1e308", "5e-324", "-1", "1e30", "", "ten", "0x10", "9" * 400)
"""What is typed where a number above 0 is meant."""

OPTIONS = (
    ("regulate", "--force"),
    ("regulate", "--duration"),
    ("regulate", "--stiffness"),
    ("regulate", "--landing-speed"),
    ("regulate", "--mount-mass"),
    ("regulate", "--tip"),
    ("explore", "--speed"),
    ("explore", "--spacing"),
    ("explore", "--width"),
    ("explore", "--force"),
    ("friction", "--force"),
    ("grasp", "--mass"),
)
"""Commands and options of which each gets one of these."""

FILES = (
    "",
    "\0" * 100,
    "palpate_robot: 1\n",
    "a: " * 1000,
    "[" * 5000,
    "&a [*a]\n",
    "\x1b[2J: 1\n",
    "backend: {kind: no:Such}",
)
"""What stands in a robot file that is none."""


@dataclass(frozen=True, slots=True)
class DamagedInput:
    """A reader gets damaged examples of what it reads.

    Attributes:
        reader: Its name.
    """

    reader: str

    def __call__(self, moment: Moment, workshop: Workshop) -> Verdict:
        """See `Trial`; the process that reads has limits of its own."""
        program = Path(__file__).resolve().parents[1] / "fuzz"
        words = [
            "--child",
            "--reader",
            self.reader,
            "--inputs",
            INPUTS,
            "--seconds",
            LONGEST,
            "--seed",
            moment.seed,
        ]
        done = subprocess.run([sys.executable, program, *map(str, words)], capture_output=True, text=True)
        broken = done.stderr.strip().splitlines()[-3:] or [f"exit code {done.returncode}"]
        return Verdict(done.stdout.strip()[-80:], tuple(broken) if done.returncode else ())


@dataclass(frozen=True, slots=True)
class ImpossibleOption:
    """A command is given what no robot can follow: refused in a sentence, nothing is written.

    Attributes:
        command: Which.
        option: Which of its options; empty: the robot file is nonsense.
    """

    command: str
    option: str

    def __call__(self, moment: Moment, workshop: Workshop) -> Verdict:
        """See `Trial`."""
        chance, out = random.Random(moment.seed), workshop.folder / "refused"
        if self.option:
            typed = [f"{self.option}={chance.choice(IMPOSSIBLE)}"]
        else:
            path = workshop.folder / "none.yaml"
            path.write_text(chance.choice(FILES))
            typed = [f"--robot={path}"]
        try:
            done = subprocess.run(
                [sys.executable, "-m", "palpate", self.command, *typed, "--out", out],
                capture_output=True,
                text=True,
                timeout=LONGEST,
            )
        except subprocess.TimeoutExpired:
            return Verdict("", (f"{typed[0][:60]} is not refused within {LONGEST:g} s",))
        shown, problems = done.stderr + done.stdout, []
        if done.returncode != 2:
            problems.append(f"exit code {done.returncode}, promised 2, for {typed[0][:60]}")
        if "Traceback" in shown:
            problems.append(f"a traceback for {typed[0][:60]}")
        if out.exists():
            problems.append("it wrote something")
        return Verdict(" ".join(shown.split())[-90:], tuple(problems))


KINDS = (
    *(Kind(f"damaged input: {name}", Domain.INPUT, DamagedInput(name)) for name in READERS),
    *(
        Kind(f"impossible {command} {option}", Domain.INPUT, ImpossibleOption(command, option))
        for command, option in OPTIONS
    ),
    *(
        Kind(f"impossible robot file for {command}", Domain.INPUT, ImpossibleOption(command, ""))
        for command in ("explore", "regulate", "friction", "grasp")
    ),
)
"""All of them."""
