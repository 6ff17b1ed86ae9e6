"""Grasps for tests: planned from options, carried out, found."""

from palpate.experiments.grasp.config import GraspConfig
from palpate.experiments.grasp.plan import GraspPlan
from palpate.experiments.grasp.plan import plan as plan_grasp
from palpate.experiments.grasp.result import GraspResult, grasp_of
from palpate.experiments.kit.recorded_run import RecordedRun, carry_out
from palpate.robots.values import load_named_robot


def plan_of(config: GraspConfig | None = None, /, **options) -> GraspPlan:
    """Return the plan of a new run."""
    config = config or GraspConfig(**options)
    return plan_grasp(config, None if config.robot is None else load_named_robot(config.robot), {})


def planned_again(plan: GraspPlan) -> GraspPlan:
    """Return the plan that the log of a run gives."""
    return plan_grasp(plan.config, plan.robot, plan.attachments())


def run_grasp(plan: GraspPlan | None = None, /, observers=(), sinks=(), **options) -> GraspResult:
    """Carry out a plan, or that of these options."""
    plan = plan or plan_of(**options)
    return grasp_of(plan, carry_out(plan, observers, sinks))


def found_after(plan: GraspPlan, run: RecordedRun, *observers) -> GraspResult:
    """Carry out a run of which a test knows the controller, or has chosen the back end."""
    return grasp_of(plan, run.recorded(run.run(observers)))
