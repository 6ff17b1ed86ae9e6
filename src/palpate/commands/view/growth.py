"""What a view shows of a map that grows and of the plan, live or from a log."""

from palpate.commands.replay.run import replay_log
from palpate.controllers import ExploreController
from palpate.experiments.explore.plan import ExplorationPlan
from palpate.experiments.explore.plan_watch import PlanDiary
from palpate.experiments.explore.scans import ActiveScan, ContourScan
from palpate.mapping import Knowledge
from palpate.runtime.log import Log
from palpate.runtime.shown_plan import PlanChange
from palpate.viewing import SurfaceView


def plans_of_log(log: Log) -> tuple[PlanChange, ...]:
    """Return the plans of a recorded exploration, which its controller makes again from what was recorded.

    Raises:
        InvalidValueError: The log cannot be replayed.
    """
    diaries: list[PlanDiary] = []

    def watched(planned: ExplorationPlan) -> ExploreController:
        controller = planned.controller()
        diaries.append(PlanDiary(controller))
        return controller

    replay_log(log, controller=watched, observers=(lambda *period: diaries[0].observe(*period),))
    return diaries[0].changes


def surface_view(planned: ExplorationPlan) -> SurfaceView:
    """Return how a view makes a surface of an exploration."""
    config, scan = planned.config, planned.scan
    return SurfaceView(
        rows=scan.prior if isinstance(scan, ActiveScan) else config.gap,
        voxel=config.map_spacing,
        half_compliance=planned.half_compliance,
        sensed_force=config.force,
        # beside a single line nothing is surrounded by contacts: its ribbon is all there is
        worst=Knowledge.EXTRAPOLATED if isinstance(scan, ContourScan) else Knowledge.OBSERVED,
    )
