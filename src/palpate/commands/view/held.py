"""Where a held object was, which no log says: the simulation tells again, given what was commanded."""

from dataclasses import dataclass

import numpy as np

from palpate.errors import FloatArray, SimulationDivergedError
from palpate.experiments.grasp.plan import GraspPlan
from palpate.experiments.kit.scene_view import free_poses_of
from palpate.runtime import Command, Phase, Sample
from palpate.runtime.log import Log
from palpate.sim.hand.backend import HandBackend
from palpate.viewing.frames import PER_BODY


@dataclass(frozen=True, slots=True, eq=False)
class HeldPoses:
    """Where the held object was in every period of a log.

    Attributes:
        rows: Position [m] and quaternion (w, x, y, z), base frame, shape (n, 7); after the known periods the last
            of those.
        known: Of how many periods, from the first, that is known.
    """

    rows: FloatArray
    known: int

    @property
    def complete(self) -> bool:
        """Whether all of them are."""
        return self.known == len(self.rows)


def held_poses(log: Log, planned: GraspPlan) -> HeldPoses:
    """Return where the held object was, as the simulation that the log is of has it.

    The same simulation, given the same commands, goes the same way. Whether it does the samples tell, which must
    be those of the log to the last bit: from the first that is not (another version of MuJoCo, another processor),
    and from a gap of the log on, nothing is known.

    Args:
        log: Of the grasp.
        planned: Its plan.
    """
    rows, known = np.zeros((len(log), PER_BODY)), 0
    samples, commands = list(log.samples()), list(log.commands())
    with planned.backend() as backend:
        poses, sample = free_poses_of(backend), backend.start()
        rows[:] = poses()
        for i, recorded in enumerate(samples):
            if sample != recorded:
                break
            rows[i] = poses()
            known = i + 1
            if known == len(log):
                break
            try:
                sample = _next(backend, commands[i], commands[known], samples[known])
            except SimulationDivergedError:
                break
    rows[known:] = rows[max(known - 1, 0) : known or 1]
    return HeldPoses(rows, known)


def _next(backend: HandBackend, command: Command, after: Command, recorded: Sample) -> Sample:
    """Simulate a period.

    Where a run ends, the loop does not send what the controller wanted last, but the stop that the log has next;
    where the supervisor stops it, it does send it. Which of both it was, the sample that followed tells.
    """
    if after.phase is not Phase.STOP or command.phase is Phase.STOP:
        return backend.step(command)
    before = backend.snapshot()
    sample = backend.step(command)
    if sample == recorded:
        return sample
    backend.restore(before)
    return backend.step(after)
