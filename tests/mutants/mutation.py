"""Mutants: small faults in the package that a test ought to detect.

A mutant is one change of one expression or statement inside a function. Its identity is the text of the statement
in its function, not a line number, so that the same mutants can be made in an older and a newer tree.
"""

import ast
import random
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

Key = TypeVar("Key")

AREAS: Mapping[str, str] = {
    "sensing": "src/palpate/sensing",
    "friction": "src/palpate/friction",
    "grasp": "src/palpate/grasp",
    "mapping": "src/palpate/mapping",
    "controllers": "controllers",
    "supervision": "src/palpate/runtime/supervision",
    "log": "src/palpate/runtime/log",
    "hw": "hw",
}
"""Folders that mutants are drawn from."""

SWAPPED: Mapping[type, type] = {
    ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq,
    ast.Is: ast.IsNot, ast.IsNot: ast.Is, ast.In: ast.NotIn, ast.NotIn: ast.In,
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.And: ast.Or, ast.Or: ast.And,
}  # fmt: skip
"""Operators and those that take their place."""

CALLED: Mapping[str, str] = {"min": "max", "max": "min", "any": "all", "all": "any"}
"""Functions likewise."""

SILENT = ("__repr__", "_repr_html_", "__str__")
"""Functions whose text no behaviour depends on."""


@dataclass(frozen=True, slots=True)
class Mutant:
    """One fault.

    Attributes:
        area: Key of `AREAS`.
        path: File, relative to the tree.
        function: Qualified name of the function.
        statement: Source text of the statement (the first line of a compound one).
        operator: Kind of the change.
        ordinal: Which of the changes of this kind in statements of this text, from 0.
    """

    area: str
    path: str
    function: str
    statement: str
    operator: str
    ordinal: int


@dataclass(frozen=True, slots=True)
class Change:
    """Replacement of a piece of a file.

    Attributes:
        line: First line of the statement, from 1.
        start: First byte that is replaced.
        end: Byte after the last one.
        text: What takes its place.
    """

    line: int
    start: int
    end: int
    text: str


def mutants_of(area: str, path: str, source: str) -> dict[Mutant, Change]:
    """Return every mutant of a file; none of a file with compiled kernels, which are cached across files."""
    if "njit" in source:
        return {}
    starts = [0]
    for line in source.encode().splitlines(keepends=True):
        starts.append(starts[-1] + len(line))
    counts: Counter[tuple[str, str, str]] = Counter()
    found: dict[Mutant, Change] = {}
    for function, statement in _statements(ast.parse(source), ""):
        head = ast.unparse(statement).split("\n")[0]
        for operator, node, text in _changes(statement):
            key = (function, head, operator)
            mutant = Mutant(area, path, function, head, operator, counts[key])
            counts[key] += 1
            start, end = (
                starts[node.lineno - 1] + node.col_offset,
                starts[node.end_lineno - 1] + node.end_col_offset,
            )
            found[mutant] = Change(statement.lineno, start, end, text)
    return found


def changed(source: str, change: Change) -> str:
    """Return the source of a file with a change."""
    whole = source.encode()
    return (whole[: change.start] + change.text.encode() + whole[change.end :]).decode()


def every_mutant(tree: Path) -> dict[Mutant, Change]:
    """Return every mutant of the areas of a tree."""
    found: dict[Mutant, Change] = {}
    for area, folder in AREAS.items():
        for file in sorted((tree / folder).rglob("*.py")):
            path = file.relative_to(tree).as_posix()
            found |= mutants_of(area, path, file.read_text(encoding="utf-8"))
    return found


def drawn(tree: Path, count: int, seed: int) -> list[Mutant]:
    """Return mutants in random order; an area or function with four times as many is drawn from twice as often."""
    rng = random.Random(seed)
    areas: dict[str, dict[tuple[str, str], list[Mutant]]] = {}
    for mutant in every_mutant(tree):
        functions = areas.setdefault(mutant.area, {})
        functions.setdefault((mutant.path, mutant.function), []).append(mutant)
    taken: dict[Mutant, None] = {}
    while len(taken) < count:
        area = _by_root(rng, {name: sum(map(len, functions.values())) for name, functions in areas.items()})
        function = _by_root(rng, {key: len(mutants) for key, mutants in areas[area].items()})
        taken[rng.choice(areas[area][function])] = None
    return list(taken)


def _by_root(rng: random.Random, sizes: Mapping[Key, int]) -> Key:
    """Return a key, with a probability that grows as the square root of its size."""
    (key,) = rng.choices(list(sizes), [size**0.5 for size in sizes.values()])
    return key


def _statements(parent: ast.AST, scope: str) -> Iterator[tuple[str, ast.stmt]]:
    """Yield each statement inside functions that may be changed, with the qualified name of its function."""
    for node in ast.iter_child_nodes(parent):
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            inner = f"{scope}.{node.name}".lstrip(".")
            protocol = isinstance(node, ast.ClassDef) and any(ast.unparse(b) == "Protocol" for b in node.bases)
            if node.name not in SILENT and not protocol:
                yield from _statements(node, inner)
        elif isinstance(node, ast.stmt):
            within = isinstance(parent, ast.FunctionDef) or (scope and not isinstance(parent, ast.ClassDef))
            if within and not isinstance(node, ast.Raise | ast.Import | ast.ImportFrom | ast.Assert):
                yield scope, node
            yield from _statements(node, scope)
        elif isinstance(node, ast.ExceptHandler | ast.match_case):
            yield from _statements(node, scope)


def _changes(statement: ast.stmt) -> Iterator[tuple[str, ast.expr | ast.stmt, str]]:
    """Yield kind, replaced node and new text of each change of a statement's own expressions."""
    if isinstance(statement, ast.If | ast.While):
        yield "negated", statement.test, f"(not ({ast.unparse(statement.test)}))"
    call = isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Call)
    attribute = isinstance(statement, ast.Assign) and isinstance(statement.targets[0], ast.Attribute)
    if call or attribute or isinstance(statement, ast.AugAssign):
        yield "deleted", statement, "pass"
    for node in _own_expressions(statement):
        yield from _changes_of(node)


def _own_expressions(statement: ast.stmt) -> Iterator[ast.expr]:
    """Yield the expressions of a statement, without inner statements, annotations, f-strings and messages."""
    waiting = [
        child
        for name, value in ast.iter_fields(statement)
        if name != "annotation"
        for child in (value if isinstance(value, list) else [value])
        if isinstance(child, ast.expr)
    ]
    while waiting:
        node = waiting.pop(0)
        if isinstance(node, ast.JoinedStr | ast.Lambda):
            continue
        yield node
        waiting += [child for child in ast.iter_child_nodes(node) if isinstance(child, ast.expr | ast.keyword)]
        waiting = [child.value if isinstance(child, ast.keyword) else child for child in waiting]


def _changes_of(node: ast.expr) -> Iterator[tuple[str, ast.expr, str]]:
    if isinstance(node, ast.Compare) and type(node.ops[0]) in SWAPPED:
        other = ast.Compare(node.left, [SWAPPED[type(node.ops[0])](), *node.ops[1:]], node.comparators)
        yield "comparison", node, f"({ast.unparse(other)})"
    elif isinstance(node, ast.BinOp) and type(node.op) in SWAPPED:
        yield "arithmetic", node, f"({ast.unparse(ast.BinOp(node.left, SWAPPED[type(node.op)](), node.right))})"
    elif isinstance(node, ast.BoolOp):
        yield "logic", node, f"({ast.unparse(ast.BoolOp(SWAPPED[type(node.op)](), node.values))})"
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub | ast.Not):
        yield "sign", node, f"({ast.unparse(node.operand)})"
    elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in CALLED:
        yield "function", node.func, CALLED[node.func.id]
    elif isinstance(node, ast.Constant) and isinstance(node.value, bool):
        yield "constant", node, str(not node.value)
    elif isinstance(node, ast.Constant) and isinstance(node.value, int):
        yield "constant", node, str(node.value + 1)
    elif isinstance(node, ast.Constant) and isinstance(node.value, float):
        yield "constant", node, repr(1.1 * node.value if node.value else 1e-3)
