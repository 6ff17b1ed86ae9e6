"""Ways to rub a surface: how long the robot is at it, and how well mu is known afterwards."""

import numpy as np

from palpate.experiments.friction.config import FrictionConfig
from palpate.experiments.friction.experiment import FindFriction
from palpate.experiments.kit.recorded_run import carry_out
from palpate.robots.values import load_named_robot
from studies.study import Row, Study, Tell

FRICTIONS = (0.3, 0.5, 0.8)
WAYS: dict[str, dict[str, object]] = {
    "one load, no twist, one speed": {"quick": True, "loads": (2.0,), "robot": "stage"},
    "two loads, one speed": {"quick": True},
    "three loads, five speeds": {},
    "the same, each stroke twice": {"repeats": 2},
}

ABOUT = (
    "A rubber fingertip on a plate in simulation (mu 0.3, 0.5 and 0.8, e 3 mm), sensor noise of 10 mN and 0.1 "
    "mN m. The cost is how long the robot rubs. The error is that of mu, relative, root mean square and "
    "largest over plates and seeds; beside it how many of the 95 % intervals hold the true mu, and the error "
    "of e. Slip detection and materials: python benchmarks/friction.py and benchmarks/slip.py."
)


def measure(quick: bool, seed: int, tell: Tell) -> Study:
    """Measure ways to rub."""
    rows = []
    for name, options in list(WAYS.items())[: 3 if quick else None]:
        found = []
        for mu in FRICTIONS:
            for i in range(1 if quick else 3):
                tell(f"friction: {name}, mu {mu:g}")
                config = FrictionConfig(
                    friction=mu,
                    force_noise=0.01,
                    moment_noise=1e-4,
                    seed=seed + i,
                    **options,
                )
                found.append(_rubbed(config))
        rows.append(_row(name, found))
    return Study("Ways to rub a surface", ABOUT, "time of rubbing", "s", "of mu, relative", "", tuple(rows))


def _rubbed(config: FrictionConfig) -> tuple[float, float, bool, float]:
    """Rub once: time [s], relative error of mu, whether its interval holds the truth, relative error of e."""
    friction = FindFriction()
    plan = friction.plan(config, load_named_robot(config.robot), {})
    rubbing = friction.found(plan, carry_out(plan))
    time, file = rubbing.run.duration, rubbing.file
    if file is None:
        return time, np.nan, False, np.nan
    true, spin = plan.true_friction(file.speed), plan.true_spin_length(1.0)
    assert true is not None  # it is simulated
    inside = file.friction.lower <= true <= file.friction.upper
    e = np.nan if file.spin_length is None or spin is None else file.spin_length.value / spin - 1.0
    return time, file.friction.value / true - 1.0, inside, e


def _row(name: str, found: list[tuple[float, float, bool, float]]) -> Row:
    times, errors, inside, spins = (np.array(each, dtype=float) for each in zip(*found, strict=True))
    note = f"{int(inside.sum())} of {len(inside)} intervals hold mu"
    if np.isfinite(spins).any():
        note += f"; e within {100.0 * np.nanmax(np.abs(spins)):.2g} %"
    rms = float(np.sqrt(np.nanmean(errors**2))) if np.isfinite(errors).any() else np.nan
    worst = float(np.nanmax(np.abs(errors))) if np.isfinite(errors).any() else np.nan
    return Row("rubbing", name, float(np.median(times)), rms, worst, note)
