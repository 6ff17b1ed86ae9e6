"""No test judges the wall clock, but those that are marked slow: a busy machine makes it say anything.

    python tests/support/no_wall_clock.py tests

Finds in all functions below a folder, except those marked `slow` (by themselves, their class or their module):
differences with a reading of a clock in them, and judgements that compare one with a deadline. What a reading is
assigned to, added to or appended to in the same function counts as one. To compare stamps of samples, or one with
now, is no finding. Says a line for each, and ends with 1 if there is any.
"""

import ast
import sys
from collections.abc import Iterator
from pathlib import Path

SERVICES = (
    # what is emulated happens in real time, as that of the device would
    "tests/support/emulated_bus.py",
    "tests/support/ft_host.py",
    "tests/support/fake_ur_library.py",
    "tests/support/ur_wire_sessions.py",
    "tests/support/rig_devices.py",
    # the one deadline helper
    "tests/support/waiting.py",
)
"""Modules that have a clock: they serve tests, and judge nothing."""

DIFFERENCE = "a difference of clock readings: count or order what it is there for, hand a clock in, or benchmarks/"
DEADLINE = "a deadline of its own: wait with `until` of tests/support/waiting.py"

STEADY = {
    f"{name}{ns}" for name in ("monotonic", "perf_counter", "process_time", "thread_time") for ns in ("", "_ns")
}
WALL = {"time", "time_ns"}
SAME = {"min", "max", "float", "int", "round", "abs", "sum", "list", "tuple", "sorted", "array", "asarray"}
"""Functions that give a reading if they are given one."""

FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef)
SCOPES = (*FUNCTIONS, ast.ClassDef)


def findings(source: str) -> list[tuple[int, str]]:
    """Return the lines of a module that judge a clock, and what is wrong there."""
    tree = ast.parse(source)
    return sorted(set(_Scope(tree, None).findings()))


class _Scope:
    """A module, class or function: which names in it are the time module, clocks, readings of one, deadlines."""

    def __init__(self, node: ast.AST, outer: "_Scope | None") -> None:
        self.node = node
        self.modules = set(outer.modules) if outer else {"time"}
        self.clocks = set(outer.clocks) if outer else set()
        self.readings = set(outer.readings) if outer else set()
        self.deadlines = set(outer.deadlines) if outer else set()
        if isinstance(node, FUNCTIONS):
            self._take_parameters(node.args)
        before = -1
        while before != (before := len(self.clocks) + len(self.readings) + len(self.deadlines)):
            for each in self._own():
                self._note(each)

    def findings(self) -> Iterator[tuple[int, str]]:
        if _is_slow(self.node):
            return
        for each in self._own():
            if isinstance(each, SCOPES):
                yield from _Scope(each, self).findings()
            elif isinstance(each, ast.BinOp) and isinstance(each.op, ast.Sub):
                if self._is_reading(each.left) or self._is_reading(each.right):
                    yield each.lineno, DIFFERENCE
            elif isinstance(each, ast.AugAssign) and isinstance(each.op, ast.Sub):
                if self._is_reading(each.target) or self._is_reading(each.value):
                    yield each.lineno, DIFFERENCE
            elif isinstance(each, ast.Call) and _name(each.func) in ("diff", "ptp"):
                if any(self._is_reading(given) for given in each.args):
                    yield each.lineno, DIFFERENCE
            elif isinstance(each, ast.Assert) or (isinstance(each, ast.If) and _fails(each)):
                yield from ((each.lineno, DEADLINE) for part in ast.walk(each.test) if self._waits(part))

    def _own(self) -> Iterator[ast.AST]:
        """All that is in it, but not what is in functions and classes within it."""
        waiting = list(ast.iter_child_nodes(self.node))
        while waiting:
            each = waiting.pop()
            yield each
            if not isinstance(each, SCOPES):
                waiting.extend(ast.iter_child_nodes(each))

    def _take_parameters(self, given: ast.arguments) -> None:
        everything = (*given.posonlyargs, *given.args, *given.kwonlyargs)
        defaults = [*given.defaults, *given.kw_defaults]
        clocks = {each.arg for each, value in zip(reversed(everything), reversed(defaults), strict=False)
                  if value is not None and self._is_clock(value)}  # fmt: skip
        for names in (self.clocks, self.readings, self.deadlines):
            names.difference_update(each.arg for each in everything)
        self.clocks |= clocks

    def _note(self, node: ast.AST) -> None:
        match node:
            case ast.Import(names=names):
                self.modules.update(each.asname or each.name for each in names if each.name == "time")
            case ast.ImportFrom(module="time", names=names):
                self.clocks.update(each.asname or each.name for each in names if each.name in STEADY | WALL)
            case ast.Assign(targets=targets, value=value):
                for target in targets:
                    self._assign(target, value)
            case (
                ast.AnnAssign(target=target, value=ast.expr() as value) | ast.NamedExpr(target=target, value=value)
            ):
                self._assign(target, value)
            case ast.AugAssign(target=target, value=value) if self._is_reading(value):
                self._assign(target, value)
            case ast.For(target=target, iter=value) | ast.comprehension(target=target, iter=value):
                self._assign(target, value)
            case ast.Call(func=ast.Attribute(value=value, attr="append"), args=[what]):
                self._assign(value, what)

    def _assign(self, target: ast.expr, value: ast.expr) -> None:
        if isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple) and len(target.elts) == len(value.elts):
            for each, its in zip(target.elts, value.elts, strict=True):
                self._assign(each, its)
        elif isinstance(target, ast.Name | ast.Attribute):
            name = ast.unparse(target)
            if self._is_clock(value):
                self.clocks.add(name)
            if self._is_reading(value):
                self.readings.add(name)
            if self._is_deadline(value):
                self.deadlines.add(name)

    def _is_clock(self, node: ast.expr) -> bool:
        if isinstance(node, ast.Attribute) and (node.attr in STEADY or _name(node.value) in self.modules):
            return node.attr in STEADY | WALL
        return ast.unparse(node) in self.clocks

    def _is_reading(self, node: ast.expr) -> bool:
        match node:
            case ast.Call(func=function) if self._is_clock(function):
                return True
            case ast.Call(func=function, args=given) if _name(function) in SAME:
                return any(self._is_reading(each) for each in given)
            case ast.Name() | ast.Attribute():
                return ast.unparse(node) in self.readings
            case ast.BinOp(left=left, right=right):
                return self._is_reading(left) or self._is_reading(right)
            case ast.BoolOp(values=parts) | ast.Tuple(elts=parts) | ast.List(elts=parts):
                return any(self._is_reading(each) for each in parts)
            case ast.IfExp(body=one, orelse=other):
                return self._is_reading(one) or self._is_reading(other)
            case ast.NamedExpr(value=inner) | ast.UnaryOp(operand=inner) | ast.Subscript(value=inner):
                return self._is_reading(inner)
            case ast.ListComp(elt=inner) | ast.GeneratorExp(elt=inner) | ast.Starred(value=inner):
                return self._is_reading(inner)
        return False

    def _is_deadline(self, node: ast.expr) -> bool:
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add):
            return self._is_reading(node)
        return isinstance(node, ast.Name | ast.Attribute) and ast.unparse(node) in self.deadlines

    def _waits(self, node: ast.AST) -> bool:
        if not isinstance(node, ast.Compare):
            return False
        sides = (node.left, *node.comparators)
        return all(self._is_reading(each) for each in sides) and any(self._is_deadline(each) for each in sides)


def _name(node: ast.expr) -> str:
    return node.attr if isinstance(node, ast.Attribute) else node.id if isinstance(node, ast.Name) else ""


def _is_slow(node: ast.AST) -> bool:
    """Whether a function or class is marked, or a module by `pytestmark`."""
    if isinstance(node, ast.Module):
        marks = [each.value for each in node.body if isinstance(each, ast.Assign) and _marks(each)]
    else:
        assert isinstance(node, SCOPES)
        marks = [
            *node.decorator_list,
            *(each.value for each in node.body if isinstance(each, ast.Assign) and _marks(each)),
        ]
    return any(
        ast.unparse(each) == "pytest.mark.slow"
        for mark in marks
        for each in ast.walk(mark)
        if isinstance(each, ast.expr)
    )


def _marks(node: ast.Assign) -> bool:
    return any(_name(target) == "pytestmark" for target in node.targets)


def _fails(node: ast.If) -> bool:
    """Whether what is judged raises."""
    return any(
        isinstance(each, ast.Raise) or (isinstance(each, ast.Call) and ast.unparse(each.func) == "pytest.fail")
        for part in node.body
        for each in ast.walk(part)
    )


def main() -> int:
    """Check all modules below the folders on the command line."""
    count = 0
    for file in sorted(path for folder in sys.argv[1:] for path in Path(folder).rglob("*.py")):
        if not file.as_posix().endswith(SERVICES):
            for line, message in findings(file.read_text(encoding="utf-8")):
                count += 1
                print(f"{file}:{line}: {message}")  # noqa: T201
    return 1 if count else 0


if __name__ == "__main__":
    sys.exit(main())
