"""Somebody's own object, named as `module:name` or `file.py:name`; the present folder is looked in first."""

import importlib
import importlib.util
import os
import sys
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType
from typing import Any

from palpate.errors import InvalidValueError
from palpate.nearest_name import nearest


def named_object(option: str, name: str, example: str) -> Any:
    """Return what `module:name` names.

    Args:
        option: That was typed, for messages.
        name: As typed.
        example: Of what to write.

    Raises:
        InvalidValueError: There is no such module or name, or the module cannot be imported.
    """
    module_name, colon, wanted = name.rpartition(":")  # a path on Windows has one, too
    if not (colon and module_name and wanted):
        raise InvalidValueError(f"{option} = {name}: write MODULE:NAME, as in {example}")
    module = _module(option, name, module_name)
    found = getattr(module, wanted, None)
    if found is None:
        own = [other for other in vars(module) if not other.startswith("_") and callable(getattr(module, other))]
        near = nearest(wanted, own)
        advice = f"did you mean {near}?" if near else f"there are {', '.join(own) or 'none'}"
        raise InvalidValueError(f"{option} = {name}: nothing in {module_name} is called {wanted}; {advice}")
    return found


def raised(what: str, error: Exception) -> str:
    """Return what an exception in somebody's code was, and the last line of theirs or of what they called."""
    where = traceback.extract_tb(error.__traceback__)
    line = f" ({where[-1].filename}, line {where[-1].lineno})" if where else ""
    if isinstance(error, SyntaxError):
        return f"{what} raised {type(error).__name__}: {error.msg} ({error.filename}, line {error.lineno})"
    return f"{what} raised {type(error).__name__}: {error}{line}"


def _module(option: str, name: str, module_name: str) -> ModuleType:
    try:
        if module_name.endswith(".py"):
            return _from_file(Path(module_name))
        with _present_folder_first():
            return importlib.import_module(module_name)
    except FileNotFoundError:
        raise InvalidValueError(f"{option} = {name}: there is no file {module_name} in {os.getcwd()}") from None
    except ModuleNotFoundError as error:
        if error.name is None or not f"{module_name}.".startswith(f"{error.name}."):
            raise InvalidValueError(f"{option} = {name}: {raised(module_name, error)}") from error
        raise InvalidValueError(
            f"{option} = {name}: there is no module {error.name}, neither in {os.getcwd()} nor installed"
        ) from None
    except Exception as error:
        raise InvalidValueError(f"{option} = {name}: {raised(f'importing {module_name}', error)}") from error


def _from_file(path: Path) -> ModuleType:
    """Import a file under its whole path, once: its classes differ from those of another file of that name."""
    whole = path.resolve(strict=True)
    known = sys.modules.get(str(whole))
    if known is not None:
        return known
    spec = importlib.util.spec_from_file_location(str(whole), whole)
    assert spec is not None  # it ends in .py
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[str(whole)] = module  # dataclasses look their module up while it is made
    try:
        spec.loader.exec_module(module)
    except BaseException:
        del sys.modules[str(whole)]
        raise
    return module


@contextmanager
def _present_folder_first() -> Iterator[None]:
    """Look for modules in the present folder, as `python -m palpate` does and the installed command does not."""
    before = list(sys.path)
    sys.path.insert(0, os.getcwd())
    importlib.invalidate_caches()
    try:
        yield
    finally:
        sys.path[:] = before
