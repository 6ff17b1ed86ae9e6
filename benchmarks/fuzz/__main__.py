"""Damaged and hostile inputs to every reader: refused in one sentence, within bounds of memory and time.

    python benchmarks/fuzz [--inputs 20000] [--seconds 60] [--seed 0] [--reader NAME]

Valid examples of every format are damaged with knowledge of the format: bits, lengths, counts, numbers, nesting,
repetition, splices; records of a log with corrected check sums. Each reader has a process of its own with a limit
on its memory. Required: a value or one sentence of a PalpateError, at most 300 MB above the start of the process
and 2 s of processor time each. Ends with 1 if an input breaks that, and prints its seed.
"""

import argparse
import resource
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from rich.console import Console
from rich.table import Table

from palpate.errors import PalpateError

BENCHMARKS = Path(__file__).resolve().parents[1]
sys.path[:1] = [str(BENCHMARKS), str(BENCHMARKS.parent / "tests")]

from fuzz.damage import damaged  # noqa: E402
from fuzz.readers import READERS  # noqa: E402

MOST_MEMORY, MOST_TIME, HANGS = 300.0, 2.0, 20
"""[MB] above the start, [s] of an input, and [s] after which it counts as hung."""


def main() -> int:
    """Damage and read; return 1 if anything but a value or a PalpateError came."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--inputs", type=int, default=20_000, help="at most, for each reader")
    parser.add_argument("--seconds", type=float, default=60.0, help="at most, for each reader")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--reader", choices=READERS)
    parser.add_argument("--child", action="store_true", help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.child:
        return fuzz(asked.reader, asked.inputs, asked.seconds, asked.seed)
    table = Table("reader", "inputs", "taken", "refused", "per s", "longest s", "peak MB", "broken")
    total, broken = 0, False
    for name in [asked.reader] if asked.reader else READERS:
        words = ["--inputs", asked.inputs, "--seconds", asked.seconds, "--seed", asked.seed, "--reader", name]
        done = subprocess.run(
            [sys.executable, __file__, "--child", *map(str, words)], stdout=subprocess.PIPE, text=True
        )
        row = done.stdout.strip().split("\n")[-1].split() or [name, "0"]
        table.add_row(*row, str(done.returncode))
        total, broken = total + int(row[1]), broken or done.returncode != 0
    Console(width=120).print(table)
    print(f"{total} inputs")
    return int(broken)


def fuzz(name: str, inputs: int, seconds: float, seed: int) -> int:
    """Read damaged inputs in this process; print a line of figures, and return 1 if one breaks what is asked."""
    signal.signal(signal.SIGALRM, _hung)
    taken, longest, broken, count = 0, 0.0, 0, 0
    with tempfile.TemporaryDirectory() as folder:
        reader = READERS[name](Path(folder))
        for example in reader.examples:
            reader.read(example)  # what is imported and compiled, once
        start = _peak()
        resource.setrlimit(resource.RLIMIT_AS, (8 << 30, 8 << 30))
        end = time.monotonic() + seconds
        while count < inputs and time.monotonic() < end:
            data = damaged(reader.kind, reader.examples, (seed, count))
            signal.alarm(HANGS)
            before = time.process_time()
            problem = ""
            try:
                reader.read(data)
                taken += 1
            except PalpateError as error:
                text = str(error)
                problem = f"no single sentence: {text!r}" if "\n" in text or not 5 < len(text) < 2000 else ""
            except Exception as error:
                problem = f"{type(error).__name__}: {error}"
            signal.alarm(0)
            lasted = time.process_time() - before
            longest = max(longest, lasted)
            problem = problem or (f"took {lasted:.1f} s" if lasted > MOST_TIME else "")
            if problem:
                broken += 1
                sys.stderr.write(f"{name}, input {count}, seed {seed}: {problem[:300]}\n")
            count += 1
    peak = _peak() - start
    rate = count / max(1e-9, seconds - max(0.0, end - time.monotonic()))
    print(f"{name} {count} {taken} {count - taken - broken} {rate:.0f} {longest:.2f} {peak:.0f}")
    return int(bool(broken) or peak > MOST_MEMORY)


def _peak() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3


def _hung(*_: object) -> None:
    raise TimeoutError(f"still reading after {HANGS} s")


if __name__ == "__main__":
    sys.exit(main())
