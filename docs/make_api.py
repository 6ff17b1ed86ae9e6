"""Pages of the public names: `docs/api`, with every docstring, and `docs/public-names.md`, a line for each name.

    python docs/make_api.py           # write docs/public-names.md: `make api`
    python docs/make_api.py --check   # exit code 1 if it is not what the source says now: `make check`

`docs/conf.py` writes the pages of `docs/api` at every build of the site; they are not kept in version control.
Signatures are those of the source, not of the objects: no page depends on a version or a machine. A name that
several modules offer is explained once, nearest to where it is defined. Docstrings are plain text with code in
backticks; their sections (`Args:` and so on) become lists, and indented lines stand as they are: formulas.
"""

import ast
import inspect
import re
import sys
from collections.abc import Iterator
from enum import Enum
from functools import cache
from importlib import import_module
from pathlib import Path
from textwrap import indent
from typing import Any, NamedTuple


class Page(NamedTuple):
    """A page: its title, a sentence below it, and the modules that it explains."""

    title: str
    sentence: str
    modules: tuple[str, ...]


PAGES = {
    "contact": Page(
        "Contacts and fingertips",
        "From a wrench and the shape of a fingertip to the centroid, force and normal of a contact.",
        ("palpate", "palpate.surfaces", "palpate.sensing", "palpate.spatial", "palpate.errors",
         "palpate.sensing.compensation", "palpate.estimation"),
    ),
    "uncertainty": Page(
        "Uncertainty of contacts",
        "How far noise of the sensor moves a contact.",
        ("palpate.sensing.uncertainty", "palpate.sensing.tip_uncertainty"),
    ),
    "tip-calibration": Page(
        "Fingertips calibrated by touch",
        "A fingertip found by touching a plate, an edge or a ball; what a run's own contacts say of it.",
        ("palpate.sensing.tip_calibration", "palpate.sensing.tip_agreement"),
    ),
    "held": Page(
        "Held tools",
        "Feeling through what is held: its wrench, where it touches, at how many places, whether it slips.",
        ("palpate.sensing.held", "palpate.friction.slip.tool_slip", "palpate.friction.slip.place_watch"),
    ),
    "sensor": Page(
        "The force/torque sensor",
        "Calibration, payload, bias and filters of the sensor behind a fingertip.",
        ("palpate.sensing.ft",),
    ),
    "friction": Page(
        "Friction",
        "Limit surfaces: which force and spin torque a contact bears, and how it slips.",
        ("palpate.friction", "palpate.friction.pressure"),
    ),
    "grasp": Page(
        "Grasp forces",
        "The contact forces that hold an object against a load, within friction and joint torques.",
        ("palpate.grasp",),
    ),
    "mapping": Page("Maps", "From contacts along a path to points, fits, maps and files.", ("palpate.mapping",)),
    "kinematics": Page(
        "Kinematics of arms",
        "Poses, Jacobians and joint velocities of serial arms.",
        ("palpate.kinematics",),
    ),
    "testing": Page(
        "Checks for pieces of your own",
        "Whether a back end, a sensor, an arm, a controller or a fingertip is what palpate takes it for.",
        ("palpate.testing",),
    ),
    "runtime": Page(
        "Running",
        "The seam between controllers and robots, the loop that runs over it, and values that change as it runs.",
        ("palpate.runtime", "palpate.runtime.live"),
    ),
    "supervision": Page(
        "Supervision",
        "Limits of a run, and what happens when one is broken.",
        ("palpate.runtime.supervision",),
    ),
    "log": Page(
        "Logs",
        "Recording every period of a run, reading it back, and replaying it.",
        ("palpate.runtime.log", "palpate.runtime.truth", "palpate.commands.replay.run"),
    ),
    "exporting": Page(
        "Data sets",
        "Logs as files of other programs, and what a format of your own is.",
        ("palpate.exporting.exporter", "palpate.exporting.tables"),
    ),
    "batch": Page(
        "Many runs at once",
        "Sweeps over several processes or computers.",
        ("palpate.runtime.batch", "palpate.commands.sweep"),
    ),
    "controllers": Page(
        "Controllers",
        "Hybrid control of force and motion: one step per period, from an observation to a command.",
        ("palpate.controllers",),
    ),
    "paths": Page(
        "Paths of explorations",
        "Strategies that say where an exploration goes next.",
        ("palpate.controllers.paths",),
    ),
    "grip": Page(
        "Grip control",
        "How hard a hand grips what it holds, from what it feels of friction and slip.",
        ("palpate.controllers.grip.belief", "palpate.controllers.grip.lift", "palpate.controllers.grip.slip_safe",
         "palpate.controllers.grip.shared_grip", "palpate.controllers.grip.controller_sequence",
         "palpate.controllers.grip.turn", "palpate.controllers.grip.parameters"),
    ),
    "sim": Page(
        "Simulation",
        "Scenes in MuJoCo, and the back end that runs them.",
        ("palpate.sim", "palpate.sim.scene_cost", "palpate.sim.friction.law"),
    ),
    "hand": Page(
        "The simulated hand",
        "A Dynamixel hand in simulation, and what it holds, lifts and turns.",
        ("palpate.sim.hand.hand", "palpate.sim.hand.turning_hand", "palpate.sim.hand.contact",
         "palpate.sim.hand.scene", "palpate.sim.hand.backend"),
    ),
    "hw": Page(
        "Devices",
        "Arms, hands and force/torque sensors, and the rig that makes one back end of them.",
        ("palpate.hw.devices", "palpate.hw.ur", "palpate.hw.dynamixel.hand", "palpate.hw.dynamixel.settings",
         "palpate.hw.netft", "palpate.hw.serial_ft", "palpate.hw.rig"),
    ),
    "emulators": Page(
        "Emulators",
        "Devices that are not there, and answer on the wire as real ones do.",
        ("palpate.hw.emulators.process", "palpate.hw.emulators.host", "palpate.hw.emulators.ur",
         "palpate.hw.emulators.dynamixel.bus", "palpate.hw.emulators.netft", "palpate.hw.emulators.serial_ft"),
    ),
    "experiments": Page(
        "Experiments",
        "What the commands do, from a script: a configuration goes in, a result comes out.",
        ("palpate.experiments.explore", "palpate.experiments.explore.exploration", "palpate.experiments.regulate",
         "palpate.experiments.regulate.result", "palpate.experiments.friction",
         "palpate.experiments.friction.result", "palpate.experiments.grasp", "palpate.experiments.grasp.result",
         "palpate.experiments.tip_calibration", "palpate.experiments.tip_calibration.result"),
    ),
    "kit": Page(
        "Experiments of your own",
        "What an experiment is, its options, its plan, its runs, and where it is found.",
        ("palpate.experiments.kit", "palpate.experiments.kit.one_finger", "palpate.experiments.kit.recorded_run",
         "palpate.experiments.kit.recorded_periods", "palpate.experiments.kit.script",
         "palpate.experiments.kit.from_log", "palpate.experiments.kit.recording",
         "palpate.experiments.kit.registry", "palpate.experiments.kit.scene", "palpate.csv_table"),
    ),
    "robots": Page(
        "Robots",
        "From a robot file to what moves: simulated, emulated, or a rig of devices.",
        ("palpate.robots.robot", "palpate.open_kinds", "palpate.robots.robot_kind",
         "palpate.robots.simulated_kind",
         "palpate.robots.arm_kind", "palpate.robots.hand_kind", "palpate.robots.sensor_kind",
         "palpate.robots.surface_entries", "palpate.robots.device_settings", "palpate.robots.rig",
         "palpate.robots.values", "palpate.robots.in_scene", "palpate.robots.task",
         "palpate.robots.hand_description", "palpate.robots.hand_task"),
    ),
    "viewing": Page("The view", "A run in a browser, live or from its log.", ("palpate.viewing",)),
    "reporting": Page(
        "Reports",
        "What a run tells its reader: HTML, tables, pictures.",
        ("palpate.reporting.report", "palpate.reporting.data", "palpate.reporting.page",
         "palpate.reporting.figure", "palpate.reporting.marks", "palpate.reporting.solids",
         "palpate.reporting.paper", "palpate.reporting.run_figures", "palpate.reporting.grasp_figures"),
    ),
}  # fmt: skip
"""The pages in the order of the contents."""

INDEX = """# API

What each package offers, from its docstrings. SI units everywhere; a wrench is what the object exerts on the
finger, and a normal points out of the fingertip into the object ([conventions](../design.md#conventions)).
"""

FOLDER = Path(__file__).parent / "api"
LIST = Path(__file__).parent / "public-names.md"
COMMAND = "make api"
MADE = f"<!-- Made from docstrings: edit those, then run `{COMMAND}`. -->"

LIST_INTRODUCTION = """# Public names

Every public name by its module, with the first sentence of its docstring. The site (`make docs`) has the whole of
each: signature, arguments, units and errors.
"""

LONGEST_DEFAULT = 40
"""Characters of a default value that is shown; `...` stands for a longer one."""

WIDTH = 92
"""Characters of a signature or a constant in one line; `...` stands for a value that is too long for it."""

SECTION = re.compile(r"(Args|Attributes|Returns|Raises):$")
ENTRY = re.compile(r"([\w.*]+(?:, [\w.*]+)*):(?: |$)(.*)")
"""Of a section: one or several names, a colon, and what they are."""


@cache
def tree_of(module: str) -> ast.Module:
    """Return the syntax tree of a module, or that of its stub if it has one."""
    source = Path(inspect.getfile(import_module(module)))
    stub = source.with_suffix(".pyi")
    return ast.parse((stub if stub.exists() else source).read_text(encoding="utf-8"))


@cache
def contents(parent: ast.Module | ast.ClassDef) -> dict[str, tuple[Any, str]]:
    """Return what a module or class defines, in its order, each with its docstring."""
    found: dict[str, tuple[Any, str]] = {}
    for node, after in zip(parent.body, [*parent.body[1:], None], strict=True):
        if isinstance(node, ast.ClassDef | ast.FunctionDef):
            found.setdefault(node.name, (node, ast.get_docstring(node) or ""))
        elif isinstance(node, ast.Assign | ast.AnnAssign):
            below = after.value if isinstance(after, ast.Expr) else None
            said = below.value if isinstance(below, ast.Constant) and isinstance(below.value, str) else ""
            for target in node.targets if isinstance(node, ast.Assign) else [node.target]:
                if isinstance(target, ast.Name):
                    found.setdefault(target.id, (node, inspect.cleandoc(said)))
    return found


@cache
def imports_of(module: str) -> dict[str, tuple[str, str]]:
    """Return where each name that a module imports comes from, and its name there."""
    nodes = [node for node in ast.walk(tree_of(module)) if isinstance(node, ast.ImportFrom) and node.module]
    return {alias.asname or alias.name: (node.module or "", alias.name) for node in nodes for alias in node.names}


def origin(module: str, name: str) -> tuple[str, str]:
    """Return the module that defines what `module` calls `name`, and its name there."""
    return (module, name) if name in contents(tree_of(module)) else origin(*imports_of(module)[name])


@cache
def names_of(module: str) -> tuple[str, ...]:
    """Return the public names of a module: `__all__`, or what it passes on (`X as X`), or what it defines."""
    if hasattr(import_module(module), "__all__"):
        return tuple(import_module(module).__all__)
    passed = re.findall(r"\b(\w+) as \1\b", ast.unparse(tree_of(module)))
    return tuple(passed or (name for name in contents(tree_of(module)) if name[0] != "_"))


def explained_in(module: str, name: str) -> str:
    """Return which of the listed modules explains a public name of this one."""
    home = origin(module, name)[0] + "."
    listed = (each for page in PAGES.values() for each in page.modules)
    return max((e for e in listed if home.startswith(e + ".") and name in names_of(e)), key=len, default=module)


def as_markdown(said: str) -> str:
    """Return a docstring in Google's style as Markdown."""
    lines: list[str] = []
    section = fence = ""
    for line in [*said.splitlines(), "end"]:
        set_in = line.startswith("    ")
        if fence and line and not set_in:
            fence = ""
            lines = [*"\n".join(lines).rstrip().splitlines(), "```", ""]
        if not line or fence:
            lines.append(line[4:])
        elif not set_in:
            lines += [""] if section else []
            section = line[:-1] if SECTION.match(line) else ""
            lines += ["", line, ""] if section else [re.sub(r"<(?=[A-Za-z/!])", r"\\<", line)]
        elif section:
            entry = ENTRY.match(line[4:]) if section != "Returns" else None
            first = f"- `{entry[1]}`: {entry[2]}" if entry else "- " + line.strip()
            lines.append(first.rstrip() if entry or not lines[-1] else "  " + line.strip())
        elif re.search(r"^ *(-|\d\.) ", "\n".join(lines).rpartition("\n\n")[2], flags=re.MULTILINE):
            lines.append(line)  # goes on with an item of a list
        else:
            fence = "```text"
            lines += ["", fence, line[4:]]
    return re.sub(r"\n{3,}", "\n\n", "\n".join(lines[:-1])).strip()


def shown(node: ast.expr | None, before: str, longest: int = 10_000) -> str:
    """Return an expression of the source after some characters, `...` if it is too long; nothing if there is none.

    That of a field is its default; a name in quotes, of a class that comes later, stands without them.
    """
    if isinstance(node, ast.Call) and ast.unparse(node.func) in {"field", "msgspec.field"}:
        given = {each.arg: each.value for each in node.keywords}
        node = given.get("default", ast.Constant(...) if "default_factory" in given else None)
    elif isinstance(node, ast.Call) and ast.unparse(node.func) == "option":
        node = node.args[0]
    if node is None:
        return ""
    text = ast.unparse(node).replace("'", '"')
    if before != " = " and isinstance(node, ast.Constant):
        text = text.strip('"')
    return before + (text if len(text) <= longest else "...")


def parameters(given: ast.arguments) -> list[str]:
    """Return parameters as they are written, `/` and `*` among them."""
    positional = [*given.posonlyargs, *given.args]
    defaults = [*[None] * (len(positional) - len(given.defaults)), *given.defaults, *given.kw_defaults]
    every = [
        each.arg + shown(each.annotation, ": ") + shown(value, " = ", LONGEST_DEFAULT)
        for each, value in zip([*positional, *given.kwonlyargs], defaults, strict=True)
    ]
    if given.vararg or given.kwonlyargs:
        rest = given.vararg
        every.insert(len(positional), f"*{rest.arg}{shown(rest.annotation, ': ')}" if rest else "*")
    if given.kwarg:
        every.append(f"**{given.kwarg.arg}{shown(given.kwarg.annotation, ': ')}")
    if given.posonlyargs:
        every.insert(len(given.posonlyargs), "/")
    return every


def made_from(thing: type) -> list[str] | None:
    """Return what makes an instance: what `__init__` takes, or the fields of a dataclass, NamedTuple or Struct."""
    if getattr(thing, "_is_protocol", False) or issubclass(thing, Enum):
        return None
    ours = [each for each in thing.__mro__ if each.__module__.startswith("palpate.")]
    bodies = [contents(contents(tree_of(each.__module__))[each.__name__][0]) for each in ours]
    for each, body in zip(ours, bodies, strict=True):
        if "__init__" in body:
            return parameters(body["__init__"][0].args)[1:]
        if vars(each).keys() & {"__init__", "_fields", "__struct_fields__"}:
            break
    else:
        return None
    every: list[str] = []
    for name, parameter in inspect.signature(thing).parameters.items():
        if parameter.kind is parameter.KEYWORD_ONLY and "*" not in every:
            every.append("*")
        node = next(body[name][0] for body in bodies if name in body)
        every.append(name + shown(node.annotation, ": ") + shown(node.value, " = ", LONGEST_DEFAULT))
    return every


def block(name: str, given: list[str] | None = None, ending: str = "") -> str:
    """Return a signature as a block of code, with a line for each parameter if it is long."""
    line = name if given is None else f"{name}({', '.join(given)}){ending}"
    if given and len(line) > WIDTH:
        line = "\n".join([f"{name}(", *(f"    {each}," for each in given), f"){ending}"])
    return f"```py\n{line}\n```"  # `python` would be an example: tests run those


def member(owner: str, name: str, node: Any) -> str:
    """Return the signature of a class's member, in one line."""
    if not isinstance(node, ast.FunctionDef):
        return name + shown(getattr(node, "annotation", None), ": ") + shown(node.value, " = ", LONGEST_DEFAULT)
    marks = {ast.unparse(each) for each in node.decorator_list}
    if marks & {"property", "cached_property"}:
        return name + shown(node.returns, ": ")
    given = parameters(node.args)["staticmethod" not in marks :]
    of = f"{owner}." if marks & {"staticmethod", "classmethod"} else ""
    return f"{of}{name}({', '.join(given)}){shown(node.returns, ' -> ')}"


def about_class(thing: type, node: ast.ClassDef, said: str) -> Iterator[str]:
    """Yield the paragraphs about a class: signature, bases, docstring, and each public member that it defines."""
    yield block(f"class {node.name}", made_from(thing))
    bases = [f"`{ast.unparse(each)}`" for each in node.bases if ast.unparse(each)[0] != "_"]
    yield f"Bases: {', '.join(bases)}." if bases else ""
    yield as_markdown(said)
    before = "Members:\n\n"
    for name, (inside, words) in contents(node).items():
        bare = issubclass(thing, Enum) and not re.search(rf"^    (\w+, )*{name}\b.*:", said, flags=re.MULTILINE)
        if name[0] != "_" and (words or bare):
            yield f"{before}- `{member(node.name, name, inside)}`\n\n{indent(as_markdown(words), '  ')}".rstrip()
            before = ""


def about_module(module: str) -> Iterator[str]:
    """Yield the paragraphs about a module: docstring, which names are explained elsewhere, and the others."""
    yield f"## {module}"
    yield as_markdown(inspect.cleandoc(import_module(module).__doc__ or ""))
    homes = {name: explained_in(module, name) for name in names_of(module)}
    for home in dict.fromkeys(home for home in homes.values() if home != module):
        page = next(page for page, (_, _, modules) in PAGES.items() if home in modules)
        names = ", ".join(f"`{name}`" for name in homes if homes[name] == home)
        yield f"Explained in [{home}]({page}.md#{home.replace('.', '')}): {names}."
    for name in (name for name in homes if homes[name] == module):
        yield f"### {name}"
        home, there = origin(module, name)
        node, said = contents(tree_of(home))[there]
        if isinstance(node, ast.ClassDef):
            yield from about_class(getattr(import_module(home), there), node, said)
            continue
        if isinstance(node, ast.FunctionDef):
            yield block(f"def {name}", parameters(node.args), shown(node.returns, " -> "))
        else:
            typed = name + shown(getattr(node, "annotation", None), ": ")
            yield block(typed + shown(node.value, " = ", WIDTH - len(typed)))
        yield as_markdown(said)


def pages() -> dict[str, str]:
    """Return the text of each page, by the name of its file."""
    listed = [f"- [{page.title}]({name}.md): {page.sentence}" for name, page in PAGES.items()]
    order = ["```{toctree}", ":hidden:", "", *PAGES, "```"]
    made = {"index.md": [MADE, INDEX.strip(), "\n".join(listed), "\n".join(order)]}
    for name, page in PAGES.items():
        explained = (each for module in page.modules for each in about_module(module))
        made[f"{name}.md"] = [MADE, f"# {page.title}", page.sentence, *explained]
    return {name: "\n\n".join(filter(None, parts)) + "\n" for name, parts in made.items()}


def write_pages(folder: Path = FOLDER) -> None:
    """Write the pages of the API into a folder; a page that is already right is not touched."""
    folder.mkdir(exist_ok=True)
    texts = pages()
    for path in {*folder.glob("*.md")} - {folder / name for name in texts}:
        path.unlink()
    for name, text in texts.items():
        page = folder / name
        if not page.exists() or page.read_text(encoding="utf-8") != text:
            page.write_text(text, encoding="utf-8")


def public_names() -> str:
    """Return the text of `docs/public-names.md`."""
    parts = [MADE, LIST_INTRODUCTION.strip()]
    for module in (each for page in PAGES.values() for each in page.modules):
        lines = [_line(module, name) for name in names_of(module) if explained_in(module, name) == module]
        parts += [f"## {module}", "\n".join(lines)] if lines else []
    return "\n\n".join(parts) + "\n"


def _line(module: str, name: str) -> str:
    home, there = origin(module, name)
    _, said = contents(tree_of(home))[there]
    sentence = re.split(r"(?<=[.:])\s", " ".join(said.split("\n\n")[0].split()))[0].rstrip(":")
    return f"- `{name}`: {re.sub(r'<(?=[A-Za-z/!])', chr(92) + '<', sentence)}" if sentence else f"- `{name}`"


def main(arguments: list[str]) -> int:
    """Write the list of names, or with `--check` only say that it is stale; return the exit code."""
    text = public_names()
    if LIST.exists() and LIST.read_text(encoding="utf-8") == text:
        return 0
    if arguments == ["--check"]:
        print(f"docs/{LIST.name} differs from the source: run `{COMMAND}`", file=sys.stderr)
        return 1
    LIST.write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
