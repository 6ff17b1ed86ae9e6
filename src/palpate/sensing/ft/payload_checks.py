"""Whether static poses keep to what the identification of a payload assumes."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.special import chdtrc, fdtrc

from palpate.estimation import Assumption, BrokenAssumption, Verdict, ill_conditioned, white_in_time
from palpate.sensing.ft.arrays import OTHER_MOMENT_UNIT, named_axes
from palpate.sensing.ft.zero_drift import FEWEST_FOR_DRIFT, Explained, Whitened, ZeroDrift

RARE = 1e-4
"""Residuals that noise would explain more rarely than this are held against the model."""

GRAVITY_ON_EARTH = (9.76, 9.84)
"""[m/s^2]. 9.780 to 9.832 at sea level, and 0.015 less at 5000 m."""

LONGEST_ARM = 1.0
"""[m]. What arms carry has its centre nearer to the sensor; mN m for N m make it a thousand times as far."""

LARGEST_CONDITION = 20.0
"""Poses are known to about 1e-3 rad: the centre of mass then to 2 % of its distance."""

MASS_WITH_DRIFT = 0.01
"""Of the mass: four standard deviations up to which a mass counts as determined though the zero moves."""

BAD_SHARE = 0.05
"""Of the poses (one at least from 20 on) may be left out as exceptions."""

LARGEST_INFLUENCE = 3.0
"""Standard deviations by which the mass may change without one pose, or without one change of pose: independent
noise moves it by less than one."""

LARGEST_LEVERAGE = 0.9
"""Of what is known of the mass may hang on one pose, or on one change of pose."""

NOT_BY_ROTATION = 0.2
"""Share of what forces have beyond a weight, up to which they are those of poses in a turned frame."""

DISAGREEMENT = 4.0
"""Standard deviations between the mass and that from differences."""


@dataclass(frozen=True, slots=True, eq=False)
class PayloadFit:
    """What is tested.

    Attributes:
        model: The regressions.
        gravity: Length of the specific force [m/s^2].
        condition: Of the problem for the first moment.
        mass: [kg].
        mass_var: [kg^2].
        difference: Mass from differences of successive poses [kg].
        difference_var: [kg^2].
        force_sd: Noise as given [N].
        moment_sd: Likewise [N m].
    """

    model: Explained
    gravity: float
    condition: float
    mass: float
    mass_var: float
    difference: float
    difference_var: float
    force_sd: float
    moment_sd: float


def payload_verdict(fit: PayloadFit) -> Verdict:
    """Return what the data contradict, worst first."""
    found = (_gravity(fit), _arm(fit), _direction(fit), _data(fit), _bad_poses(fit), _time(fit), _influence(fit))
    remedy = "tilt the sensor about another axis, too, best onto all six sides"
    conditioned = ill_conditioned(fit.condition, LARGEST_CONDITION, remedy)
    more = (_differences(fit), _noise(fit), _determined(fit), conditioned)
    return Verdict(tuple(broken for each in (*found, *more) for broken in each))


def _gravity(fit: PayloadFit) -> Iterator[BrokenAssumption]:
    low, high = GRAVITY_ON_EARTH
    if not low <= fit.gravity <= high:
        yield BrokenAssumption(
            Assumption.PLAUSIBLE,
            f"g is {fit.gravity:.4g} m/s^2, on earth {low} to {high}",
            "give the local g, or scale the accelerometer to it: the mass is wrong by the same factor",
        )


def _arm(fit: PayloadFit) -> Iterator[BrokenAssumption]:
    arm = math.hypot(*fit.model.moment.theta) / max(fit.mass, math.sqrt(fit.mass_var))
    if arm > LONGEST_ARM:
        yield BrokenAssumption(
            Assumption.PLAUSIBLE,
            f"the centre of mass is {arm:.3g} m from the sensor, at most {LONGEST_ARM:g} m",
            OTHER_MOMENT_UNIT,
        )


def _data(fit: PayloadFit) -> Iterator[BrokenAssumption]:
    n = len(fit.model.force.left) + 1
    if n < FEWEST_FOR_DRIFT:
        yield BrokenAssumption(
            Assumption.ENOUGH_DATA,
            f"{n} poses, at least {FEWEST_FOR_DRIFT} are needed to test for drift",
            "take eight poses or more, opposite orientations in turn",
        )


def _direction(fit: PayloadFit) -> Iterator[BrokenAssumption]:
    """Let the force be any linear map of the specific force: only one rotation, by none, is a weight."""
    force, moment = fit.model.force, fit.model.moment
    rarity = min(_linear(force, force, 8), _linear(moment, force, 6))
    if rarity >= RARE:
        return
    a = -force.design[:, :, 0]
    shown = force.left + force.design @ force.theta
    map_a = np.linalg.lstsq(a, -shown)[0].T
    u, factors, vt = np.linalg.svd(map_a)
    remedy = "check for contact, cables and hoses that pull, and the frame of the poses"
    turn = u @ vt
    beyond = float(((a @ (map_a - force.theta[0] * np.eye(3)).T) ** 2).sum())
    unlike = float(((a @ (map_a - factors.mean() * turn).T) ** 2).sum())
    if unlike < NOT_BY_ROTATION * beyond:
        if np.linalg.det(turn) < 0.0:
            yield BrokenAssumption(
                Assumption.UNIQUE,
                f"forces fit the poses as {named_axes(turn)}: mirrored, a left-handed frame or two axes swapped",
                "put forces and moments into the right-handed frame of the poses",
            )
            return
        angle = math.degrees(math.acos(min(1.0, max(-1.0, 0.5 * (np.trace(turn) - 1.0)))))
        yield BrokenAssumption(
            Assumption.UNIQUE,
            f"forces fit the poses turned by {angle:.3g} degrees, as {named_axes(turn)}",
            "give the poses of the sensor's own frame: correct its mounting, the order of its axes, or --up, if "
            "the base is not level",
        )
        return
    yield BrokenAssumption(Assumption.WHITE_IN_DIRECTION, f"probability {rarity:.0e}, at least {RARE:g}", remedy)


def _linear(fit: Whitened, force: Whitened, extra: int) -> float:
    """Return the probability with which white residuals would follow the specific force as much or more."""
    a = force.design[:, :, 0]
    q = np.linalg.qr(a)[0]
    of_a = float(((q.T @ fit.left) ** 2).sum())
    rest = float((fit.left**2).sum()) - of_a + fit.floor
    free = fit.freedom - extra
    return float(fdtrc(extra, free, of_a / extra / (rest / free))) if free > 0 else 1.0


def _bad_poses(fit: PayloadFit) -> Iterator[BrokenAssumption]:
    bad, n = fit.model.zero.bad, len(fit.model.force.left) + 1
    if len(bad) > max(BAD_SHARE * n, 1.0 if n >= 20 else 0.0):
        yield BrokenAssumption(
            Assumption.NO_OUTLIERS,
            f"{len(bad)} of {n} poses are far from the others ({', '.join(map(str, sorted(bad)))}), at most "
            f"{BAD_SHARE:.0%}",
            "take them again, at rest and without contact",
        )


def _time(fit: PayloadFit) -> Iterator[BrokenAssumption]:
    n = len(fit.model.force.left) + 1
    if n < FEWEST_FOR_DRIFT:
        return
    for name, each in (("force", fit.model.force), ("moment", fit.model.moment)):
        series = np.delete(each.in_time(), fit.model.zero.bad, axis=0)
        if float((series**2).sum()) <= each.floor or len(series) < FEWEST_FOR_DRIFT:
            continue
        if fit.model.zero.drift is not ZeroDrift.NONE and float((series[1:] * series[:-1]).sum()) < 0.0:
            # residuals that alternate: the zero took too much, as of a drift that is of one slow shape, not random
            continue
        rarity = white_in_time(series)
        if rarity < 10.0 * RARE:
            yield BrokenAssumption(
                Assumption.WHITE_IN_TIME,
                f"the {name}'s residuals follow one another though a zero of kind "
                f"'{fit.model.zero.drift}' was allowed: probability {rarity:.0e}, at least {10.0 * RARE:g}",
                "let the sensor warm up, and take opposite orientations in turn",
            )


def _influence(fit: PayloadFit) -> Iterator[BrokenAssumption]:
    force = fit.model.force
    n = len(force.left) + 1
    a, shown = force.design[:, :, 0], force.left + force.design @ force.theta
    energy, product = float((a**2).sum()), float((a * shown).sum())
    columns = np.hstack([np.eye(n), np.tril(np.ones((n, n)))[:, 1:]])
    unit = force.of_events(columns)[0]
    of_a, of_shown = unit.T @ a, unit.T @ shown
    leverage = (of_a**2).sum(axis=1) / energy
    sd = math.sqrt(max(fit.mass_var, force.variance / energy))
    kept = np.maximum(energy * (1.0 - leverage), 1e-12 * energy)
    moved = np.abs((product - (of_a * of_shown).sum(axis=1)) / kept - fit.mass) / sd
    worst = int(np.argmax(np.where(leverage > LARGEST_LEVERAGE, 1e9 * leverage, moved)))
    if leverage[worst] <= LARGEST_LEVERAGE and moved[worst] <= LARGEST_INFLUENCE:
        return
    place = f"pose {worst}" if worst < n else f"the change from pose {worst - n} to {worst - n + 1}"
    amount = (
        f"{leverage[worst]:.0%} of what is known of the mass hang on {place}, at most {LARGEST_LEVERAGE:.0%}"
        if leverage[worst] > LARGEST_LEVERAGE
        else f"without {place} the mass is another by {moved[worst]:.2g} standard deviations, at most "
        f"{LARGEST_INFLUENCE:g}"
    )
    yield BrokenAssumption(
        Assumption.EVEN_INFLUENCE,
        amount,
        "a drift or a touch there cannot be distinguished from weight: take more poses, opposite ones in turn",
    )


def _differences(fit: PayloadFit) -> Iterator[BrokenAssumption]:
    sd = math.sqrt(max(fit.difference_var, fit.mass_var))
    apart = abs(fit.difference - fit.mass)
    if not fit.model.zero.jumps and apart > DISAGREEMENT * sd:
        yield BrokenAssumption(
            Assumption.WHITE_IN_TIME,
            f"differences of successive poses give {fit.difference:.4g} kg, all poses {fit.mass:.4g} kg: "
            f"{apart / sd:.2g} standard deviations, at most {DISAGREEMENT:g}",
            "let the sensor warm up, and take opposite orientations in turn",
        )


def _noise(fit: PayloadFit) -> Iterator[BrokenAssumption]:
    for name, each, sd, unit in (
        ("force", fit.model.force, fit.force_sd, "N"),
        ("moment", fit.model.moment, fit.moment_sd, "N m"),
    ):
        if fit.model.zero.drift is ZeroDrift.WALK:
            # what is noise and what is a step of the zero cannot be separated well: both are taken from the data
            continue
        total = float((each.left**2).sum()) / sd**2
        if chdtrc(each.freedom, total) < RARE:
            yield BrokenAssumption(
                Assumption.NOISE_LEVEL,
                f"the {name}'s residuals are {math.sqrt(each.variance):.3g} {unit}, the noise {sd:.3g} {unit}",
                "measure again, at rest, without contact, with right poses, or learn the noise by palpate "
                "calibrate tare --learn-noise",
            )


def _determined(fit: PayloadFit) -> Iterator[BrokenAssumption]:
    sd = math.sqrt(fit.mass_var)
    if fit.model.zero.moves and 4.0 * sd > MASS_WITH_DRIFT * fit.mass:
        drift = fit.model.zero.drift
        yield BrokenAssumption(
            Assumption.CONDITIONED,
            f"the zero moves ({drift if drift is not ZeroDrift.NONE else 'jumps'}) and leaves the mass uncertain "
            f"by {min(4.0 * sd / max(fit.mass, sd), 1.0):.1%}, at most {MASS_WITH_DRIFT:.0%}",
            "let the sensor warm up, and take more poses, opposite orientations in turn",
        )
