"""A controller of one's own.

A controller has two methods: `start` takes the first observation, `step` is called once per control period
and returns a velocity. This one lands on a sphere, presses with a steady force along the contact normal that
it feels, and slides over the top. The supervisor stands between it and the robot, whatever it commands.

    python examples/own_controller.py

It prints how well the force was held. With `--force 12` the supervisor stops the robot at 10 N, and reports it.
"""

import numpy as np
import tyro

import palpate as pp


class PressAndSlide:
    """Lands, presses with a force [N], and slides along x with a speed [m/s]."""

    def __init__(self, force: float, speed: float, gain: float) -> None:
        self.force, self.speed, self.gain = force, speed, gain  # gain: normal velocity per force error [m/s/N]

    def start(self, first: pp.Observation) -> None:
        """Take the first observation; nothing moves yet."""
        self.begin = first.time

    def step(self, now: pp.Observation) -> pp.Command:
        """Return the velocity for the next period."""
        contact = now.fingers[0].contact
        if not now.fingers[0].touching:
            return pp.Command((0.0, 0.0, -0.005), pp.Phase.APPROACH)  # down, with 5 mm/s
        normal = np.array(now.arm.rotation_base_tip) @ contact.normal  # points into the object
        along = np.cross(normal, [0.0, 1.0, 0.0])  # square to the normal: the force does not feel it
        push = self.gain * (self.force - contact.normal_force)
        phase = pp.Phase.SCAN if now.time < self.begin + 6.0 else pp.Phase.DONE
        return pp.Command(push * normal + self.speed * along, phase)


def main(force: float = 2.0, speed: float = 0.005, gain: float = 0.0015) -> None:
    """Press with a force [N], slide with a speed [m/s]."""
    tip, target, start = pp.Tip(pp.Sphere(0.008)), pp.SphereObject(0.04), (-0.01, 0.0, 0.05)  # [m]
    backend = pp.MujocoBackend(pp.build_scene(tip, target, pp.ContactLaw(), start))  # a stage, 1 kHz
    felt: list[float] = []  # normal force [N]

    def watch(_: pp.Sample, now: pp.Observation, command: pp.Command) -> None:  # once per period
        felt.extend(finger.contact.normal_force for finger in now.fingers if finger.touching)

    controller, guard = PressAndSlide(force, speed, gain), pp.Supervisor(pp.Limits(force=10.0, contact_speed=0.05))
    print(pp.run(backend, pp.Touch(tip.finger()), controller, guard, duration=10.0, observers=(watch,)))
    print(f"felt {np.mean(felt):.3f} +- {np.std(felt):.3f} N, over {len(felt)} periods")


if __name__ == "__main__":
    tyro.cli(main)
