"""Which feature of a LeRobot dataset each quantity of a log is.

`observation.state` is all that arm and hand tell, `action` all that they are told: what LeRobot's policies go by.
Each other quantity is a feature of its own, under its path in the log: with `observation.` before it where it is
a number that a finger's sensor gives or touch makes of it, and without where a policy is not to see it: times,
codes, truth.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from palpate.errors import FloatArray
from palpate.exporting.tables import dtype_of, named_components
from palpate.runtime.log.fields import TRUTH, LogField, LogGroup, path_of, walk
from palpate.runtime.log.period_codec import PeriodCodec

STATE, ACTION, OBSERVATION = "observation.state", "action", "observation."

_COMMAND = "command"
_GRIPS, _GRIP_COUNT = "command.grip_force", "command.grip_count"


@dataclass(frozen=True, slots=True, eq=False)
class Feature:
    """A feature.

    Attributes:
        name: Of it.
        dtype: Of its components, as numpy and LeRobot call it.
        names: Of its components, the unit at their end.
        columns: In which columns of a log's rows they are.
        codes: Names of the values 0, 1, ... of an enumeration; empty for anything else.
    """

    name: str
    dtype: str
    names: tuple[str, ...]
    columns: npt.NDArray[np.int64]
    codes: tuple[str, ...] = ()

    @property
    def info(self) -> dict[str, object]:
        """What info.json says of it."""
        codes = {"codes": list(self.codes)} if self.codes else {}
        return {"dtype": self.dtype, "shape": [len(self.names)], "names": list(self.names), **codes}


def features_of(codec: PeriodCodec) -> tuple[Feature, ...]:
    """Return the features of a log."""
    state, action, others = [], [], []
    with_hand = codec.heading.layout.hand_joints is not None
    for group, quantity in walk(codec.groups):
        path = path_of(group, quantity)
        if group.name in ("arm", "hand") and quantity.name != "time":
            state.append((path, quantity))
        elif group.name == _COMMAND and quantity.dtype == "<f8":
            action += [(path, quantity)] if with_hand or path != _GRIPS else []
        elif path != _GRIP_COUNT or with_hand:
            others.append(_feature(_name(group, quantity), [(path, quantity)], codec))
    return (_feature(STATE, state, codec), _feature(ACTION, action, codec), *others)


class FiniteRows:
    """Rows of a log as policies take them, which cannot learn from NaN.

    Grip forces that a command leaves as they were are those of the command before; what else is not finite, as a
    centroid while nothing is touched, is 0.
    """

    def __init__(self, codec: PeriodCodec) -> None:
        """Begin with a log."""
        self._grips, self._count = codec.columns[_GRIPS], codec.columns[_GRIP_COUNT].start
        self._before = np.zeros(self._grips.stop - self._grips.start)

    def of(self, rows: FloatArray) -> FloatArray:
        """Return the next rows, shape (n, width)."""
        finite = np.where(np.isfinite(rows), rows, 0.0)
        given = np.where(rows[:, self._count] >= 0.0, np.arange(1, len(rows) + 1), 0)
        finite[:, self._grips] = np.vstack([self._before, finite[:, self._grips]])[np.maximum.accumulate(given)]
        self._before = finite[-1, self._grips]
        return finite


def _name(group: LogGroup, quantity: LogField) -> str:
    path = path_of(group, quantity)
    hidden = group.name in ("", TRUTH, _COMMAND) or quantity.name == "time" or quantity.dtype != "<f8"
    return path if hidden else OBSERVATION + path


def _feature(name: str, parts: list[tuple[str, LogField]], codec: PeriodCodec) -> Feature:
    names = [each for path, quantity in parts for each in named_components(path.replace(".", "_"), quantity)]
    places = [np.arange(codec.columns[path].start, codec.columns[path].stop) for path, _ in parts]
    quantity = parts[0][1]
    return Feature(name, dtype_of(quantity).name, tuple(names), np.concatenate(places), quantity.codes)
