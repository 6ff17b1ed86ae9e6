"""How long palpate takes to begin, against `import numpy` in the same run: `python benchmarks/start_up.py`.

Processes of each kind take turns, so that what else the computer does hits all of them; the medians are compared.
Exit code 1 if a limit is passed: 5 times `import numpy` for `palpate --help`, 4 times for `import palpate`.
"""

import argparse
import statistics
import subprocess
import sys
import time

LIMITS = {"palpate --help": 5.0, "import palpate": 4.0}
"""Times the import of numpy."""

NUMPY = "import numpy"

KINDS = {
    NUMPY: ("-c", "import numpy"),
    "import palpate": ("-c", "import palpate"),
    "palpate --help": ("-m", "palpate", "--help"),
    "palpate explore --help": ("-m", "palpate", "explore", "--help"),
    "palpate completion bash": ("-m", "palpate", "completion", "bash"),
}


def seconds(words: tuple[str, ...]) -> float:
    """Return how long a process takes."""
    started = time.perf_counter()
    subprocess.run([sys.executable, *words], check=True, capture_output=True)
    return time.perf_counter() - started


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=15, help="processes of each kind (15)")
    repeats = parser.parse_args().repeats
    for words in KINDS.values():
        seconds(words)  # files are read from disk, and byte code is written
    taken: dict[str, list[float]] = {name: [] for name in KINDS}
    for _ in range(repeats):
        for name, words in KINDS.items():
            taken[name].append(seconds(words))
    numpy = taken[NUMPY]
    over = False
    print(f"{'':<26}{'median ms':>10}{'times numpy':>13}{'each pair':>20}{'limit':>7}")
    for name, each in taken.items():
        ratio = statistics.median(each) / statistics.median(numpy)
        pairs = sorted(one / other for one, other in zip(each, numpy, strict=True))
        spread = f"{pairs[0]:.2f} to {pairs[-1]:.2f}"
        limit = LIMITS.get(name)
        over = over or (limit is not None and ratio > limit)
        shown = "" if limit is None else f"{limit:g}"
        print(f"{name:<26}{1e3 * statistics.median(each):>10.0f}{ratio:>13.2f}{spread:>20}{shown:>7}")
    return int(over)


if __name__ == "__main__":
    sys.exit(main())
