"""What workers of the batch tests do: importable where they are."""

import math
import os
import signal
import threading
import time
from dataclasses import dataclass
from pathlib import Path

import numba
import numpy as np
import psutil


@dataclass(frozen=True, slots=True)
class Toss:
    """A seed, and how often it dies or fails on the way."""

    seed: int
    folder: Path | None = None
    deaths: int = 0
    pause: float = 0.0
    error: BaseException | None = None
    loose: bool = False


def walk(seed):
    """Numbers that show the last bit: a chaotic map with noise, transcendental functions, and a set of strings."""
    rng = np.random.default_rng(seed)
    x, names = 0.3, {f"name {i}" for i in range(20)}
    for name, noise in zip(names, rng.normal(size=20), strict=True):
        x = 3.9 * x * (1.0 - x) + 1e-3 * math.sin(noise)
        x = math.fabs(math.tanh(x + 1e-9 * len(name)))
    return x, tuple(rng.normal(size=100) @ rng.normal(size=(100, 3)))


def toss(case):
    """Do what the case says: note the attempt, pause, die by SIGKILL for as many attempts, raise,
    return something that does not pickle, or walk."""
    attempt = 0
    if case.folder is not None:
        attempt = len(list(case.folder.glob(f"{case.seed}-*")))
        (case.folder / f"{case.seed}-{attempt}-{os.getpid()}").touch()
    time.sleep(case.pause)
    if attempt < case.deaths:
        os.kill(os.getpid(), signal.SIGKILL)
    if case.error:
        raise case.error
    return {"fine": case, "lock": [threading.Lock()]} if case.loose else walk(case.seed)


def surroundings(case):
    """How many threads a worker tells libraries to have, and has; whether Ctrl-C reaches it."""
    names = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS")
    many = np.ones((300, 300))
    np.linalg.solve(many + np.eye(300), many @ many)
    return (
        tuple(os.environ[name] for name in names),
        numba.get_num_threads(),
        psutil.Process().num_threads(),
        signal.getsignal(signal.SIGINT) is signal.SIG_IGN,
        os.getpid(),
    )


def large(case):
    """A result that does not fit into a pipe."""
    return bytes(16 << 20)


class Grumpy:
    """Cannot be loaded where it was not made."""

    def __init__(self):
        self.made_in = os.getpid()

    def __getstate__(self):
        return self.made_in

    def __setstate__(self, made_in):
        if os.getpid() != made_in:
            raise ImportError("not at home")
        self.made_in = made_in

    def __call__(self, case):
        return case


class Deadly(Grumpy):
    """Kills whom it is given to."""

    def __setstate__(self, made_in):
        if os.getpid() != made_in:
            os.kill(os.getpid(), signal.SIGKILL)


def pid(pause):
    """The process that does it, after a pause [s], so that others get a share."""
    time.sleep(pause)
    return os.getpid()


_calls = []


def counted(case):
    """How often this process has been asked."""
    _calls.append(case)
    return len(_calls)
