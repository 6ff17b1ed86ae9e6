"""What every choice of a simulation costs and gives: `python benchmarks/simulation [--quick] [--picture PATH]`."""

import sys
from pathlib import Path

if __name__ == "__main__":
    # `simulation` is this folder
    sys.path[:1] = [str(Path(__file__).resolve().parents[1])]
    from simulation.run import main

    sys.exit(main())
