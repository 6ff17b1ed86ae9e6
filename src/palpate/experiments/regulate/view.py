"""What there is to see of a regulation of force."""

from palpate.experiments.kit.scene_view import scene_view
from palpate.experiments.regulate.built import built
from palpate.experiments.regulate.plan import RegulationPlan
from palpate.robots.known_truth import known_scene, scene_of
from palpate.robots.twin import stage_twin
from palpate.sim import MovingTarget
from palpate.sim.scene import OBJECT_GEOM
from palpate.viewing import ViewScene


def regulation_scene(planned: RegulationPlan) -> ViewScene:
    """Return the scene of a regulation; a surface that moves as told moves, one that yields stays where it was."""
    target, backend = planned.target, planned.ready.backend
    if scene_of(backend) is None:
        backend = built(planned.config, stage_twin(planned.robot), target).backend
    motions = {}
    if isinstance(target, MovingTarget):
        motions = {f"{OBJECT_GEOM}_{i}": joint.motion for i, joint in enumerate(target.joints)}
    title = f"Force on a {planned.config.object}, {planned.config.surface}, {planned.config.robot}"
    return scene_view(title, known_scene(backend).model, motions=motions)
