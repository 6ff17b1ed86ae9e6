"""Options of `palpate warm-up`; imports nothing heavy, so that `palpate --help` is quick."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class WarmUpConfig:
    """Compile everything now that palpate would otherwise compile at its first use: a minute or a few.

    Contact sensing on every kind of fingertip, controllers, simulation, kinematics, maps, comparison of meshes,
    and grasp forces. Compiled code is kept for every later program; run again, the command reports that there is
    nothing to compile. Ctrl-C keeps the code that is compiled by then.

    Grasp objectives of your own, and fingertips given by functions of your own, are never kept.
    Set NUMBA_CACHE_DIR to keep compiled code elsewhere.

    Example: palpate warm-up
    """
