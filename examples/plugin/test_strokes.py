"""The controller keeps the rules of controllers."""

from palpate_texture.experiment import TextureConfig
from palpate_texture.strokes import Strokes

from palpate.testing import check_controller


def test_strokes_are_a_pure_step_function():
    check_controller(lambda: Strokes(TextureConfig(), half=0.01, gain=5e-4))
