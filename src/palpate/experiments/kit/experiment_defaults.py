"""A default report, and no files or points, for simple experiments."""

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from palpate.experiments.kit.experiment import Writer
from palpate.experiments.kit.metric import Metric

if TYPE_CHECKING:  # which only those who write a report wait for
    from palpate.reporting.figure import Figure
    from palpate.reporting.report import Report
    from palpate.runtime.log.standard.cloud import Cloud


class ExperimentDefaults:
    """Default implementation of the report, files and points of an `Experiment`; a base class."""

    name: str
    summary: str
    Config: type[Any]
    metrics: tuple[Metric, ...]

    def figures(self, result: Any) -> "Iterator[Figure]":
        """Return what is drawn into the report; nothing, unless a subclass does."""
        yield from ()

    def report(self, result: Any) -> "Report":
        """Return the metrics, the figures, and how the computer kept up."""
        from palpate.reporting.computing import computing
        from palpate.reporting.data import Quantity
        from palpate.reporting.report import Figures, Report, Section

        values = ((each, each.value(result)) for each in self.metrics)
        rows = (Quantity(each.meaning, "none" if value is None else value, each.unit) for each, value in values)
        return Report(
            title=self.summary.rstrip("."),
            outcome=f"{result.run}.",
            metrics=tuple(rows),
            sections=(
                Section("Figures", (Figures(lambda: self.figures(result)),)),
                computing(result.run.timing),
            ),
        )

    def files(self, result: Any) -> Mapping[str, Writer]:
        """Return none."""
        return {}

    def cloud(self, result: Any) -> "Cloud | None":
        """Return none."""
        return None
