"""From what a running loop sees to a row of numbers, once per period."""

import math
from array import array
from collections.abc import Callable, Sequence

import numpy as np

from palpate.runtime.data import Command, Observation, Phase, Sample
from palpate.runtime.live import LiveParameters
from palpate.viewing.frames import PER_FINGER, PHASES, FrameLayout, Frames
from palpate.viewing.view_scene import ViewScene

SELDOM = 0.01
"""Between two looks at what is not worth one in every period, free bodies and live parameters [s of the run]:
three times as often as pictures are drawn."""

FreePoses = Callable[[], Sequence[float]]
"""Where free bodies are: position and quaternion (w, x, y, z) of each, base frame, one after the other. Only who
simulates them knows. It goes from there to the view, past touch and controller."""

_PHASE_PLACES = {phase: PHASES.index(phase) for phase in Phase}


class RowMaker:
    """Makes rows; what is the same for a whole run is looked up once.

    Attributes:
        layout: Of its rows.
    """

    def __init__(
        self, scene: ViewScene, live: LiveParameters | None = None, free_poses: FreePoses | None = None
    ) -> None:
        """Take a scene.

        Args:
            scene: What there is to see.
            live: The controller's live parameters; none if not given.
            free_poses: Where the scene's free bodies are; if not given rows do not hold them.
        """
        start = scene.placement.start
        self._live, self._free_poses = live or LiveParameters(), free_poses
        self.layout = FrameLayout(
            len(scene.fingers),
            len(start.arm),
            len(start.hand),
            len(start.free) if free_poses is not None else 0,
            len(self._live.parameters),
        )
        self._fingers, self._no_finger = len(scene.fingers), (math.nan,) * (PER_FINGER - 1) + (0.0,)
        self._arm, self._hand = (0.0,) * len(start.arm), (0.0,) * len(start.hand)
        self._seldom: tuple[float, ...] = ()
        self._seldom_due = -math.inf

    def row(self, now: Observation, command: Command) -> tuple[float, ...]:
        """Return a period's row but for its number at both ends.

        A device that reports less than it should is the supervisor's business: zeros stand for it.
        """
        contacts: tuple[float, ...] = ()
        for finger in now.fingers[: self._fingers]:
            contact = finger.contact
            x, y, z = contact.centroid.tolist()
            fx, fy, fz, *_ = finger.wrench
            nx, ny, nz = contact.normal.tolist()
            force, spin = contact.normal_force, contact.spin_torque
            contacts += (x, y, z, fx, fy, fz, force, spin, nx, ny, nz, finger.touching)
        if len(now.fingers) < self._fingers:
            contacts += self._no_finger * (self._fingers - len(now.fingers))
        time, arm, hand = now.time, now.arm, now.hand
        # not only when it is due: time may have gone back to the start of another run
        if not 0.0 < self._seldom_due - time <= SELDOM:
            self._seldom, self._seldom_due = self._looked_up(), time + SELDOM
        a, b, c = arm.rotation_base_tip
        joints, hand_joints = arm.joint_position, () if hand is None else hand.joint_position
        return (
            time,
            *arm.position_base_tip,
            *a,
            *b,
            *c,
            _PHASE_PLACES[command.phase],
            *contacts,
            *(joints if len(joints) == len(self._arm) else self._arm),
            *(hand_joints if len(hand_joints) == len(self._hand) else self._hand),
            *self._seldom,
        )

    def _looked_up(self) -> tuple[float, ...]:
        free = () if self._free_poses is None else self._free_poses()
        return (*free, *self._live.values.values(), *self._live.targets.values())


class FrameMemory:
    """An `Observer` that keeps a run for a `Player` or for pictures, free bodies included, which no log has."""

    def __init__(self, maker: RowMaker) -> None:
        """Take what makes the rows."""
        self._maker, self._rows, self._count = maker, array("d"), 0

    def observe(self, sample: Sample, now: Observation, command: Command) -> None:
        """Keep a period."""
        self._rows.append(self._count)
        self._rows.extend(self._maker.row(now, command))
        self._rows.append(self._count)
        self._count += 1

    @property
    def frames(self) -> Frames:
        """What was kept so far."""
        layout = self._maker.layout
        return Frames(np.array(self._rows).reshape(-1, layout.width), layout)
