"""A worker keeps scenes, arms and kernels from run to run, and no run can tell."""

import copy

import mujoco
import numpy as np
import pytest

from palpate.commands.sweep.attempt import attempt
from palpate.commands.sweep.record import RunStatus
from palpate.experiments.explore import exploration
from palpate.runtime.batch import Workers, quiet, results_of, run_batch
from palpate.sim import ContactLaw, SphereObject, Tip, Torus, build_scene
from palpate.surfaces import Sphere
from support.logged_runs import into, logged
from support.sweep_runs import planned

SMALL = ("width=0.004", "depth=0.002", "speed=0.05", "force_noise=0.01")


@pytest.mark.slow
@pytest.mark.parametrize("vary", [("object=sphere,torus,bumps",), ("robot=ur5e-sim,panda-sim",)])
def test_a_run_after_others_in_one_worker_is_the_run_alone_bit_for_bit(vary, tmp_path):
    cases = [run.case for run in planned(*vary, fixed=SMALL, experiment="explore").runs]
    # there and back: each after every other, and all but the last twice
    order = [*range(len(cases)), *reversed(range(len(cases)))]
    with Workers(1) as one:
        warm = results_of(
            run_batch(logged, [into(cases[i], tmp_path / f"warm-{k}") for k, i in enumerate(order)], one, quiet)
        )
    for i, case in enumerate(cases):
        (alone,) = results_of(run_batch(logged, [into(case, tmp_path / f"alone-{i}")], 1, quiet))
        assert all(found == alone for found, of in zip(warm, order, strict=True) if of == i)


def test_a_run_of_a_sweep_does_without_what_no_table_shows(monkeypatch):
    def unasked(*given, **options):
        raise AssertionError("no figure of merit needs it")

    for name in ("map_growth", "fit_primitive", "HeightMap"):
        monkeypatch.setattr(exploration, name, unasked)
    (run,) = planned(fixed=SMALL, experiment="explore").runs
    found = attempt(run.case)
    assert (found.status, found.message) == (RunStatus.DONE, "")
    assert None not in {found.figures[name] for name in ("map_rms_m", "force_rms_n", "contacts")}


def scene(target=None, stiffness=20e3):
    law = ContactLaw(stiffness=stiffness)
    return build_scene(Tip(Sphere(0.008)), target or SphereObject(0.04), law, (0.0, 0.0, 0.1))


def bytes_of(model):
    buffer = np.empty(mujoco.mj_sizeModel(model), np.uint8)
    mujoco.mj_saveModel(model, None, buffer)
    return buffer.tobytes()


@pytest.mark.parametrize("target", [None, Torus()], ids=["sphere", "torus"])
def test_a_scene_that_was_compiled_before_is_a_copy_that_nobody_else_has(target):
    first = scene(target)
    fresh = bytes_of(first.model)
    first.model.opt.gravity[2] = 7.0
    again = scene(copy.copy(target))
    assert again.model is not first.model
    assert bytes_of(again.model) == fresh
    assert bytes_of(scene(target, 10e3).model) != fresh


def test_a_kind_of_object_that_is_defined_anew_is_compiled_anew():
    """As in a notebook: the same name and the same values, but other code."""

    def defined(radius):
        class Ball(SphereObject):
            def add_geom(self, body, name):
                SphereObject(radius).add_geom(body, name)

        Ball.__qualname__ = "Ball"
        return Ball(0.04)

    small, large = (scene(defined(radius)).model.geom("object").size[0] for radius in (0.03, 0.05))
    assert (small, large) == (0.03, 0.05)
