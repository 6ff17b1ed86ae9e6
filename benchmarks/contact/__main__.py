"""Speed of contact sensing against its error: `python benchmarks/contact [--quick] [--picture PATH]`."""

import sys
from pathlib import Path

if __name__ == "__main__":
    benchmarks = Path(__file__).resolve().parents[1]
    # the reference is the tests' own; `contact` is this folder
    sys.path[:1] = [str(benchmarks), str(benchmarks.parent / "tests")]
    from contact.run import main

    main()
