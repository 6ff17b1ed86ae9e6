"""palpate: hybrid force control with the sense of touch.

`import palpate as pp` gives scripts all names of `__init__.pyi`, each imported when it is first used.
"""

from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

from palpate.version import __version__ as __version__


@cache
def _homes() -> dict[str, str]:
    """Modules of the public names, by name: read from the stub, which type checkers read, too."""
    import ast  # only scripts need it, not the commands

    stub = ast.parse(Path(__file__).with_suffix(".pyi").read_text("utf-8"))
    imports = (node for node in stub.body if isinstance(node, ast.ImportFrom))
    homes = {alias.name: node.module or "" for node in imports for alias in node.names}
    return {name: homes[name] for name in sorted(homes) if not name.startswith("_")}


def __getattr__(name: str) -> Any:
    # Imported when first used: numba alone takes longer to import than everything else together.
    if name == "__all__":
        return list(_homes())
    if name.startswith("_"):  # Python itself looks for optional attributes
        raise AttributeError(f"module 'palpate' has no attribute {name!r}")
    if name not in _homes():
        from palpate.nearest_name import nearest

        near = nearest(name, tuple(_homes()))
        remedy = f"did you mean {near}?" if near else "dir(palpate) lists its names"
        raise AttributeError(f"module 'palpate' has no attribute {name!r}: {remedy}")
    return getattr(import_module(_homes()[name]), name)


def __dir__() -> list[str]:
    return list(_homes())
