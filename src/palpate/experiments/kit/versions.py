"""What a run was made with: a replay is bit for bit the same only with the same."""

import platform
from functools import cache
from importlib.metadata import PackageNotFoundError, version

from palpate.yaml_text import yaml_text

VERSIONS_TEXT = "versions.yaml"
"""Under this name a log keeps them."""

PACKAGES = ("palpate", "numpy", "scipy", "numba", "llvmlite", "mujoco", "casadi")
"""Whose arithmetic the numbers of a run depend on."""


@cache
def versions() -> dict[str, str]:
    """Return Python's and the packages' versions."""
    return {"python": platform.python_version(), **{name: _version(name) for name in PACKAGES}}


def versions_text() -> str:
    """Return Python's, the machine's and the packages' versions as YAML."""
    python = {"python": platform.python_version()}
    return yaml_text(python | {"machine": platform.machine(), "system": platform.system()} | versions())


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed as a package"
