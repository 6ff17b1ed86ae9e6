"""Rubbing runs for sweeps: see `palpate.commands.sweep.swept.Carrier`."""

from palpate.commands.sweep.carried import found_in, sinks_of
from palpate.commands.sweep.swept import Found
from palpate.experiments.friction.config import FrictionConfig
from palpate.experiments.friction.plan import plan
from palpate.experiments.friction.run import Attempt, RubbingRun, write_rubbing
from palpate.experiments.kit.figure import Figure, FigureValue, number
from palpate.friction.friction_file import Finding, How

FIGURES = (
    Figure("mu_found", "friction mu that was found"),
    Figure("mu_lower", "lower end of its 95 % interval"),
    Figure("mu_upper", "upper end of its 95 % interval"),
    Figure("mu_how", "how mu was found"),
    Figure("mu_true", "true mu"),
    Figure("mu_error", "mu found less true mu"),
    Figure("mu_inside", "share of intervals that hold true mu"),
    Figure("spin_length_found_m", "spin length e at 1 N that was found", "m"),
    Figure("spin_length_lower_m", "lower end of its 95 % interval", "m"),
    Figure("spin_length_upper_m", "upper end of its 95 % interval", "m"),
    Figure("spin_length_how", "how e was found"),
    Figure("spin_length_true_m", "true e at 1 N", "m"),
    Figure("spin_length_error_m", "e found less true e", "m"),
    Figure("spin_length_inside", "share of intervals that hold true e"),
    Figure("load_exponent_found", "growth of e with load, gamma"),
    Figure("norm_exponent_found", "norm exponent p"),
    Figure("lost", "times contact was lost"),
    Figure("simulated_s", "simulated time", "s"),
)
MERITS = ("mu_error", "spin_length_error_m", "mu_found")
SECONDS = 0.06


def duration_of(config: FrictionConfig) -> float:
    """Plan a run and return about how long it is, simulated [s]."""
    return plan(config).expected_duration


def carry_out(config: FrictionConfig, keep: bool) -> Found:
    """Rub."""
    planned = plan(config)
    attempt = Attempt(planned)
    rubbing = attempt.found(attempt.run((), sinks_of(planned, keep)))
    if keep:
        write_rubbing(rubbing, config.out)
    return found_in(rubbing.run, figures_of(rubbing))


def figures_of(rubbing: RubbingRun) -> dict[str, FigureValue]:
    """Return the figures of a rubbing run; what was only bounded or assumed has no error."""
    told: dict[str, FigureValue] = {"lost": rubbing.lost, "simulated_s": number(rubbing.run.duration)}
    file, planned = rubbing.file, rubbing.planned
    if file is None:
        return told
    told |= _finding("mu", "", file.friction, planned.true_friction(file.speed))
    told |= _finding("spin_length", "_m", file.spin_length, planned.true_spin_length(1.0))
    for name, finding in (("load_exponent", file.load_exponent), ("norm_exponent", file.norm_exponent)):
        told[f"{name}_found"] = number(finding.value) if finding.how is How.MEASURED else None
    return told


def _finding(name: str, unit: str, found: Finding | None, true: float | None) -> dict[str, FigureValue]:
    told: dict[str, FigureValue] = {f"{name}_true{unit}": number(true)}
    if found is None:
        return told
    told |= {
        f"{name}_found{unit}": number(found.value),
        f"{name}_lower{unit}": number(found.lower),
        f"{name}_upper{unit}": number(found.upper),
        f"{name}_how": found.how.value,
    }
    if true is not None and found.how is How.MEASURED:
        told |= {
            f"{name}_error{unit}": number(found.value - true),
            f"{name}_inside": found.lower <= true <= found.upper,
        }
    return told
