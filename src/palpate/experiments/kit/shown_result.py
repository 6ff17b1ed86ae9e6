"""What a notebook shows of a result: the beginning of its report."""

from typing import ClassVar

from palpate.experiments.kit.registry import experiment_named


class ShownResult:
    """A result that a notebook shows by outcome, key metrics and the first figure of its report; a base class.

    Attributes:
        experiment: Name of the experiment that found it, or `module:Class`.
    """

    __slots__ = ()

    experiment: ClassVar[str]

    def _repr_html_(self) -> str:
        from palpate.reporting.report import report_fragment

        return report_fragment(experiment_named(self.experiment).report(self))
