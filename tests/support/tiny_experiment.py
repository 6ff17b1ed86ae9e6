"""The smallest experiment, as somebody would write one in a file of their own: it taps a sphere."""

from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Literal

import numpy as np

from palpate.controllers import Loss, force_gain, series_stiffness, tracking_delay
from palpate.controllers.force_profile import ConstantForce
from palpate.controllers.regulate import RegulateController
from palpate.controllers.regulate_parameters import RegulateParameters
from palpate.experiments.kit.checks import check_force
from palpate.experiments.kit.experiment import DryRun, ExperimentDefaults, PlanDefaults
from palpate.experiments.kit.metric import Metric
from palpate.experiments.kit.options import NOISY, TOUCHED, WRITTEN, check_options, option
from palpate.experiments.kit.scene import scene_view
from palpate.reporting.data import Quantity
from palpate.reporting.report import Report, Section, TextTable
from palpate.robots.finger_sensor import model_with_noise
from palpate.robots.fingertip import fingertip, start_above
from palpate.robots.in_scene import build
from palpate.robots.known_truth import known_scene
from palpate.robots.task import Task
from palpate.runtime import Phase
from palpate.sim import SeededSensor, SphereObject
from palpate.sim.presets import EXPLORE

TINY = f"{Path(__file__).resolve()}:Tap"
"""As typed; named so wherever it is used, so that there is one module of it."""

RADIUS, STIFFNESS = 0.04, {"hard": 20e3, "soft": 5e3}


@dataclass(frozen=True, slots=True)
class TapConfig:
    """Tap a sphere."""

    force: float = option(2.0, "N", bound="positive")
    """Force to hold [N]."""
    speed: float = option(0.01, "m/s", bound="positive")
    """Of landing [m/s]."""
    time: float = option(0.05, "s", bound="positive")
    """How long it is held [s]."""
    reach: float = option(0.01, "m", bound="positive")
    """How far down the sphere is looked for [m]."""
    surface: Literal["hard", "soft"] = option("hard", fixed=TOUCHED)
    """What the sphere is like."""
    noise: float | None = option(None, "N", fixed=NOISY, bound="not negative")
    """Of the sensor's forces [N]."""
    robot: str = option("stage")
    seed: int = option(0, fixed=NOISY)
    out: Path = option(Path("runs/tap"), fixed=WRITTEN)

    def __post_init__(self) -> None:
        check_options(self)


class TapPlan(SimpleNamespace, PlanDefaults):
    def backend(self):
        return build(self.robot, self.task).backend

    def controller(self):
        return RegulateController(self.parameters, ConstantForce(self.config.force), self.task.period)

    def dry_run(self):
        return DryRun("Tapping a sphere", (Quantity("force", self.config.force, "N"),), ("forces.txt",))

    def view(self):
        return scene_view("Tapping a sphere", known_scene(self.backend()).model)


class Tap(ExperimentDefaults):
    name, summary, Config = "tap", "Tap a sphere.", TapConfig
    metrics = (
        Metric("force_mean_n", "mean force held", "N", lambda tapped: tapped.force),
        Metric("held", "share of runs that held", "", lambda tapped: tapped.contact is Loss.NEVER),
        Metric("true_mean_n", "true mean force", "N", lambda tapped: tapped.true_force),
        Metric("contact", "contact", "", lambda tapped: tapped.contact.value),
    )

    def plan(self, config, robot, attachments):
        limits = robot.file.limits
        check_force(config.force, config.force, limits)
        finger, stiffness, tip = robot.file.fingers[0], STIFFNESS[config.surface], fingertip(robot)
        start = start_above(tip, RADIUS, 0.001)
        law, sensor = replace(EXPLORE.law, stiffness=stiffness), model_with_noise(finger, config.noise, None)
        period, sphere = robot.file.period, SphereObject(RADIUS)
        seeded, given_way = SeededSensor(sensor, config.seed), 0.5 * config.force / stiffness
        task = Task(tip, given_way, sphere, law, start, period, seeded, touch_force=0.1)
        ready = build(robot, task)
        delay = tracking_delay(period, ready.response, ready.finger.pipeline().delay)
        gain = force_gain(series_stiffness(stiffness, ready.stiffness), delay)
        how = {"landing_speed": config.speed, "approach_distance": config.reach, "settle_time": 0.1}
        parameters = RegulateParameters(gain, delay, config.time, config.force, (0.5, 20.0), **how)
        plan = TapPlan(config=config, robot=robot, task=task, fingers=(ready.finger,), limits=limits)
        plan.parameters = parameters
        plan.expected_duration, plan.longest_duration = 0.5 + config.time, 5.0 + config.time
        return plan

    def evaluate(self, plan, recorded):
        record = recorded.record()
        held = record.phase == Phase.HOLD.value
        truth = np.linalg.norm(recorded.contact_truth.force, axis=1)
        mean, true = (values[held].mean() if held.any() else np.nan for values in (record.normal_force, truth))
        loss = recorded.controller.contact.loss
        return SimpleNamespace(run=recorded.run, force=float(mean), true_force=float(true), contact=loss)

    def report(self, result):
        section = Section("Contact", (TextTable([("contact", result.contact.value, "", "")]),))
        return Report("A tap", str(result.run), (Quantity("mean force", result.force, "N"),), (section,))

    def files(self, result):
        return {"forces.txt": lambda path: path.write_text(f"{result.force!r}\n", encoding="utf-8")}
