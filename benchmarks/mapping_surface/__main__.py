"""A surface map's error, honesty and cost: `python benchmarks/mapping_surface [--quick] [--picture PATH]`."""

import sys
from pathlib import Path

if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
    from mapping_surface.run import main

    sys.exit(main())
