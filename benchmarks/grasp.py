"""Start `grasp_forces.study` with one thread: `python benchmarks/grasp.py [--quick] [--picture PATH]`."""

import os

if __name__ == "__main__":
    # one thread for all, before numpy is imported
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(name, "1")
    from grasp_forces.study import main

    main()
