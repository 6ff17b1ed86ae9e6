"""`palpate bench`: all studies with their progress; what is finished is kept, whatever happens then."""

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import cast, get_args

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn
from rich.table import Table
from rich.text import Text

from palpate.atomic_file import replacing
from palpate.commands.answer import Answer, ExitCode
from palpate.commands.json_document import plain
from palpate.commands.output_folder import make_folder
from palpate.commands.progress import lively
from palpate.commands.said import say
from palpate.experiments.bench.config import BenchConfig, StudyName
from palpate.experiments.bench.report import bench_html, quantity, study_facts
from palpate.experiments.bench.study import Measure, Study

STUDIES: Mapping[StudyName, str] = {
    name: f"palpate.experiments.bench.{name}" for name in cast(tuple[StudyName, ...], get_args(StudyName))
}
"""Where each is: imported when its turn comes."""

FILES = ("bench.html", "bench.json")


def run_bench(config: BenchConfig, studies: Mapping[StudyName, str] = STUDIES) -> Answer:
    """Measure, print a table for each study, and write report and figures, anew after each study.

    Returns:
        The figures; interrupted if not all studies are finished.

    Raises:
        InvalidValueError: The folder cannot be written.
        KeyboardInterrupt: Before any study was finished; nothing is written.
        OSError: A file cannot be written.
    """
    wanted = tuple(dict.fromkeys(config.studies or studies))
    make_folder(config.out)
    console = Console()
    done: list[Study] = []
    files: tuple[Path, ...] = ()
    try:
        for name in wanted:
            with _progress(console, len(done), len(wanted)) as tell:
                measure: Measure = import_module(studies[name]).measure
                done.append(measure(config.quick, config.seed, tell))
            files = _write(config, done, wanted[len(done) :])
            console.print(_table(done[-1]))
    except KeyboardInterrupt:
        if not done:
            raise
        files = _write(config, done, wanted[len(done) :])  # the last one may not have been yet
    say(console, "Written: " + ", ".join(map(str, files)))
    left_out = wanted[len(done) :]
    return Answer(
        ExitCode.INTERRUPTED if left_out else ExitCode.DONE,
        outcome=f"{len(done)} of {len(wanted)} studies finished",
        facts={"studies": _facts(done), "left_out": left_out},
        files=files,
    )


def _write(config: BenchConfig, done: Sequence[Study], left_out: Sequence[str]) -> tuple[Path, ...]:
    """Write what is finished: whatever ends a bench, that is kept."""
    html, data = (config.out / name for name in FILES)
    with replacing(html) as file:
        file.write(bench_html(done, _typed(config), left_out).encode("utf-8"))
    with replacing(data) as file:
        told = {"palpate_bench": 1, "quick": config.quick, "seed": config.seed, "studies": _facts(done)}
        file.write((json.dumps(plain(told), indent=1, allow_nan=False) + "\n").encode("ascii"))
    return html, data


def _facts(done: Sequence[Study]) -> dict[str, object]:
    return {study.name: study_facts(study) for study in done}


@contextmanager
def _progress(console: Console, finished: int, total: int) -> Iterator[Callable[[str], None]]:
    """Show how many studies are finished, and what is being done; yields what is told that."""
    if not lively(console):
        yield lambda step: say(console, step)
        return
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.completed:.0f} of {task.total:.0f} studies"),
    )
    with Progress(*columns, console=console, transient=True) as progress:
        task = progress.add_task("", completed=finished, total=total)
        yield lambda step: progress.update(task, description=step)


def _table(study: Study) -> Table:
    table = Table(title=Text(study.title), caption=Text(f"error {study.error}"))
    for heading in ("method", study.cost, "error", "largest", ""):
        table.add_column(heading, justify="left" if heading in ("method", "") else "right")
    for row in study.rows:
        cells = (
            row.method,
            quantity(row.cost, study.cost_unit),
            quantity(row.typical, study.error_unit),
            quantity(row.worst, study.error_unit),
            row.note,
        )
        table.add_row(*(Text(cell) for cell in cells))
    return table


def _typed(config: BenchConfig) -> str:
    words = ["palpate bench", *config.studies]
    words += ["--quick"] if config.quick else []
    words += [f"--seed {config.seed}"] if config.seed else []
    return " ".join(words)
