"""A program that runs a batch without end; tests stop it: FOLDER."""

import sys
from pathlib import Path

from palpate.runtime.batch import quiet, run_batch
from runtime.batch_work import Toss, toss

if __name__ == "__main__":
    run_batch(toss, [Toss(seed, Path(sys.argv[1]), pause=100.0) for seed in range(6)], 2, quiet)
