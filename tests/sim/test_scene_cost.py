"""A scene holds only what it names."""

import pytest

from palpate.sim import ArmCarrier, ContactLaw, SphereObject, Stage, Tip, build_scene
from palpate.sim.scene_cost import scene_cost
from palpate.surfaces import Sphere


@pytest.mark.parametrize(("carrier", "bodies", "dofs", "geoms"), [(Stage(), 3, 3, 2), (ArmCarrier(), 10, 6, 8)])
def test_a_scene_has_what_it_names_and_one_pair(carrier, bodies, dofs, geoms):
    scene = build_scene(Tip(Sphere(0.008)), SphereObject(0.04), ContactLaw(), (0.0, 0.0, 0.06), carrier)
    cost = scene_cost(scene.model)
    assert (cost.bodies, cost.dofs, cost.geoms, cost.pairs) == (bodies, dofs, geoms, 1)
    assert cost.step_time > 0.0
    assert f"{dofs} degrees of freedom" in str(cost)
    # nothing collides but the pair
    assert not scene.model.geom_contype.any()
    assert not scene.model.geom_conaffinity.any()
