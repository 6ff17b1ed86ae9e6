"""Strokes a rippled surface at several forces: its roughness and its spectrum."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from palpate.experiments.kit import TOUCHED, ExperimentDefaults, Metric, check_options, option

STIFFNESS = 20e3  # of the simulated contact [N/m]
ALONG = 1e-4  # between two heights of a profile [m]


@dataclass(frozen=True, slots=True)
class TextureConfig:
    """Stroke a surface at several forces, and tell its roughness spectrum.

    All values are in SI units: metres, newtons, seconds.

    Example: palpate texture --force 1 --steps 3 --wavelength 0.004
    """

    force: float = option(1.0, "N", bound="positive")
    """Normal force of the first stroke [N]."""
    step: float = option(0.5, "N", bound="not negative")
    """By how much it is larger with every stroke [N]."""
    strokes: int = option(3, bound="positive")
    """How many strokes there are, to and fro in turn."""
    length: float = option(0.02, "m", bound="positive")
    """Of a stroke [m]."""
    speed: float = option(0.02, "m/s", bound="positive")
    """Of a stroke [m/s]."""
    ripple: float = option(10e-6, "m", fixed=TOUCHED, bound="not negative")
    """Amplitude of the surface's ripples [m]."""
    wavelength: float = option(0.004, "m", fixed=TOUCHED, bound="positive")
    """Of the ripples [m]."""
    robot: str = "stage"
    """What carries the fingertip: a robot that comes with palpate (`palpate robot list`), or a robot file."""
    seed: int = 0
    """Seed of the sensor's noise."""
    out: Path = Path("runs/texture")
    """Folder for report, log and profiles."""

    def __post_init__(self) -> None:
        check_options(self)

    @property
    def forces(self) -> tuple[float, ...]:
        """Of each stroke [N]."""
        return tuple(self.force + i * self.step for i in range(self.strokes))


@dataclass(frozen=True, eq=False)
class Profile:
    """Height along one stroke: force [N], places and heights, shape (n,) [m], less their straight line."""

    force: float
    x: np.ndarray
    z: np.ndarray

    @property
    def roughness(self) -> float:
        """Root mean square of the height, Rq of ISO 21920 [m]."""
        return float(np.sqrt(np.mean(self.z**2)))

    @property
    def spectrum(self) -> tuple[np.ndarray, np.ndarray]:
        """Spatial frequencies [1/m] and amplitudes [m], by a Hann window."""
        window = np.hanning(len(self.z))
        amplitude = 2.0 * np.abs(np.fft.rfft(window * self.z)) / window.sum()
        return np.fft.rfftfreq(len(self.z), ALONG), amplitude

    @property
    def wavelength(self) -> float:
        """Of the largest peak [m]."""
        frequency, amplitude = self.spectrum
        return float(1.0 / frequency[1:][amplitude[1:].argmax()])


@dataclass(frozen=True, eq=False)
class TextureResult:
    """What came of a run: how it went, and a profile for each finished stroke."""

    run: object
    config: TextureConfig
    profiles: tuple[Profile, ...]

    def mean(self, name: str) -> float | None:
        """Mean of a property over the strokes; None if none was finished."""
        return float(np.mean([getattr(each, name) for each in self.profiles])) if self.profiles else None


class Texture(ExperimentDefaults):
    """The experiment; see `palpate.experiments.kit.Experiment`."""

    name = "texture"
    summary = "Stroke a surface at several forces: its roughness spectrum."
    Config = TextureConfig
    metrics = (
        Metric("roughness_rms_m", "roughness, RMS", "m", lambda found: found.mean("roughness")),
        Metric("wavelength_m", "wavelength of the largest peak", "m", lambda found: found.mean("wavelength")),
        Metric("strokes", "strokes finished", "", lambda found: len(found.profiles)),
    )

    def plan(self, config: TextureConfig, robot, attachments: Mapping[str, str]):
        """See `Experiment`."""
        from palpate.experiments.kit.one_finger import OneFingerPlan
        from palpate.sim import HeightField
        from palpate_texture.strokes import Strokes

        width, half = config.length + 0.02, 0.5 * config.length
        x = np.linspace(-0.5 * width, 0.5 * width, max(41, round(width / config.wavelength * 16)))
        heights = np.tile(config.ripple * np.sin(2.0 * np.pi * x / config.wavelength), (41, 1))
        return OneFingerPlan.over(
            HeightField(heights, width, width),
            config,
            robot,
            lambda plan: Strokes(config, half, plan.setup.gain.gain),
            force=max(config.forces),
            speed=config.speed,
            stiffness=STIFFNESS,
            duration=1.0 + config.strokes * (0.5 + config.length / config.speed),
            title=f"Texture of ripples of {1e6 * config.ripple:g} µm",
            beside=(-half, 0.0),
            files=("profiles.csv",),
        )

    def evaluate(self, plan, recorded) -> TextureResult:
        """See `Experiment`."""
        record = recorded.record()
        profiles = [_profile(record, *span) for span in recorded.controller.spans]
        return TextureResult(recorded.run, plan.config, tuple(each for each in profiles if each is not None))

    def report(self, result: TextureResult):
        """See `Experiment`."""
        from palpate.reporting.data import Quantity
        from palpate.reporting.report import Figures, Report, Section
        from palpate.reporting.run_figures import computing

        rows = [
            Quantity(
                f"roughness at {each.force:g} N", 1e6 * each.roughness, "µm", f"peak at {each.wavelength:.3g} m"
            )
            for each in result.profiles
        ]
        return Report(
            title="Roughness by touch",
            outcome=f"{len(rows)} of {result.config.strokes} strokes; {result.run}.",
            metrics=tuple(rows),
            sections=(
                Section("Spectrum", (Figures(lambda: _pictures(result.profiles)),)),
                computing(result.run.timing),
            ),
        )

    def files(self, result: TextureResult):
        """See `Experiment`."""
        rows = [(each.force, *pair) for each in result.profiles for pair in zip(each.x, each.z, strict=True)]
        return {
            "profiles.csv": lambda path: np.savetxt(path, rows, "%.9g", ",", header="force_N,x_m,z_m", comments="")
        }


def _profile(record, force: float, begin: float, end: float) -> Profile | None:
    """The heights that were felt between two times [s]."""
    felt = (record.time >= begin) & (record.time <= end) & record.touching & np.isfinite(record.centroid[:, 0])
    place = record.centroid[felt]
    place[:, 2] += (record.normal_force[felt] - force) / STIFFNESS  # less compression beyond that at the set force
    if len(place) < 2 or np.ptp(place[:, 0]) < 20 * ALONG:
        return None
    order = np.argsort(place[:, 0])
    x = np.arange(place[:, 0].min(), place[:, 0].max(), ALONG)
    z = np.interp(x, place[order, 0], place[order, 2])
    return Profile(force, x, z - np.polyval(np.polyfit(x, z, 1), x))


def _pictures(profiles):
    """The amplitude of the height over its spatial frequency, one line for each stroke."""
    from palpate.reporting.figure import Axis, Figure, Panel
    from palpate.reporting.marks import Line
    from palpate.runtime.palette import SIDE_BY_SIDE

    if not profiles:
        return
    lines = []
    for i, profile in enumerate(profiles):
        frequency, amplitude = profile.spectrum
        colour = SIDE_BY_SIDE[i % len(SIDE_BY_SIDE)]
        lines.append(Line(1e-3 * frequency[1:], 1e6 * amplitude[1:], f"{profile.force:g} N", colour))
    x, y = Axis("spatial frequency", "1/mm"), Axis("amplitude", "µm", logarithmic=True)
    caption = "Amplitude of the height along each stroke. A peak is a ripple; without one the surface is smooth."
    yield Figure("Roughness spectrum", caption, (Panel(tuple(lines), x, y),))
