"""What a grasp is measured by; imports nothing heavy."""

from typing import TYPE_CHECKING

from palpate.experiments.kit.figure import Figure

if TYPE_CHECKING:
    from palpate.experiments.grasp.result import Grasp


def _pulled(grasp: "Grasp", value: float) -> float | None:
    return value if grasp.counted.any() else None


def _aloft(grasp: "Grasp", value: float) -> float | None:
    return value if grasp.aloft.any() else None


FIGURES = (
    Figure("grip_ratio", "grip over the least, while pulled", "", lambda grasp: grasp.grip_ratio),
    Figure("slip_aloft_m", "slip in the air", "m", lambda grasp: _aloft(grasp, grasp.slip_aloft)),
    Figure("dropped", "share that dropped it", "", lambda grasp: grasp.dropped),
    Figure("gave_way", "share that slipped or spun", "", lambda grasp: bool(grasp.gave_way)),
    Figure("slip_m", "slip while pulled", "m", lambda grasp: _pulled(grasp, grasp.slip)),
    Figure("spin_rad", "spin while pulled", "rad", lambda grasp: _pulled(grasp, grasp.spin)),
    Figure("spin_aloft_rad", "spin in the air", "rad", lambda grasp: _aloft(grasp, grasp.spin_aloft)),
    Figure("tightest", "smallest grip over the least", "", lambda grasp: grasp.tightest),
    Figure("grip_max_n", "largest true grip while pulled", "N", lambda grasp: grasp.largest_grip),
    Figure("alarms_pulled", "alarms while pulled", "", lambda grasp: len(grasp.pulled_alarms)),
    Figure("alarms_other", "other alarms", "", lambda grasp: len(grasp.alarms) - len(grasp.pulled_alarms)),
    Figure("regrips", "times the grip was raised", "", lambda grasp: grasp.regrips),
    Figure("simulated_s", "simulated time", "s", lambda grasp: grasp.run.duration),
)
"""Those that matter most first."""
