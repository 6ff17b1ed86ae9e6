"""Contacts in path order become means over short stretches, a batch at a time."""

import dataclasses
from dataclasses import dataclass
from typing import Self

import numpy as np

from palpate.errors import FloatArray
from palpate.mapping.arc_bins import stretch_means, stretch_starts


@dataclass(frozen=True, slots=True, eq=False)
class Stretches:
    """n means over consecutive contacts, in path order, in the robot's base frame.

    Attributes:
        position: Mean points, brought from the chord to the surface, shape (n, 3) [m].
        normal: Unit normals, shape (n, 3).
        path: Where along the path each centre lies, increasing, shape (n,) [m].
        extent: How much path each one covers, 0 for one contact, shape (n,) [m].
        noise: Noise of positions along the normal over that of the model, shape (n,).
        tilt: Noise of normals over that of the model, shape (n,).
    """

    position: FloatArray
    normal: FloatArray
    path: FloatArray
    extent: FloatArray
    noise: FloatArray
    tilt: FloatArray

    @classmethod
    def none(cls) -> Self:
        """Return no stretches."""
        return cls(np.zeros((0, 3)), np.zeros((0, 3)), *(np.zeros(0) for _ in range(4)))

    def __len__(self) -> int:
        """Number of stretches."""
        return len(self.path)

    def __getitem__(self, chosen: slice | np.ndarray) -> Self:
        """Return some of them."""
        return type(self)(*(getattr(self, each.name)[chosen] for each in dataclasses.fields(self)))

    def followed_by(self, others: Self) -> Self:
        """Return these and then `others`, which follow along the path.

        Their `path` starts anywhere: it goes on here as far as the centres lie apart, a jump included.
        """
        if not len(self) or not len(others):
            return others if len(others) else self
        gap = max(
            float(np.linalg.norm(others.position[0] - self.position[-1])),
            0.5 * float(others.extent[0] + self.extent[-1]),
        )
        moved = dataclasses.replace(others, path=others.path - others.path[0] + self.path[-1] + gap)
        pairs = ((getattr(self, each.name), getattr(moved, each.name)) for each in dataclasses.fields(self))
        return type(self)(*(np.concatenate(pair) for pair in pairs))


@dataclass(frozen=True, slots=True, eq=False)
class PathContacts:
    """Raw contacts in path order: what stretches are made of.

    Attributes:
        time: Shape (n,) [s].
        position: Shape (n, 3) [m].
        normal: Outward unit normals, shape (n, 3).
        noise: As in `Stretches`, shape (n,).
        tilt: As in `Stretches`, shape (n,).
    """

    time: FloatArray
    position: FloatArray
    normal: FloatArray
    noise: FloatArray
    tilt: FloatArray

    def __len__(self) -> int:
        """Number of contacts."""
        return len(self.time)

    def at(self, chosen: slice | np.ndarray) -> Self:
        """Return some of them."""
        return type(self)(*(getattr(self, each.name)[chosen] for each in dataclasses.fields(self)))

    def followed_by(self, others: Self) -> Self:
        """Return these and then `others`."""
        pairs = ((getattr(self, each.name), getattr(others, each.name)) for each in dataclasses.fields(self))
        return type(self)(*(np.concatenate(pair) for pair in pairs))


def cut(contacts: PathContacts, length: float, longest_pause: float) -> tuple[Stretches, int]:
    """Return means over stretches of `length` and the index of the first contact of the last one.

    The last stretch may go on with the next batch, so a caller keeps its contacts. A mean over an arc lies inside
    the surface by half the covariance of position and normal (see `TouchCloud.thinned`), which is put right.
    """
    starts = stretch_starts(contacts.time, contacts.position, contacts.normal, length, longest_pause)
    if not len(starts):
        return Stretches.none(), 0
    counts = np.diff(np.append(starts, len(contacts)))
    position = stretch_means(contacts.position, starts)
    normal = stretch_means(contacts.normal, starts)
    deviation = contacts.position - np.repeat(position, counts, axis=0)
    sagitta = 0.5 * stretch_means((deviation * contacts.normal).sum(axis=1), starts)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    ends = starts + counts - 1
    chord = np.linalg.norm(contacts.position[ends] - contacts.position[starts], axis=1)
    extent = chord * counts / np.maximum(counts - 1, 1)  # n contacts stand for n steps
    apart = np.linalg.norm(np.diff(position, axis=0), axis=1)
    steps = np.maximum(apart, 0.5 * (extent[1:] + extent[:-1]))
    found = Stretches(
        position=position + sagitta[:, None] * normal,
        normal=normal,
        path=np.concatenate([[0.0], np.cumsum(steps)]),
        extent=extent,
        noise=stretch_means(contacts.noise, starts),
        tilt=stretch_means(contacts.tilt, starts),
    )
    return found, int(starts[-1])
