"""A default report, and no files or points, for simple experiments."""

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from palpate.experiments.kit.experiment import Writer
from palpate.experiments.kit.figure import Figure

if TYPE_CHECKING:  # which only those who write a report wait for
    from palpate.reporting.picture import Picture
    from palpate.reporting.report import Report
    from palpate.runtime.log.standard.cloud import Cloud


class ExperimentDefaults:
    """Default implementation of the report, files and points of an `Experiment`; a base class."""

    name: str
    summary: str
    Config: type[Any]
    figures: tuple[Figure, ...]

    def pictures(self, result: Any) -> "Iterator[Picture]":
        """Return what is drawn into the report; nothing, unless a subclass does."""
        yield from ()

    def report(self, result: Any) -> "Report":
        """Return the figures, the pictures, and how the computer kept up."""
        from palpate.reporting.computing import computing
        from palpate.reporting.data import KeyFigure
        from palpate.reporting.report import Pictures, Report, Section

        values = ((each, each.value(result)) for each in self.figures)
        rows = (KeyFigure(each.meaning, "none" if value is None else value, each.unit) for each, value in values)
        return Report(
            title=self.summary.rstrip("."),
            outcome=f"{result.run}.",
            figures=tuple(rows),
            sections=(
                Section("Pictures", (Pictures(lambda: self.pictures(result)),)),
                computing(result.run.timing),
            ),
        )

    def files(self, result: Any) -> Mapping[str, Writer]:
        """Return none."""
        return {}

    def cloud(self, result: Any) -> "Cloud | None":
        """Return none."""
        return None
