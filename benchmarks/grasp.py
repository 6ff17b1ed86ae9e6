"""Speed of grasp-force solvers against their error: `python benchmarks/grasp.py [--quick] [--picture PATH]`."""

import os
import sys
from pathlib import Path

if __name__ == "__main__":
    # one thread for all, before numpy is imported
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(name, "1")
    # the hard families are the tests' own
    sys.path.insert(1, str(Path(__file__).resolve().parents[1] / "tests"))
    from grasp_forces.run import main

    main()
