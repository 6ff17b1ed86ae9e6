"""The page `docs/metrics.md`: every metric of the experiments that come with palpate.

python docs/make_metrics.py           # write the page: `make api`
python docs/make_metrics.py --check   # exit code 1 if it is not up to date: `make check`
"""

import sys
from importlib.metadata import entry_points
from pathlib import Path

from palpate.experiments.kit.metric import Metric
from palpate.experiments.kit.registry import ENTRY_POINTS, experiment_named

PAGE = Path(__file__).resolve().parents[1] / "docs" / "metrics.md"

INTRODUCTION = """# Metrics

<!-- Made by docs/make_metrics.py from the experiments: do not edit. -->

A metric is a number of merit of a run. Each is defined once, by its experiment; the terminal, `--json`, the
report, sweeps and comparisons read that definition. Tables and JSON use the key and SI units; the report shows the
unit in brackets. A metric marked with * is known in simulation only.
"""

HEADS = ("key", "meaning", "unit", "in the report")


def page() -> str:
    """Return the page as text."""
    parts = [INTRODUCTION]
    own = (point for point in entry_points(group=ENTRY_POINTS) if point.value.startswith("palpate."))
    for name in sorted(point.name for point in own):
        experiment = experiment_named(name)
        rows = [HEADS, ("---",) * len(HEADS), *map(_row, experiment.metrics)]
        parts.append(
            f"## palpate {name.replace('.', ' ')}\n\n" + "\n".join(f"| {' | '.join(row)} |" for row in rows) + "\n"
        )
    return "\n".join(parts)


def _row(metric: Metric) -> tuple[str, str, str, str]:
    shown = f"yes [{metric.shown_unit}]" if metric.shown_unit else "yes"
    mark = "*" if metric.needs_truth else ""
    return f"`{metric.key}`{mark}", metric.meaning, metric.unit or "-", shown if metric.in_table else "no"


def main() -> int:
    """Write the page, or check it; return the exit code."""
    text = page()
    if "--check" not in sys.argv[1:]:
        PAGE.write_text(text, encoding="utf-8")
    elif not PAGE.exists() or PAGE.read_text(encoding="utf-8") != text:
        print(f"{PAGE.name} is not up to date: make api")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
