"""The report on a calibration of raw channels: models, errors by load and direction, meaning for contacts."""

import shlex
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from palpate.commands.calibrate.config import MatrixConfig
from palpate.commands.calibrate.felt_places import FeltAt, felt_places
from palpate.errors import FloatArray
from palpate.estimation import Verdict
from palpate.reporting.data import Quantity
from palpate.reporting.figure import Axis, Figure, Panel
from palpate.reporting.marks import Points, Rule
from palpate.reporting.report import Figures, Paragraph, Report, Section, TextTable
from palpate.runtime.palette import BOUND, FELT, QUIET_COLOUR
from palpate.sensing.ft import CalibrationChoice, CalibrationFit, SensorFile
from palpate.sensing.ft.arrays import AXES
from palpate.sensing.ft.calibration_checks import LARGEST_ERROR
from palpate.sensing.ft.calibration_choice import left_out_error
from palpate.surfaces import Sphere

TIP_RADIUS = 0.01
"""[m] Of a fingertip of which nobody said anything."""

SHOWN_FORCE = 2.0
"""[N] At which places are told first: contacts are explored with 1 to 3 N."""

DIGITS = 4
"""Of a percent per kelvin: below is rounding."""

MAIN = 0.5
"""Of its largest entry, in units of the ranges: axes that a load counts for."""


@dataclass(frozen=True, slots=True)
class MatrixFound:
    """A calibration of raw channels.

    Attributes:
        choice: The models.
        verdict: On the proposed one, that of the sensor's former calibration included.
        sensor: As it was.
        raw_unit: Of the channels.
        source: Name of the file with the loads.
    """

    choice: CalibrationChoice
    verdict: Verdict
    sensor: SensorFile
    raw_unit: str
    source: str


def matrix_report(found: MatrixFound, config: MatrixConfig) -> Report:
    """Return the report."""
    choice, ranges = found.choice, np.array(found.sensor.axis_limits)
    fit = choice.proposed
    radius = TIP_RADIUS if config.tip_radius is None else config.tip_radius
    tip = Sphere(radius, center=np.array(config.tip_center))
    felt = felt_places(fit, tip, ranges)
    return Report(
        f"Calibration of {found.sensor.model} {found.sensor.serial_number}",
        f"{fit.model} is {'proposed' if found.verdict.ok else 'the best, but not to be used'}: {choice.reason}.",
        tuple(_quantities(found, felt)),
        (
            Section("Models, by loads that they never saw", (_models(choice, ranges),)),
            Section("Errors against the load", (Figures(lambda: [_by_load(fit, ranges)]),)),
            Section("Errors by direction", (_by_direction(fit, ranges),)),
            Section(
                f"Contacts on a round tip of {1e3 * tip.radius:.3g} mm",
                (
                    Paragraph(
                        f"Its centre is {_mm(config.tip_center)} from the sensor. 95 % of contacts are felt "
                        "as near, in the worst of directions up to 60 degrees from its front. What averaging of "
                        "readings cannot make less is the calibration's own."
                    ),
                    _contacts(felt),
                ),
            ),
            *_temperature(choice, ranges),
        ),
        asked=f"a calibration from {fit.load_count} known loads in {found.source}",
        advice=tuple(f"{broken.finding}: {broken.remedy}." for broken in found.verdict.broken),
        repeat=(("The same again:", _typed(config)),),
        footer="Wrenches are what acts on the tip side of the sensor, about its origin.",
        reached=found.verdict.ok,
    )


def _quantities(found: MatrixFound, felt: tuple[FeltAt, ...]) -> Iterator[Quantity]:
    fit, ranges = found.choice.proposed, np.array(found.sensor.axis_limits)
    yield Quantity("error of loads left out", 100.0 * left_out_error(fit, ranges), "% of the range", "all axes", 3)
    if felt:
        at = min(felt, key=lambda each: abs(each.force - SHOWN_FORCE))
        yield Quantity(f"places at {at.force:g} N", _plus_minus(1e3 * at.place), "mm", "95 %, the worst direction")
        yield Quantity(
            f"normal force at {at.force:g} N", _plus_minus(at.normal_force), "N", "95 %, the worst direction"
        )
    yield Quantity("condition number of the sensor", fit.condition, "", "1 is ideal", 3)
    yield Quantity("uncertain at full range", 100.0 * float(fit.doubt.max()), "%", "standard deviation", 2)


def _models(choice: CalibrationChoice, ranges: FloatArray) -> TextTable:
    rows = []
    for fit in choice.fits:
        words = "OK" if fit.verdict.ok else fit.verdict.broken[0].finding
        missed = " ".join(
            f"{axis} {100.0 * x:.2g}" for axis, x in zip(AXES, fit.left_out_rms / ranges, strict=True)
        )
        rows.append(
            (fit.model, f"{100.0 * left_out_error(fit, ranges):.3g}", "% of the range", f"{missed}; {words}")
        )
    return TextTable(rows, heads=("model", "missed by", "", "by axis; what the loads say of it"))


def _by_load(fit: CalibrationFit, ranges: FloatArray) -> Figure:
    load, missed = 100.0 * fit.loads / ranges, 100.0 * fit.left_out / ranges
    texts = tuple(f"load {i}" for i in range(len(load)))
    panels = [
        Panel(
            (
                Points(load[:, i], missed[:, i], "left out", FELT, size=6.0, texts=texts),
                Points(load[:, i], 100.0 * fit.residual[:, i] / ranges[i], "fitted", QUIET_COLOUR, size=3.0),
                *(Rule(sign * 100.0 * LARGEST_ERROR, colour=BOUND, upright=False) for sign in (1.0, -1.0)),
            ),
            Axis(f"load of {axis}", "%"),
            Axis("error", "%"),
            axis,
            height=220,
        )
        for i, axis in enumerate(AXES)
    ]
    return Figure(
        "Errors against the load",
        "In percent of each axis' range. Good is a cloud about zero without a bend, a slope or a fan; the dark "
        f"red lines are the limit of {LARGEST_ERROR:.0%}, root mean square.",
        tuple(panels),
        columns=3,
        wide=True,
    )


def _by_direction(fit: CalibrationFit, ranges: FloatArray) -> TextTable:
    """Return the errors of all loads that pull, or push, along an axis."""
    share, missed = fit.loads / ranges, fit.left_out / ranges
    largest = np.abs(share).max(axis=1)
    rows = []
    for i, axis in enumerate(AXES):
        for sign, name in ((1.0, f"+{axis}"), (-1.0, f"-{axis}")):
            there = (sign * share[:, i] >= MAIN * largest) & (largest > 0.0)
            if there.any():
                rms = np.sqrt((missed[there] ** 2).mean(axis=0))
                worst = int(np.argmax(rms))
                of_all = 100.0 * float(np.sqrt((missed[there] ** 2).mean()))
                rows.append(
                    (
                        name,
                        f"{of_all:.2g}",
                        "% of the range",
                        f"{there.sum()} loads; most in {AXES[worst]}, {100.0 * rms[worst]:.2g}",
                    )
                )
            else:
                rows.append((name, "-", "", "no load"))
    return TextTable(rows, heads=("load along", "missed by", "", ""))


def _contacts(felt: tuple[FeltAt, ...]) -> TextTable:
    rows = [
        (
            f"{each.force:g} N",
            _plus_minus(1e3 * each.place),
            "mm",
            f"of that the calibration's own {_plus_minus(1e3 * each.place_of_calibration)} mm; normal force "
            f"{_plus_minus(each.normal_force)} N",
        )
        for each in felt
    ]
    return TextTable(rows, heads=("pressed with", "place", "", ""))


def _temperature(choice: CalibrationChoice, ranges: FloatArray) -> Iterator[Section]:
    if choice.drift is None or choice.gain is None or choice.temperature is None:
        return
    rows = [
        (
            axis,
            f"{100.0 * drift / limit:+.2g}",
            "% of the range per kelvin",
            f"sensitivity {round(100.0 * gain, DIGITS):+.2g} % per kelvin",
        )
        for axis, drift, limit, gain in zip(AXES, choice.drift, ranges, choice.gain, strict=True)
    ]
    text = (
        f"The calibration holds at {choice.temperature:.4g} degrees Celsius (--temperature chooses another). A "
        "tare takes the zero's drift off; that of the sensitivity remains."
    )
    yield Section("Temperature", (Paragraph(text), TextTable(rows, heads=("axis", "zero", "", ""))))


def _typed(config: MatrixConfig) -> str:
    words = ["palpate", "calibrate", "matrix", "--loads", str(config.loads), "--sensor", str(config.sensor)]
    given = {"--raw-unit": [config.raw_unit], "--channels": config.channels, "--raw-range": config.raw_range or ()}
    for name, values in given.items():
        if any(str(value) for value in values):
            words += [name, *map(str, values)]
    for name in ("temperature", "tip_radius", "gravity"):
        if (value := getattr(config, name)) is not None:
            words += [f"--{name.replace('_', '-')}", repr(value)]
    words += ["--tip-center", *map(repr, config.tip_center)]
    return shlex.join([*words, "--report", str(config.report)])


def _plus_minus(value: float) -> str:
    return "not to be told" if np.isnan(value) else f"+-{value:.2g}"


def _mm(vector: tuple[float, float, float]) -> str:
    return "(" + ", ".join(f"{1e3 * x:g}" for x in vector) + ") mm"
