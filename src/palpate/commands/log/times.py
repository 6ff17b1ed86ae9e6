"""Times in a log, where its clock was in order."""

import numpy as np

from palpate.errors import FloatArray
from palpate.runtime.log import Log

LONGEST = 1e9
"""[s], thirty years. Times beyond are a broken clock's, and left out of the statistics."""


def log_duration(log: Log) -> float:
    """Return the time from the first to the last of two or more periods [s]; of a broken clock anything."""
    time = log.rows[:, log.codec.columns["time"].start]
    with np.errstate(over="ignore", invalid="ignore"):
        return float(time[-1] - time[0])


def log_spreads(log: Log) -> dict[str, FloatArray]:
    """Return the times of each period [s] by what they are, without those of a broken clock; none are left out."""
    columns = log.codec.columns
    time = log.rows[:, columns["time"].start]
    with np.errstate(over="ignore", invalid="ignore"):
        steps = np.diff(time)[np.diff(log.sequence) == 1]
    times = {
        "sample to sample": steps,
        "compute time": log.rows[:, columns["compute_time"].start],
        "lateness": log.rows[:, columns["lateness"].start],
    }
    sampled = (name for name in columns if name.endswith(".time"))
    with np.errstate(over="ignore", invalid="ignore"):
        times |= {f"age of {name[:-5]}": time - log.rows[:, columns[name].start] for name in sampled}
    finite = {name: values[abs(values) < LONGEST] for name, values in times.items()}
    return {name: values for name, values in finite.items() if values.size}
