"""How the zeros of a hand's sensors wander, by what describes them, and how a grasp follows them."""

from palpate.controllers.grip.followed_zeros import FollowedZeros
from palpate.controllers.grip.zero_wander import TipOnSensor, ZeroWander
from palpate.controllers.grip.zeros import SteadyZeros, Zeros
from palpate.experiments.grasp.belief import tip_radius
from palpate.experiments.grasp.config import GraspConfig
from palpate.experiments.grasp.scene import MOMENT_DRIFT
from palpate.robots.finger_load import wander_of_finger
from palpate.robots.hand_description import HandDescription
from palpate.runtime import Finger, FingerDescription
from palpate.runtime.touch import SensorFinger
from palpate.spatial import Wrench


def wander_of(config: GraspConfig, hand: HandDescription) -> ZeroWander:
    """Return how fast a zero may wander: as it is simulated, or as the robot file says of the worst finger."""
    if not hand.real:
        return ZeroWander(config.drift, MOMENT_DRIFT * config.drift)
    assert hand.robot is not None  # it is real
    rates = [wander_of_finger(hand.robot, i) for i in range(config.fingers)]
    return ZeroWander(max(force for force, _ in rates), max(moment for _, moment in rates))


def zeros_of(config: GraspConfig, hand: HandDescription, fingers: tuple[FingerDescription, ...]) -> Zeros:
    """Return what follows the zeros; nothing, where they do not wander."""
    wander = wander_of(config, hand)
    if wander.force == wander.moment == 0.0:
        return SteadyZeros()
    f, m = config.force_noise, config.moment_noise
    noise: Wrench = (f, f, f, m, m, m)
    return FollowedZeros(
        [each.surface for each in fingers],
        tip_of(hand),
        wander,
        noise,
        hand.period,
        *_thresholds(fingers[0]),
    )


def tip_of(hand: HandDescription) -> TipOnSensor:
    """Return where a fingertip stands on its sensor: a sphere about the centre of what the sensor carries."""
    tip = hand.geometry.tips[0]
    return TipOnSensor(tip_radius(tip), tip.center_of_mass)


def _thresholds(finger: FingerDescription) -> tuple[float, float]:
    """Of a touch, and of its end [N]."""
    if isinstance(finger, SensorFinger):
        return finger.sensor.contact.touch_force, finger.sensor.contact.release_force
    assert isinstance(finger, Finger)
    return finger.touch_force, finger.release_force
