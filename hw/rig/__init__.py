"""A rig: arm, hand and force/torque sensors as one back end."""

from palpate.hw.rig.finger_sensor import FingerSensor
from palpate.hw.rig.framed_arm import FramedArm
from palpate.hw.rig.freshly_tared import FreshlyTared
from palpate.hw.rig.polled_hand import PolledHand
from palpate.hw.rig.rig import Accelerated, Rig, RigSettings

__all__ = ["Accelerated", "FingerSensor", "FramedArm", "FreshlyTared", "PolledHand", "Rig", "RigSettings"]
