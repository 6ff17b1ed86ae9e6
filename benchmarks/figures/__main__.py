"""Figures of README and documents, measured and written there: `python benchmarks/figures [TOPIC ...]`."""

import sys
from pathlib import Path

if __name__ == "__main__":
    benchmarks = Path(__file__).resolve().parents[1]
    # contacts are the tests' own; `figures` is this folder
    sys.path[:1] = [str(benchmarks), str(benchmarks.parent / "tests")]
    from figures.run import main

    main()
