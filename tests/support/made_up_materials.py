"""Materials that do not exist, for recognition."""

from palpate.friction.materials.library import MaterialLibrary
from palpate.friction.materials.material import Deviations, Material

SPECIMEN = Deviations(friction=0.015, spin_length=0.02, load_exponent=0.02, norm_exponent=0.05)
EXACT = Deviations(friction=0.0, spin_length=0.0)


def spread(size):
    """Deviations of friction and spin length alike."""
    return Deviations(friction=size, spin_length=size)


def material(name, mu, e=3e-3, gamma=0.1, p=1.6, scatter=0.02, specimen=SPECIMEN, **more):
    if not isinstance(scatter, Deviations):
        scatter = Deviations(friction=scatter, spin_length=scatter, load_exponent=0.01, norm_exponent=0.05)
    return Material(
        name=name, kinetic_friction=mu, spin_length=e, load_exponent=gamma, norm_exponent=p,
        scatter=scatter, specimen=specimen, provenance="made up", **more,
    )  # fmt: skip


def library(*materials):
    return MaterialLibrary(fingertip="made up", materials=materials)
