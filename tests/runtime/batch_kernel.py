"""A kernel that is compiled once and kept on disk, and a batch that uses it: [prepare]."""

import sys

from numba import njit

from palpate.runtime.batch import quiet, results_of, run_batch


@njit(cache=True)
def doubled(x):
    return 2.0 * x


def work(case):
    """The kernel's answer, and how often it was found on disk and compiled in this process."""
    answer = doubled(float(case))
    return answer, sum(doubled.stats.cache_hits.values()), sum(doubled.stats.cache_misses.values())


if __name__ == "__main__":
    from runtime import batch_kernel  # under the name that workers know

    prepare = (lambda: batch_kernel.work(0)) if sys.argv[1:] == ["prepare"] else None
    found = results_of(run_batch(batch_kernel.work, range(4), 2, quiet, prepare))
    sys.stdout.write(repr(found))
