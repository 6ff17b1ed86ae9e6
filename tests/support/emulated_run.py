"""Starts an emulated robot and stays: what a test kills, to see what is left behind."""

import sys

import psutil

from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.explore.plan import plan
from palpate.robots.robot import load_robot
from palpate.runtime.data import Command


def main() -> None:
    path = sys.argv[1]
    planned = plan(ExploreConfig(robot=path, width=0.02, depth=0.004), load_robot(path), {})
    with planned.backend() as backend:
        backend.start()
        backend.pacer.start()
        backend.step(Command())
        pids = [str(child.pid) for child in psutil.Process().children(recursive=True)]
        sys.stdout.write(" ".join(pids) + "\n")
        sys.stdout.flush()
        while True:
            backend.step(Command())


if __name__ == "__main__":
    main()
