"""The directive `{public-names} MODULE`: what a package or module is meant to be used by, from its docstrings.

A name that several packages offer is explained once, where it lives, and linked to from the others. Docstrings of
palpate are plain text with code in backticks, not reStructuredText: what that would take for markup is escaped.
"""

import ast
import builtins
import inspect
import re
from importlib import import_module
from types import ModuleType
from typing import Any

from docutils import nodes
from docutils.statemachine import StringList
from sphinx import addnodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

MARKUP = re.compile(r"(?P<code>`+[^`]+`+)(?P<ending>\w?)|(?P<mark>[*|\\]|(?<=\w)_(?=\W|$))")
"""Code in backticks, which stays, also in the plural; or a character that would begin markup."""

HEADER = re.compile(r"[A-Z][A-Za-z ]+:$")
"""Begins a section that napoleon reads: Args, Returns, Attributes, ..."""

ARRAYS = {
    "~numpy.ndarray[tuple[~typing.Any, ...], ~numpy.dtype[~numpy.float64]]": "FloatArray",
    "~numpy._typing._array_like._Buffer | "
    "~numpy._typing._array_like._SupportsArray[~numpy.dtype[~typing.Any]] | "
    "~numpy._typing._nested_sequence._NestedSequence["
    "~numpy._typing._array_like._SupportsArray[~numpy.dtype[~typing.Any]]] | "
    "complex | bytes | str | ~numpy._typing._nested_sequence._NestedSequence[complex | bytes | str]": "ArrayLike",
    "<factory>": "...",
}
"""What signatures show, and what the source says: types of arrays, and defaults that are made anew."""

GENERATED = re.compile(r"Alias for field number \d+")
"""The docstring of a field of a NamedTuple; its class explains it."""


def imported_from(module: ModuleType) -> dict[str, str]:
    """Return from which module each name that `module` imports comes."""
    tree = ast.parse(inspect.getsource(module))
    return {
        (alias.asname or alias.name): node.module
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom) and node.module
        for alias in node.names
    }


def names_of(module: ModuleType) -> list[str]:
    """Return the public names of a module: `__all__`, or what it passes on (`X as X`), or what it defines."""
    if hasattr(module, "__all__"):
        return sorted(module.__all__)
    tree = ast.parse(inspect.getsource(module))
    passed = [
        alias.name
        for node in tree.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
        if alias.asname == alias.name
    ]
    if passed:
        return sorted(passed)
    defined: list[str] = []
    for node in tree.body:
        if isinstance(node, ast.ClassDef | ast.FunctionDef):
            defined.append(node.name)
        elif isinstance(node, ast.Assign | ast.AnnAssign):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            defined += [target.id for target in targets if isinstance(target, ast.Name)]
    return [name for name in defined if not name.startswith("_")]


def directive_for(module: ModuleType, name: str) -> list[str]:
    """Return what asks autodoc for a name."""
    thing = getattr(module, name)
    if inspect.isclass(thing):
        return [f".. autoclass:: {module.__name__}.{name}", "   :members:", ""]
    if inspect.isroutine(thing):
        return [f".. autofunction:: {module.__name__}.{name}", ""]
    home = imported_from(module).get(name, module.__name__)
    return [f".. autodata:: {home}.{name}", "   :no-value:", ""]


class PublicNames(SphinxDirective):
    """A module's summary, and each of its names."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """Return the nodes."""
        module = import_module(self.arguments[0])
        listed = self.env.config.public_modules
        lines = [*inspect.cleandoc(module.__doc__ or "").splitlines(), ""]
        lines = as_markup(lines)
        lines = ["```{eval-rst}", f".. py:module:: {module.__name__}", "", *lines]
        elsewhere = []
        for name in names_of(module):
            home = home_of(module, name, listed)
            if home == module.__name__:
                lines += directive_for(module, name)
            else:
                elsewhere.append(f":py:obj:`{name} <{home}.{name}>`")
        if elsewhere:
            lines += ["Explained elsewhere: " + ", ".join(elsewhere) + ".", ""]
        found = nodes.Element()
        text = StringList([*lines, "```"], source=module.__name__)
        self.state.nested_parse(text, self.content_offset, found, match_titles=True)
        return found.children


def home_of(module: ModuleType, name: str, listed: list[str]) -> str:
    """Return which of the listed modules explains a name of this one."""
    defined = getattr(getattr(module, name), "__module__", None)
    if not isinstance(defined, str) or not defined.startswith("palpate"):
        defined = imported_from(module).get(name, module.__name__)
    offering = [
        each for each in listed if (defined + ".").startswith(each + ".") and name in names_of(import_module(each))
    ]
    return max(offering, key=len, default=module.__name__)


def escaped(line: str) -> str:
    """Return a line of plain text as reStructuredText."""

    def kept(found: re.Match[str]) -> str:
        if found["mark"]:
            return "\\" + found["mark"]
        return found["code"] + ("\\ " + found["ending"] if found["ending"] else "")

    return MARKUP.sub(kept, line)


def as_markup(lines: list[str]) -> list[str]:
    """Return a docstring as reStructuredText: lines that are set in, formulas mostly, stand as they are."""
    result: list[str] = []
    in_section = in_formula = False
    for line in lines:
        indented = line.startswith("    ")
        if line and not line[0].isspace():
            in_section = bool(HEADER.match(line))
        if indented and not in_section and not in_formula and not is_item(result):
            result += ["", "::", ""]
            in_formula = True
        elif in_formula and line and not indented:
            result += [""] * bool(result[-1])
            in_formula = False
        result.append(line if in_formula else escaped(line))
    return result


def is_item(lines: list[str]) -> bool:
    """Whether the paragraph at the end of these lines is an item of a list."""
    for line in reversed(lines):
        if not line:
            return False
        if line.lstrip().startswith(("- ", "1. ", "2. ")):
            return True
    return False


def on_docstring(app: Sphinx, what: str, name: str, thing: Any, options: Any, lines: list[str]) -> None:
    """Make a docstring markup before napoleon reads it."""
    if what in {"data", "attribute"} and inspect.cleandoc(thing.__doc__ or "") == "\n".join(lines).strip():
        lines.clear()  # a value without words of its own: these are its type's
    # of a value, napoleon takes the words before a colon in the first line for its type
    before = [""] if what in {"data", "attribute", "property"} else []
    lines[:] = before + as_markup(lines)


def on_doctree(app: Sphinx, doctree: nodes.document) -> None:
    """Take links off types without a module, as `object`: Sphinx would find any attribute of that name."""
    for link in list(doctree.findall(addnodes.pending_xref)):
        target = link.get("reftarget", "")
        if link.get("refdomain") != "py" or link.get("reftype") not in {"class", "obj"} or "." in target:
            continue
        if link.get("refspecific") or hasattr(builtins, target):
            link.replace_self(nodes.Text(target))


def on_signature(
    app: Sphinx, what: str, name: str, thing: Any, options: Any, signature: str | None, result: str | None
) -> tuple[str | None, str | None]:
    """Write types of arrays as the source does, not as they are made; nobody makes a protocol."""
    if getattr(thing, "_is_protocol", False):
        return "", result
    return short_types(signature), short_types(result)


def short_types(text: str | None) -> str | None:
    """Return a signature as a reader of the source knows it."""
    for shown, meant in ARRAYS.items():
        text = text and text.replace(shown, meant)
    return text


def on_member(app: Sphinx, what: str, name: str, thing: Any, skip: bool, options: Any) -> bool | None:
    """Leave out what only repeats what its class says."""
    return True if GENERATED.fullmatch(getattr(thing, "__doc__", None) or "") else None


def setup(app: Sphinx) -> dict[str, bool]:
    """Make it known to Sphinx."""
    app.add_config_value("public_modules", [], "env")
    app.add_directive("public-names", PublicNames)
    # before napoleon's own, which makes markup
    app.connect("autodoc-process-docstring", on_docstring, priority=100)
    app.connect("autodoc-process-signature", on_signature)
    app.connect("autodoc-skip-member", on_member)
    app.connect("doctree-read", on_doctree)
    return {"parallel_read_safe": True}
