"""Refuse to simulate on another MuJoCo than the one that palpate's physics was checked against.

`mujoco` 3.x and `mujoco-core` 4.x fill the same folder, and pip sees no conflict between them: what is imported
need not be what was asked for, so the imported module is asked itself.
"""

import mujoco

from palpate.extras import MissingLibraryError

MAJOR = "4"
"""Version of MuJoCo whose signs, sensors and solver settings the simulation relies on."""


class WrongMujocoError(MissingLibraryError):
    """The MuJoCo that is imported is not the one that palpate needs."""


found = str(getattr(mujoco, "__version__", None))
if found.partition(".")[0] != MAJOR:
    raise WrongMujocoError(
        f"palpate.sim needs MuJoCo {MAJOR}.x, and `import mujoco` finds {found} in {next(iter(mujoco.__path__))}: "
        'in this environment, pip uninstall -y mujoco mujoco-core mujoco-studio && pip install "mujoco>=4,<5"; '
        "what needs 3.x goes into an environment of its own",
        name="mujoco",
    )
