"""A tip calibration in words and rows."""

import math
from collections.abc import Iterator

import numpy as np

from palpate.experiments.tip_calibration.result import TipCalibrationResult
from palpate.reporting.data import Quantity
from palpate.sensing.tip_calibration import TipFit

TIP_BLOCKS = ("size", "center", "rotation", "stiffness", "exponent", "deviations", "mount_turn", "mount_shift")
"""Of unknowns, those that are of the tip and how it is mounted."""

SHOWN = {"m": (1e3, "mm"), "rad": (180.0 / math.pi, "deg")}
"""Factor and unit by which lengths and angles are shown."""

LOG = "log_"
"""Begins names of unknowns whose logarithm is sought."""


def tip_metrics(fit: TipFit) -> Iterator[Quantity]:
    """Return what was found, each with its standard deviation, typed value, and whether the touches tell it."""
    for i in _of_tip(fit):
        each, value, sd = fit.unknowns.each[i], float(fit.values[i]), float(fit.sd[i])
        typed, told = each.typed, "told" if fit.told[i] else "NOT told by these touches"
        if each.name.startswith(LOG):
            name, unit = each.name.removeprefix(LOG), "N/m"
            typed, value = math.exp(typed), math.exp(value)
            sd *= value
        else:
            stem, _, ending = each.name.rpartition("_")
            factor, unit = SHOWN.get(ending, (1.0, ""))
            name = stem if ending in SHOWN else each.name
            typed, value, sd = factor * typed, factor * value, factor * sd
        yield Quantity(name.replace("_", " "), value, unit, f"+- {sd:.2g}; typed {typed:.6g}; {told}", digits=6)
    if len(fit.unknowns.tip.shape.round_about) == 3:
        yield Quantity("orientation", "-", "", "NOT told: a sphere has none")


def _of_tip(fit: TipFit) -> Iterator[int]:
    for block in TIP_BLOCKS:
        yield from range(len(fit.unknowns.each))[fit.unknowns.blocks[block]]


def place_rows(result: TipCalibrationResult) -> list[tuple[str, str, str, str]]:
    """Return where plate, rod and ball were found: name, value, unit, note."""
    fit = result.fit
    if fit is None:
        return []
    places = fit.unknowns.places(fit.values)
    rows = []
    for target, place, direction in zip(fit.unknowns.targets, places.place, places.direction, strict=True):
        at = ", ".join(f"{1e3 * each:.3f}" for each in place)
        along = "" if not direction.any() else "direction " + ", ".join(f"{each:.5f}" for each in direction)
        rows.append((target.name, at, "mm", along))
    return rows


def outcome(result: TipCalibrationResult) -> str:
    """Return how it ended, and whether the tip is to be used."""
    fit = result.fit
    if fit is None:
        return f"{len(result.next_touches)} touches were planned; nothing was moved."
    ended = f"{result.run}. " if result.config.moves else ""
    if not result.usable:
        return f"{ended}NOT to be used: {'; '.join(map(str, fit.verdict.broken))}."
    return f"{ended}The tip is to be used: all assumptions were tested on the touches, and held."


def felt_words(result: TipCalibrationResult) -> str:
    """Return what the touches of the run came to."""
    if not result.outcomes:
        return ""
    parts = [f"{count} {what.value}" for what, count in sorted(result.outcomes.items())]
    crept = f"; {result.unrested} left out, for the tip crept while it should rest" if result.unrested else ""
    return f"Touches: {', '.join(parts)}{crept}."


def meaning(result: TipCalibrationResult) -> str:
    """Return what this means for contacts on the tip."""
    fit = result.fit
    if fit is None:
        return ""
    covariance = fit.model_covariance()
    place = 1e3 * math.sqrt(float(np.trace(covariance[:3, :3])) / 3.0 + float(covariance[6, 6]))
    return f"Contacts on this tip are placed to +-{1.96 * place:.3g} mm (95 %), as far as its model decides."


def settings(result: TipCalibrationResult) -> tuple[tuple[str, str], ...]:
    """Return name and value of each setting."""
    config = result.config
    loads = ", ".join(f"{force:g} N" for force in config.forces)
    return (
        ("robot", config.robot),
        ("fingertip", f"{result.known.tip.shape.kind}, {result.known.tip.shape.sizes}"),
        ("forces", loads),
        ("turn of the tip, largest", f"{result.known.turn:g} rad"),
        ("scatter of the arm, to begin with", f"{result.known.instrument.position_sd:g} m"),
        (
            "errors of the sensor's matrix, standard deviation",
            f"{result.known.instrument.accuracy:.2g} of full load",
        ),
        ("targets", ", ".join(each.name for each in result.known.targets)),
        ("seed", str(config.seed)),
    )
