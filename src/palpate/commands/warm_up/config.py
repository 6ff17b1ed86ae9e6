"""What `palpate warm-up` takes; imports nothing heavy, so that `palpate --help` is quick."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class WarmUpConfig:
    """Compile once what palpate would otherwise compile when it is first needed: a minute or a few.

    Contact sensing on every kind of fingertip, controllers, simulation, kinematics, maps, comparison of meshes,
    and grasp forces. What is compiled is kept, for every later program; run again, it reports that there is
    nothing to compile. Ctrl-C keeps what is compiled by then.

    Left out are grasp objectives of your own, and fingertips given by functions of your own, which are never kept.
    Set NUMBA_CACHE_DIR to keep it all elsewhere.

    Example: palpate warm-up
    """
