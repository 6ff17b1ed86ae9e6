"""What a grasp is measured by; imports nothing heavy."""

from typing import TYPE_CHECKING

from palpate.experiments.kit.metric import Metric

if TYPE_CHECKING:
    from palpate.experiments.grasp.result import GraspResult


def _pulled(grasp: "GraspResult", value: float) -> float | None:
    return value if grasp.counted.any() else None


def _aloft(grasp: "GraspResult", value: float) -> float | None:
    return value if grasp.aloft.any() else None


METRICS = (
    Metric("grip_ratio", "grip over the least, while pulled", "", lambda grasp: grasp.grip_ratio),
    Metric("slip_aloft_m", "slip in the air", "m", lambda grasp: _aloft(grasp, grasp.slip_aloft)),
    Metric("dropped", "share that dropped it", "", lambda grasp: grasp.dropped),
    Metric("gave_way", "share that slipped or spun", "", lambda grasp: bool(grasp.gave_way)),
    Metric("slip_m", "slip while pulled", "m", lambda grasp: _pulled(grasp, grasp.slip)),
    Metric("spin_rad", "spin while pulled", "rad", lambda grasp: _pulled(grasp, grasp.spin)),
    Metric("spin_aloft_rad", "spin in the air", "rad", lambda grasp: _aloft(grasp, grasp.spin_aloft)),
    Metric("tightest", "smallest grip over the least", "", lambda grasp: grasp.tightest),
    Metric("grip_max_n", "largest true grip while pulled", "N", lambda grasp: grasp.largest_grip),
    Metric("alarms_pulled", "alarms while pulled", "", lambda grasp: len(grasp.pulled_alarms)),
    Metric("alarms_other", "other alarms", "", lambda grasp: len(grasp.alarms) - len(grasp.pulled_alarms)),
    Metric("regrips", "times the grip was raised", "", lambda grasp: grasp.regrips),
    Metric("simulated_s", "simulated time", "s", lambda grasp: grasp.run.duration),
)
"""Those that matter most first."""
