"""An experiment of one's own in one file, not installed: the roughness of ripples, by a stroke.

    palpate examples/my_texture.py:Texture --force 2
    palpate sweep examples/my_texture.py:Texture --vary force=1,2 --seeds 2

It measures 6.6 of 7.1 µm: the tip follows ripples that pass 1.3 times a second almost fully.
What palpate can do with its own experiments it can do with this one; `examples/plugin` has a larger one.
"""

from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace

import numpy as np

import palpate as pp
from palpate.experiments.kit import TOUCHED, ExperimentDefaults, Metric, option
from palpate.experiments.kit.one_finger import OneFingerPlan
from palpate.reporting.figure import Axis, Figure, Panel
from palpate.reporting.marks import Line
from palpate.sim import HeightField

STIFFNESS, WAVELENGTH = 20e3, 0.004  # [N/m], [m]


@dataclass(frozen=True)
class TextureConfig:
    """Stroke ripples of 4 mm with a steady force; measure how rough they are."""

    force: float = option(1.0, "N")
    ripple: float = option(10e-6, "m", fixed=TOUCHED)
    robot: str = "stage"
    seed: int = 0
    out: Path = Path("runs/my-texture")


class Stroke:
    """Lands, presses with a force [N], and goes 20 mm along x at 5 mm/s."""

    def __init__(self, force, gain):
        self.force, self.gain, self.touched = force, gain, np.inf

    def start(self, first): ...

    def step(self, now):
        since, finger = now.time - self.touched, now.fingers[0]
        if since > 4.5:
            return pp.Command(phase=pp.Phase.DONE)
        if not finger.touching:
            return pp.Command((0.0, 0.0, -0.004), pp.Phase.APPROACH)
        self.touched = min(self.touched, now.time)
        push = self.gain * (self.force - finger.contact.normal_force) * finger.contact.normal
        along = np.array([0.005 * (since > 0.5), 0.0, 0.0])
        return pp.Command(push + along, pp.Phase.SCAN if since > 0.5 else pp.Phase.SETTLE)


class Texture(ExperimentDefaults):
    name, summary, Config = "texture", "Stroke ripples: how rough they are.", TextureConfig
    metrics = (Metric("roughness_rms_um", "roughness, RMS", "µm", lambda result: 1e6 * float(np.std(result.z))),)

    def plan(self, config, robot, attachments):
        heights = config.ripple * np.sin(np.linspace(-0.02, 0.02, 161) / WAVELENGTH * 2.0 * np.pi)
        how = {"force": config.force, "stiffness": STIFFNESS, "duration": 6.0, "speed": 5e-3, "beside": (-0.01, 0)}
        ripples = HeightField(np.tile(heights, (41, 1)), 0.04, 0.04)
        return OneFingerPlan.over(ripples, config, robot, new_stroke, title="Roughness of ripples", **how)

    def evaluate(self, plan, recorded):
        record = recorded.record()
        felt = record.touching & (record.phase == pp.Phase.SCAN.value)
        return SimpleNamespace(run=recorded.run, x=record.centroid[felt, 0], z=record.centroid[felt, 2])

    def figures(self, result):
        felt = Panel((Line(1e3 * result.x, 1e6 * result.z),), Axis("place", "mm"), Axis("height", "µm"))
        yield Figure("Height", "Where the contact was, along the stroke.", (felt,))


def new_stroke(plan):
    return Stroke(plan.config.force, plan.setup.gain.gain)
