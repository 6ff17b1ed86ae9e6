"""Environment under which libraries of linear algebra start no threads of their own.

They read it when they are loaded, so it must stand before numpy is imported. Palpate's matrices are small: threads
gain nothing there, and where the machine is busy they wait for one another (a map took four times the processor
time, and up to four times as long).
"""

LINEAR_ALGEBRA = dict.fromkeys(
    ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "BLIS_NUM_THREADS", "VECLIB_MAXIMUM_THREADS"),
    "1",
)

ONE_THREAD = LINEAR_ALGEBRA | dict.fromkeys(("NUMEXPR_NUM_THREADS", "NUMBA_NUM_THREADS"), "1")
"""For a worker, of which there is one per core already: what else might start threads does not either. MuJoCo
steps a simulation in the thread that calls it."""
