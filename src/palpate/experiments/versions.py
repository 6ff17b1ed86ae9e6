"""What a run was made with: a replay is bit for bit the same only with the same."""

import platform
from importlib.metadata import PackageNotFoundError, version

from palpate.yaml_text import yaml_text

VERSIONS_TEXT = "versions.yaml"
"""Under this name a log keeps them."""

PACKAGES = ("palpate", "numpy", "scipy", "numba", "llvmlite", "mujoco")
"""Whose arithmetic the numbers of a run depend on."""


def versions_text() -> str:
    """Return Python's, the machine's and the packages' versions as YAML."""
    return yaml_text(
        {
            "python": platform.python_version(),
            "machine": platform.machine(),
            "system": platform.system(),
            **{name: _version(name) for name in PACKAGES},
        }
    )


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "not installed as a package"
