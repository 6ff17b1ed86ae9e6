"""One time step of friction at all contacts of a scene, compiled.

Bodies are followed by their poses, not their velocities: how far two bodies have shifted and turned against each
other at a contact in a time step is exact for finite rotations, so that a load held while everything moves and
turns does not drift (velocities would let it creep by omega^2 L dt / 2). The price: a ball that rolls by theta in
a step seems to slip by theta^2/6 of its speed. The bristle turns with the mean of the two bodies.
"""

import math

import numpy as np
import numpy.typing as npt

from palpate.errors import FloatArray
from palpate.sim.friction.bristle import DAMPING, SPIN_LENGTH, STIFFNESS, borne, compiled, compiled_once

IntArray = npt.NDArray[np.int32]

# one contact is one row; loads are what the second body exerts on the first, slip is of the second over the first,
# the normal points from the first into the second; base frame
PAIR = 0
POSITION = 1
NORMAL = 4
STRETCH = 7
TWIST = 10
NORMAL_FORCE = 11
FORCE = 12
TORQUE = 15
SLIP = 16
SPIN = 19
SLIP_SPEED = 20
WIDTH = 21

_NEARLY_SAME = 0.5
"""A bristle whose normal turns by more than 60 degrees in a step belongs to another face: it starts anew."""


@compiled
def pair_of(first: int, second: int, pairs: IntArray) -> int:
    """Return k + 1 if the geoms are pair k, -(k + 1) if they are pair k reversed, 0 if none."""
    for k in range(len(pairs)):
        if pairs[k, 0] == first and pairs[k, 1] == second:
            return k + 1
        if pairs[k, 1] == first and pairs[k, 0] == second:
            return -k - 1
    return 0


@compiled
def turn_since(i: int, rotation_before: FloatArray, rotation: FloatArray, turn: FloatArray) -> None:
    """Write R R_before' of body i, shape (3, 3)."""
    for j in range(3):
        for k in range(3):
            turn[j, k] = (
                rotation[i, 3 * j] * rotation_before[i, 3 * k]
                + rotation[i, 3 * j + 1] * rotation_before[i, 3 * k + 1]
                + rotation[i, 3 * j + 2] * rotation_before[i, 3 * k + 2]
            )


@compiled
def find_before(
    row: FloatArray,
    before: FloatArray,
    taken: npt.NDArray[np.bool_],
    only_one: bool,
    reach: float,
    mean_turn: FloatArray,
    mean_move: FloatArray,
) -> int:
    """Return which contact of the step before this one is, -1 if it is new.

    The nearest of the same pair, once moved along with the bodies; the only one however far: a ball may roll fast.
    """
    found, least = -1, math.inf if only_one else reach * reach
    for j in range(len(before)):
        if taken[j] or before[j, PAIR] != row[PAIR]:
            continue
        squared = 0.0
        for k in range(3):
            carried = mean_move[k]
            for i in range(3):
                carried += mean_turn[k, i] * before[j, POSITION + i]
            squared += (row[POSITION + k] - carried) ** 2
        if squared < least:
            found, least = j, squared
    return found


@compiled
def carry_bristle(row: FloatArray, before: FloatArray, mean_turn: FloatArray, stretch: FloatArray) -> float:
    """Turn the bristle of the step before with the bodies into the present tangent plane, its length kept.

    Writes `stretch`, shape (3,), and returns the twist.
    """
    length, along, flat = 0.0, 0.0, 0.0
    for j in range(3):
        stretch[j] = 0.0
        length += before[STRETCH + j] ** 2
        for k in range(3):
            stretch[j] += mean_turn[j, k] * before[STRETCH + k]
        along += row[NORMAL + j] * stretch[j]
    for j in range(3):
        stretch[j] -= along * row[NORMAL + j]
        flat += stretch[j] ** 2
    if flat < _NEARLY_SAME**2 * length:
        stretch[:] = 0.0
        return 0.0
    kept = math.sqrt(length / flat) if flat > 0.0 else 0.0
    for j in range(3):
        stretch[j] *= kept
    return float(before[TWIST])


@compiled
def shift_since(
    row: FloatArray,
    turn_1: FloatArray,
    turn_2: FloatArray,
    place_before_1: FloatArray,
    place_before_2: FloatArray,
    place_1: FloatArray,
    place_2: FloatArray,
    shift: FloatArray,
) -> None:
    """Write how far the second body has shifted over the first along the surface, shape (3,) [m].

    That is by how much the two material points now at the contact were apart one step ago.
    """
    across = 0.0
    for j in range(3):
        shift[j] = place_before_1[j] - place_before_2[j]
        for k in range(3):
            shift[j] += turn_1[k, j] * (row[POSITION + k] - place_1[k])
            shift[j] -= turn_2[k, j] * (row[POSITION + k] - place_2[k])
        across += row[NORMAL + j] * shift[j]
    for j in range(3):
        shift[j] -= across * row[NORMAL + j]


@compiled
def turn_about_normal(row: FloatArray, turn_1: FloatArray, turn_2: FloatArray) -> float:
    """Return by which angle the second body has turned against the first about the normal [rad].

    The axis of T = turn_2 turn_1' times the sine of its angle is that of (T - T')/2; a step turns little.
    """
    turn = 0.0
    for j in range(3):
        a, b = (j + 1) % 3, (j + 2) % 3
        for k in range(3):
            turn += 0.5 * row[NORMAL + j] * (turn_2[b, k] * turn_1[a, k] - turn_2[a, k] * turn_1[b, k])
    return turn


@compiled
def load_bristle(
    row: FloatArray,
    stretch: FloatArray,
    twist: float,
    shift: FloatArray,
    turn: float,
    law: FloatArray,
    share: float,
    factor: float,
    dt: float,
) -> None:
    """Move a bristle on by a time step and write its row.

    Args:
        row: The contact; its normal force is read, bristle, load and slip are written.
        stretch: Of the bristle before, in the present tangent plane, shape (3,) [m].
        twist: Of the bristle before [rad].
        shift: Of the second body over the first since then, in the tangent plane, shape (3,) [m].
        turn: Likewise, about the normal [rad].
        law: As packed.
        share: Of the pair's bristle that is at this contact, 0 to 1.
        factor: By which mu is multiplied here.
        dt: Time step [s].
    """
    stiffness, viscous, radius = share * law[STIFFNESS], share * law[DAMPING] / dt, law[SPIN_LENGTH]
    stiff = stiffness + viscous  # of one step of backward Euler
    squared = 0.0
    for k in range(3):
        row[FORCE + k] = stiffness * stretch[k] + stiff * shift[k]
        squared += row[FORCE + k] ** 2
    trial_torque = radius**2 * (stiffness * twist + stiff * turn)
    trial = math.sqrt(squared)
    force, torque, speed = borne(trial, abs(trial_torque), row[NORMAL_FORCE], stiff * dt, law, factor)
    held = force / trial if trial > 0.0 else 0.0
    for k in range(3):
        row[SLIP + k] = (1.0 - held) * row[FORCE + k] / (stiff * dt)
        row[FORCE + k] *= held
        row[STRETCH + k] = (row[FORCE + k] + viscous * stretch[k]) / stiff
    row[TORQUE] = math.copysign(torque, trial_torque)
    row[SPIN] = (trial_torque - row[TORQUE]) / (stiff * dt * radius**2)
    row[TWIST] = (row[TORQUE] / radius**2 + viscous * twist) / stiff
    row[SLIP_SPEED] = speed


@compiled
def push(body: int, sign: float, row: FloatArray, center_of_mass: FloatArray, loads: FloatArray) -> None:
    """Add a contact's friction to the load (force, torque about the centre of mass) on a body."""
    if body == 0:
        return  # the world
    x, y, z = (
        row[POSITION] - center_of_mass[body, 0],
        row[POSITION + 1] - center_of_mass[body, 1],
        row[POSITION + 2] - center_of_mass[body, 2],
    )
    fx, fy, fz, q = sign * row[FORCE], sign * row[FORCE + 1], sign * row[FORCE + 2], sign * row[TORQUE]
    loads[body, 0] += fx
    loads[body, 1] += fy
    loads[body, 2] += fz
    loads[body, 3] += y * fz - z * fy + q * row[NORMAL]
    loads[body, 4] += z * fx - x * fz + q * row[NORMAL + 1]
    loads[body, 5] += x * fy - y * fx + q * row[NORMAL + 2]


@compiled_once
def advance_contacts(
    count: int,
    geoms: IntArray,
    positions: FloatArray,
    frames: FloatArray,
    factors: FloatArray,
    before: FloatArray,
    now: FloatArray,
    pairs: IntArray,
    laws: FloatArray,
    reach: FloatArray,
    body_of_geom: IntArray,
    place_before: FloatArray,
    rotation_before: FloatArray,
    place: FloatArray,
    rotation: FloatArray,
    center_of_mass: FloatArray,
    dt: float,
    loads: FloatArray,
) -> None:
    """Find each contact again, move its bristle on, and add its friction to the loads on the bodies.

    Args:
        count: How many contacts there are.
        geoms: Of each contact, shape (capacity, 2).
        positions: Of each contact, shape (capacity, 3) [m].
        frames: Of each contact: axes as rows, the first from its first geom into its second, shape (capacity, 9).
        factors: On friction, shape (capacity,).
        before: Rows of the contacts one step ago, shape (n, WIDTH); the normal force is taken from them.
        now: Rows to write, shape (capacity, WIDTH); PAIR = -1 where a contact is none of the plant's.
        pairs: Geoms of each pair, shape (m, 2).
        laws: As packed, shape (m, 9).
        reach: How near a contact must be to be the same as before, shape (m,) [m].
        body_of_geom: Shape (n_geom,).
        place_before: Origins of the bodies one step ago, shape (n_body, 3) [m].
        rotation_before: Body to base, shape (n_body, 9).
        place: Likewise now.
        rotation: Likewise now.
        center_of_mass: Of each body now, shape (n_body, 3) [m].
        dt: Time step [s].
        loads: Added to, shape (n_body, 6): force and torque about the centre of mass [N, N m].
    """
    here, there = np.zeros(len(pairs), np.int64), np.zeros(len(pairs), np.int64)
    for i in range(count):
        k = pair_of(geoms[i, 0], geoms[i, 1], pairs)
        now[i, PAIR] = abs(k) - 1
        if k != 0:
            here[abs(k) - 1] += 1
        for j in range(3):
            now[i, POSITION + j] = positions[i, j]
            now[i, NORMAL + j] = frames[i, j] if k > 0 else -frames[i, j]
    for j in range(len(before)):
        if before[j, PAIR] >= 0:
            there[int(before[j, PAIR])] += 1

    taken = np.zeros(len(before), np.bool_)
    turn_1, turn_2, mean_turn = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    mean_move, shift, stretch = np.empty(3), np.empty(3), np.empty(3)
    for i in range(count):
        row, pair = now[i], int(now[i, PAIR])
        if pair < 0:
            continue
        first, second = int(body_of_geom[pairs[pair, 0]]), int(body_of_geom[pairs[pair, 1]])
        turn_since(first, rotation_before, rotation, turn_1)
        turn_since(second, rotation_before, rotation, turn_2)
        for j in range(3):
            mean_move[j] = 0.5 * (place[first, j] + place[second, j])
            for k in range(3):
                mean_turn[j, k] = 0.5 * (turn_1[j, k] + turn_2[j, k])
                mean_move[j] -= 0.5 * turn_1[j, k] * place_before[first, k]
                mean_move[j] -= 0.5 * turn_2[j, k] * place_before[second, k]
        only_one = here[pair] == 1 and there[pair] == 1
        same = find_before(row, before, taken, only_one, reach[pair], mean_turn, mean_move)
        stretch[:] = 0.0
        row[NORMAL_FORCE], twist = 0.0, 0.0
        if same >= 0:
            taken[same] = True
            row[NORMAL_FORCE] = before[same, NORMAL_FORCE]
            twist = carry_bristle(row, before[same], mean_turn, stretch)
        shift_since(
            row,
            turn_1,
            turn_2,
            place_before[first],
            place_before[second],
            place[first],
            place[second],
            shift,
        )
        turn = turn_about_normal(row, turn_1, turn_2)
        load_bristle(row, stretch, twist, shift, turn, laws[pair], 1.0 / here[pair], factors[i], dt)
        push(first, 1.0, row, center_of_mass, loads)
        push(second, -1.0, row, center_of_mass, loads)


@compiled_once
def read_normal_forces(count: int, addresses: IntArray, forces: FloatArray, now: FloatArray) -> None:
    """Write the normal forces that MuJoCo's solver has found to the contacts' rows.

    Args:
        count: How many contacts there are.
        addresses: Of each contact's normal force among all constraint forces, -1 if none, shape (capacity,).
        forces: Of all constraints, shape (n_constraint,) [N].
        now: Rows of the contacts, written.
    """
    for i in range(count):
        now[i, NORMAL_FORCE] = max(forces[addresses[i]], 0.0) if addresses[i] >= 0 else 0.0
