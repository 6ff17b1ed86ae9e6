"""Base class of results that Python and notebooks show by the beginning of their report."""

from typing import TYPE_CHECKING, Any, ClassVar

from palpate.experiments.kit.registry import experiment_named

if TYPE_CHECKING:
    from palpate.reporting.report import Report


class ShownResult:
    """A result that is shown by title, outcome and main metrics, in a notebook also by the first figure.

    Attributes:
        experiment: Name of the experiment, or `module:Class`; unused where `_report` is overridden.
    """

    __slots__ = ()

    experiment: ClassVar[str]

    def __init_subclass__(cls, **more: Any) -> None:
        super().__init_subclass__(**more)
        if "__repr__" not in vars(cls):
            setattr(cls, "__repr__", ShownResult.__repr__)  # noqa: B010 - or a dataclass would print every array

    def _report(self) -> "Report":
        return experiment_named(self.experiment).report(self)

    def __repr__(self) -> str:
        from palpate.reporting.report import report_summary

        try:
            return report_summary(self._report())
        except Exception:  # debuggers and tests print results that are not whole
            return f"<{type(self).__name__}>"

    def _repr_html_(self) -> str:
        from palpate.reporting.report import report_fragment

        return report_fragment(self._report())
