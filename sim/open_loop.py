"""Many presses at once whose commands are known beforehand: no controller in the loop, MuJoCo alone on every core.

A back end gives Python every period, for a controller. Where none is asked, as in a study of contact over
stiffness, friction and depth, `mujoco.rollout` steps whole trajectories in threads, and gives the same bits.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields
from typing import Protocol, runtime_checkable

import mujoco
import numpy as np
import numpy.typing as npt
from mujoco.rollout import Rollout

from palpate.errors import FloatArray, InvalidValueError, SimulationDivergedError
from palpate.sim.backend import MujocoBackend
from palpate.sim.objects.target import Nowhere
from palpate.sim.physics import DIVERGED, set_state
from palpate.sim.scene import OBJECT_GEOM, Scene
from palpate.sim.tip import TIP_GEOM

PHYSICS = mujoco.mjtState.mjSTATE_FULLPHYSICS
"""The state that `mujoco.rollout` begins with, beside the solver's warm start."""

LARGEST_BLOCK = 2**25
"""Numbers that MuJoCo writes at a time, of all time steps, 256 MB: of a run of 1 s some 100,000."""

INSTEAD = "step a MujocoBackend instead, several at a time by palpate.runtime.batch.run_batch"


@runtime_checkable
class OpenLoopCarrier(Protocol):
    """A carrier whose servo references follow from commands alone, as long as they lead it by little enough."""

    def references(self, velocity: FloatArray, steps: int, time_step: float) -> FloatArray:
        """Return the servos' references in every time step, as the carrier's `Drive` makes them.

        Args:
            velocity: Of the tip in each period, base frame, shape (p, 3) [m/s].
            steps: Time steps in a period.
            time_step: Of the simulation [s].

        Returns:
            Shape (steps * p, k), of the k controls and joints that are the model's first.
        """
        ...

    def keeps_up(self, reference: FloatArray, position: FloatArray) -> npt.NDArray[np.bool_]:
        """Return whether its drive leaves references as they are with its joints there, shapes (p, k) -> (p,)."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class Presses:
    """n presses over p periods: at the end of each what `MujocoBackend.step` and `truth` give, bit for bit.

    Attributes:
        time: Of the readings, shape (n, p) [s].
        tip_position: Of the tip frame's origin, base frame, shape (n, p, 3) [m].
        tip_velocity: Likewise [m/s].
        wrench: A perfect sensor's reading, in its own frame, shape (n, p, 6) [N, N m].
        acceleration: Specific force at its origin, likewise, shape (n, p, 3) [m/s^2].
        touching: Whether tip and object are in contact, shape (n, p).
        contact_position: Force-weighted centroid of their contacts, base frame, shape (n, p, 3) [m].
        force: What the object exerts on the tip, base frame, shape (n, p, 3) [N].
        torque: Likewise, about `contact_position` [N m].
    """

    time: FloatArray
    tip_position: FloatArray
    tip_velocity: FloatArray
    wrench: FloatArray
    acceleration: FloatArray
    touching: npt.NDArray[np.bool_]
    contact_position: FloatArray
    force: FloatArray
    torque: FloatArray


def rollout_presses(
    scene: Scene | Sequence[Scene], velocity: FloatArray, period: float = 1e-3, threads: int | None = None
) -> Presses:
    """Move tips with velocities that are known beforehand, many runs at a time.

    Each run begins where its scene does. Scenes in which palpate acts between two time steps of MuJoCo's are
    refused.

    Args:
        scene: One for all runs, or one for each; these differ in values, not in what there is: each has as many
            bodies, geoms, joints and sensors.
        velocity: Of the tip in each period, base frame, shape (n, p, 3) [m/s].
        period: Control period [s], a whole number of time steps.
        threads: How many; as many as this process may use cores, if not given.

    Raises:
        InvalidValueError: Wrong shapes or values; a scene that needs Python in every time step, or whose carrier
            does not go where it is told to.
        SimulationDivergedError: A simulation diverged.
    """
    from joblib import cpu_count  # 30 ms, for which whoever simulates something else would wait

    velocity = np.asarray(velocity, dtype=np.float64)
    if velocity.ndim != 3 or velocity.shape[2] != 3 or 0 in velocity.shape:
        raise InvalidValueError(f"velocity of shape {velocity.shape}: must be (runs, periods, 3), none of them 0")
    absurd = ~(np.abs(velocity).sum(axis=2) < DIVERGED)
    if absurd.any():
        run, at = np.argwhere(absurd)[0].tolist()
        shown = velocity[run, at].tolist()
        raise InvalidValueError(f"velocity[{run}, {at}] = {shown} m/s: must be numbers below {DIVERGED:g}")
    scenes = [scene] * len(velocity) if isinstance(scene, Scene) else list(scene)
    if len(scenes) != len(velocity):
        raise InvalidValueError(f"{len(scenes)} scenes for {len(velocity)} runs: give one, or one for each")
    starts = {id(each): _Start.of(each, period) for each in scenes}
    with Rollout(nthread=cpu_count() if threads is None else threads) as pool:
        blocks = [*_blocks(pool, scenes, [starts[id(each)] for each in scenes], velocity)]
    return Presses(*(np.concatenate([getattr(each, f.name) for each in blocks]) for f in fields(Presses)))


@dataclass(frozen=True, slots=True, eq=False)
class _Start:
    """A scene at its start.

    Attributes:
        carrier: What moves the tip.
        steps: Time steps in a period.
        state: `PHYSICS`.
        warm_start: The solver's.
    """

    carrier: OpenLoopCarrier
    steps: int
    state: FloatArray
    warm_start: FloatArray

    @staticmethod
    def of(scene: Scene, period: float) -> "_Start":
        carrier, model, data = scene.carrier, scene.model, mujoco.MjData(scene.model)
        if not isinstance(carrier, OpenLoopCarrier):
            raise InvalidValueError(
                f"carrier = {carrier}: where its servos are sent depends on where it is; take a Stage, or "
                f"{INSTEAD}"
            )
        tip = scene.tip.placer(model, data, TIP_GEOM, scene.target.shape)
        target = scene.target.placer(model, data, OBJECT_GEOM, TIP_GEOM)
        for what, placer in (("tip", tip), ("target", target)):
            if not isinstance(placer, Nowhere):
                raise InvalidValueError(
                    f"{what} = {getattr(scene, what)}: its geom is placed before each time step "
                    f"({type(placer).__name__}); take one that MuJoCo has a geom for, or {INSTEAD}"
                )
        if scene.rubbing:
            raise InvalidValueError(
                f"friction = {scene.rubbing[0].law}: palpate's friction plant acts in each time step; leave it to "
                f"MuJoCo (friction=None), or {INSTEAD}"
            )
        backend = MujocoBackend(scene, period)
        backend.start()
        set_state(model, data, backend.snapshot().simulation)
        state = np.empty(mujoco.mj_stateSize(model, PHYSICS))
        mujoco.mj_getState(model, data, state, PHYSICS)
        return _Start(carrier, round(period / scene.fidelity.time_step), state, data.qacc_warmstart.copy())


def _blocks(
    pool: Rollout, scenes: Sequence[Scene], starts: Sequence[_Start], velocity: FloatArray
) -> Iterator[Presses]:
    """Yield the presses, so many at a time that memory is bounded."""
    model = scenes[0].model
    if len({(int(each.model.signature), each.fidelity.time_step) for each in scenes}) > 1:
        raise InvalidValueError(
            "scenes that differ in what there is, or in their time step, are not computed together: give them in "
            "calls of their own"
        )
    data = [mujoco.MjData(model) for _ in range(max(1, pool.nthread))]
    size = velocity.shape[1] * starts[0].steps * (len(starts[0].state) + model.nsensordata)
    count = max(1, LARGEST_BLOCK // size)
    for begin in range(0, len(scenes), count):
        part = slice(begin, begin + count)
        yield _rolled_out(pool, data, scenes[part], starts[part], velocity[part])


def _rolled_out(
    pool: Rollout,
    data: list[mujoco.MjData],
    scenes: Sequence[Scene],
    starts: Sequence[_Start],
    velocity: FloatArray,
) -> Presses:
    """Return the presses of a block of runs."""
    steps, dt, model = starts[0].steps, scenes[0].fidelity.time_step, scenes[0].model
    references = np.array([x.carrier.references(v, steps, dt) for x, v in zip(starts, velocity, strict=True)])
    control = np.zeros((*references.shape[:2], model.nu))
    control[:, :, : references.shape[2]] = references
    state, readings = pool.rollout(
        [each.model for each in scenes],
        data,
        np.array([each.state for each in starts]),
        control,
        initial_warmstart=np.array([each.warm_start for each in starts]),
    )
    time = state[:, steps - 1 :: steps, 0]
    s = readings[:, steps - 1 :: steps]
    _check_converged(time, s, starts[0].state[0], steps * dt)
    _check_kept_up(starts, references, state)
    return Presses(
        time=time - dt,  # sensors belong to the state before the last time step
        tip_position=s[:, :, 0:3],
        tip_velocity=s[:, :, 3:6],
        wrench=-s[:, :, 6:12],  # what carries the tip feels the opposite
        acceleration=s[:, :, 12:15],
        touching=s[:, :, 15] > 0.0,
        contact_position=s[:, :, 22:25],
        force=-s[:, :, 16:19],
        torque=-s[:, :, 19:22],
    )


def _check_converged(time: FloatArray, readings: FloatArray, begin: float, period: float) -> None:
    """Refuse what no sound simulation gives; MuJoCo stops the clock of what it finds diverged."""
    due = begin + period * np.arange(1, time.shape[1] + 1)
    bad = ~((np.abs(readings.sum(axis=2)) < DIVERGED) & (np.abs(time - due) < 0.5 * period))
    if bad.any():
        run, at = np.argwhere(bad)[0]
        raise SimulationDivergedError(
            f"the simulation of run {run} diverged at t = {due[at]:.4f} s: take a softer contact or a "
            "smaller time step"
        )


def _check_kept_up(starts: Sequence[_Start], references: FloatArray, state: FloatArray) -> None:
    """Refuse runs in which a drive would have drawn its reference back: from there on the loop is closed."""
    steps, controls = starts[0].steps, references.shape[2]
    # at the beginning of every period but the first, which begins where it is
    led, at = references[:, steps - 1 : -1 : steps], state[:, steps - 1 : -1 : steps, 1 : 1 + controls]
    for run, start in enumerate(starts):
        late = ~start.carrier.keeps_up(led[run], at[run])
        if late.any():
            raise InvalidValueError(
                f"run {run}: in period {int(np.argmax(late)) + 1} the tip lags behind what is commanded by more "
                f"than its carrier allows ({start.carrier}): press or move less far, or {INSTEAD}"
            )
