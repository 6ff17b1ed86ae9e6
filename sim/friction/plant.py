"""The friction plant in a MuJoCo scene: MuJoCo presses, the plant rubs.

A pair of geoms that the plant serves is frictionless in the model (condim 1). In every time step the plant takes
contact points, normals and poses of the present state, moves its bristles on, and gives both bodies equal and
opposite loads through `xfrc_applied`. The normal force is that of the step before, the only quantity that lags; a
contact just made rubs from its second time step on.

`xfrc_applied`, unlike `qfrc_applied` (and mj_applyFT, which writes it), is part of the external forces from which
MuJoCo computes force and torque sensors: they feel the plant's friction as they feel MuJoCo's, in the same time
step. Contact sensors and mj_contactForce do not: they know the normal force only. `FrictionPlant.contacts`
has both.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from palpate.errors import FloatArray, InvalidValueError
from palpate.sim.friction import contacts as column
from palpate.sim.friction.contacts import WIDTH, advance_contacts, read_normal_forces
from palpate.sim.friction.pairs import FrictionPair, served_pairs
from palpate.sim.friction.stability import check_bristles
from palpate.sim.friction.texture import Texture
from palpate.spatial import Vector

_CAPACITY = 32
"""Contacts that there is room for at first; more are made room for when they come."""


@dataclass(frozen=True, slots=True)
class FrictionContact:
    """What really happens at one contact, at the time to which the sensors belong; base frame.

    Attributes:
        pair: Whose contact it is.
        position: Where [m].
        normal: From the first geom into the second.
        normal_force: [N], positive when pushing.
        tangential_force: What the second exerts on the first [N].
        spin_torque: Likewise, about the normal [N m].
        slip_velocity: Of the second over the first, without the bristle's own stretching [m/s].
        slip_spin: Likewise, about the normal [rad/s].
        sticking: Whether it does not slip at all.
    """

    pair: FrictionPair
    position: Vector
    normal: Vector
    normal_force: float
    tangential_force: Vector
    spin_torque: float
    slip_velocity: Vector
    slip_spin: float
    sticking: bool


@dataclass(frozen=True, slots=True, eq=False)
class FrictionState:
    """Memory of a plant, opaque; to be saved and restored together with MuJoCo's state."""

    contacts: FloatArray
    place: FloatArray
    rotation: FloatArray


class FrictionPlant:
    """Friction by `FrictionLaw` at the pairs named, by MuJoCo's law at all others. A `FrictionStep`."""

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, pairs: Sequence[FrictionPair]) -> None:
        """Take a scene, compile what is not yet compiled, and reset.

        Args:
            model: Where each of the pairs is an explicit contact pair with condim 1.
            data: Of the scene; `advance` moves it on.
            pairs: Whom the plant serves.

        Raises:
            InvalidValueError: An integrator that evaluates forces more than once a step, or see `served_pairs`.
        """
        if model.opt.integrator == mujoco.mjtIntegrator.mjINT_RK4:
            raise InvalidValueError(
                "integrator = RK4: must be Euler, implicit or implicitfast with a friction plant"
            )
        self._model, self._data, self._pairs = model, data, tuple(pairs)
        self._served = served_pairs(model, self._pairs)
        self._dt = float(model.opt.timestep)
        self._body_of_geom = model.geom_bodyid.astype(np.int32)
        self._textures = _textures(self._served.geoms.tolist(), self._pairs)
        # views that live as long as the data
        self._place, self._rotation, self._center_of_mass = data.xpos, data.xmat, data.xipos
        self._geom_place, self._geom_rotation = data.geom_xpos, data.geom_xmat
        self._loads, self._given_loads = data.xfrc_applied, data.xfrc_applied.copy()
        self._place_before, self._rotation_before = data.xpos.copy(), data.xmat.copy()
        self._count = self._most = 0
        self._now = self._before = np.zeros((0, WIDTH))
        self._make_room(_CAPACITY)
        self.reset()

    def reset(self) -> None:
        """Begin with relaxed bristles; see `FrictionStep`."""
        mujoco.mj_forward(self._model, self._data)
        self._count = self._most = 0
        self._remember_poses()
        self._move_bristles(np.zeros_like(self._loads))  # nothing has moved, nothing is loaded
        self._read_normal_forces()

    def advance(self) -> None:
        """See `FrictionStep`. What stands in `xfrc_applied` acts besides, and still stands there afterwards.

        Raises:
            InvalidValueError: A bristle too stiff for the time step where the contacts are: see `check_bristles`.
        """
        np.copyto(self._given_loads, self._loads)
        mujoco.mj_step1(self._model, self._data)
        self._move_bristles(self._loads)
        self._remember_poses()
        mujoco.mj_step2(self._model, self._data)
        self._read_normal_forces()
        np.copyto(self._loads, self._given_loads)

    @property
    def contacts(self) -> tuple[FrictionContact, ...]:
        """What really happens, for checks; no controller sees it."""
        return tuple(
            FrictionContact(
                pair=self._pairs[int(row[column.PAIR])],
                position=_vector(row, column.POSITION),
                normal=_vector(row, column.NORMAL),
                normal_force=row[column.NORMAL_FORCE],
                tangential_force=_vector(row, column.FORCE),
                spin_torque=row[column.TORQUE],
                slip_velocity=_vector(row, column.SLIP),
                slip_spin=row[column.SPIN],
                sticking=row[column.SLIP_SPEED] == 0.0,
            )
            for row in self._now[: self._count].tolist()
            if row[column.PAIR] >= 0.0
        )

    def snapshot(self) -> FrictionState:
        """Return a copy of the plant's memory."""
        return FrictionState(
            self._now[: self._count].copy(), self._place_before.copy(), self._rotation_before.copy()
        )

    def restore(self, state: FrictionState) -> None:
        """Take back what `snapshot` gave."""
        self._count = len(state.contacts)
        self._make_room(self._count)
        self._now[: self._count] = state.contacts
        np.copyto(self._place_before, state.place)
        np.copyto(self._rotation_before, state.rotation)

    def _make_room(self, count: int) -> None:
        """Make room for so many contacts."""
        if count <= len(self._now):
            return
        kept, self._now, self._before = self._now, np.zeros((count, WIDTH)), np.zeros((count, WIDTH))
        self._now[: len(kept)] = kept
        # contiguous copies of MuJoCo's contacts: a strided view of one contact would be of another type for numba
        self._geoms, self._addresses = np.zeros((count, 2), np.int32), np.zeros(count, np.int32)
        self._positions, self._frames, self._factors = np.zeros((count, 3)), np.zeros((count, 9)), np.ones(count)

    def _move_bristles(self, loads: FloatArray) -> None:
        """Move all bristles on to the present state and add their loads."""
        before, count = self._count, int(self._data.ncon)
        self._make_room(count)
        if count:
            contact = self._data.contact
            self._geoms[:count], self._addresses[:count] = contact.geom, contact.efc_address
            self._positions[:count], self._frames[:count] = contact.pos, contact.frame
            if self._textures:
                self._read_textures(count)
        self._now, self._before, self._count = self._before, self._now, count
        advance_contacts(
            count,
            self._geoms,
            self._positions,
            self._frames,
            self._factors,
            self._before[:before],
            self._now,
            self._served.geoms,
            self._served.laws,
            self._served.reach,
            self._body_of_geom,
            self._place_before,
            self._rotation_before,
            self._place,
            self._rotation,
            self._center_of_mass,
            self._dt,
            loads,
        )
        if count > self._most:  # no more often: it takes as long as ten steps
            self._most = count
            check_bristles(self._model, self._data, self._pairs, self._served, self._now[:count])

    def _read_textures(self, count: int) -> None:
        """Evaluate textures where the contacts are."""
        for i, (first, second) in enumerate(self._geoms[:count].tolist()):
            found = self._textures.get((first, second))
            if found is None:
                self._factors[i] = 1.0
                continue
            geom, texture = found
            x, y, z = (
                (self._positions[i] - self._geom_place[geom]) @ self._geom_rotation[geom].reshape(3, 3)
            ).tolist()
            self._factors[i] = texture.factor(x, y, z)

    def _read_normal_forces(self) -> None:
        """Take from the solver what the next step goes by."""
        if self._count:
            read_normal_forces(self._count, self._addresses, self._data.efc_force, self._now)

    def _remember_poses(self) -> None:
        np.copyto(self._place_before, self._place)
        np.copyto(self._rotation_before, self._rotation)


def check_friction(state: FrictionState | None, plant: FrictionPlant | None) -> None:
    """Refuse a state with a plant's memory in a scene without a plant, and vice versa.

    Raises:
        InvalidValueError: It is such a one.
    """
    if (state is None) == (plant is None):
        return
    recorded, here = (
        ("MuJoCo's own friction", "a friction plant") if state is None else ("a friction plant", "none")
    )
    raise InvalidValueError(
        f"the state is of a scene with {recorded}, this one has {here}: take one of this scene"
    )


def _vector(row: list[float], at: int) -> Vector:
    return (row[at], row[at + 1], row[at + 2])


def _textures(geoms: list[list[int]], pairs: Sequence[FrictionPair]) -> dict[tuple[int, int], tuple[int, Texture]]:
    """The textured geom and its texture by the two geoms of a contact, in either order."""
    found = {}
    for (first, second), pair in zip(geoms, pairs, strict=True):
        if pair.texture is not None:
            found[first, second] = found[second, first] = (second, pair.texture)
    return found
