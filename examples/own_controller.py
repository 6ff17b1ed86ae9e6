"""A controller of one's own.

A controller has two methods: `start` takes the first observation, `step` is called once per control period
and returns a velocity. This one lands on a sphere, presses with a steady force along the contact normal that
it feels, and slides over the top. The supervisor stands between it and the robot, whatever it commands.

    python examples/own_controller.py

It prints how well the force was held. With `--force 12` the supervisor stops the robot at 10 N, and says so.
"""

import numpy as np
import tyro

from palpate import Sphere
from palpate.runtime import Command, Finger, Limits, Observation, Phase, Sample, Supervisor, Touch, run
from palpate.sensing.compensation import Payload
from palpate.sim import ContactLaw, MujocoBackend, SphereObject, Tip, build_scene


class PressAndSlide:
    """Lands, presses with a force [N], and slides along x with a speed [m/s]."""

    def __init__(self, force: float, speed: float, gain: float) -> None:
        self.force, self.speed, self.gain = force, speed, gain  # gain: normal velocity per force error [m/s/N]

    def start(self, first: Observation) -> None:
        """Take the first observation; nothing moves yet."""
        self.begin = first.time

    def step(self, now: Observation) -> Command:
        """Return the velocity for the next period."""
        contact = now.fingers[0].contact
        if not now.fingers[0].touching:
            return Command((0.0, 0.0, -0.005), Phase.APPROACH)  # down, with 5 mm/s
        normal = np.array(now.arm.rotation_base_tip) @ contact.normal  # points into the object
        along = np.cross(normal, [0.0, 1.0, 0.0])  # square to the normal: the force does not feel it
        push = self.gain * (self.force - contact.normal_force)
        velocity = push * normal + self.speed * along
        phase = Phase.SCAN if now.time < self.begin + 6.0 else Phase.DONE
        return Command(tuple(velocity.tolist()), phase)


def main(force: float = 2.0, speed: float = 0.005, gain: float = 0.0015) -> None:
    """Press with a force [N], slide with a speed [m/s]."""
    tip, target, start = Tip(Sphere(0.008)), SphereObject(0.04), (-0.01, 0.0, 0.05)  # [m]
    backend = MujocoBackend(build_scene(tip, target, ContactLaw(), start))  # a stage, 1 kHz
    touch = Touch(Finger(tip.surface, Payload(tip.mass, tip.center_of_mass)))
    felt: list[float] = []  # normal force [N]

    def watch(_: Sample, now: Observation, command: Command) -> None:  # once per period
        felt.extend(finger.contact.normal_force for finger in now.fingers if finger.touching)

    supervisor = Supervisor(Limits(force=10.0))  # [N]
    print(run(backend, touch, PressAndSlide(force, speed, gain), supervisor, duration=10.0, observers=(watch,)))
    print(f"felt {np.mean(felt):.3f} +- {np.std(felt):.3f} N, over {len(felt)} periods")


if __name__ == "__main__":
    tyro.cli(main)
