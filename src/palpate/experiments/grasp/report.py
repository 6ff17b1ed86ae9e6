"""The report on one grasp."""

from collections.abc import Iterator

from palpate.experiments.grasp.heaviest import heaviest_load
from palpate.experiments.grasp.key_figures import compared, key_figures
from palpate.experiments.grasp.moments_picture import moments_picture
from palpate.experiments.grasp.pictures import over_time
from palpate.experiments.grasp.result import Grasp
from palpate.experiments.grasp.words import account, advice, asked, outcome, settings, title
from palpate.reporting.computing import computing
from palpate.reporting.grasp_force_picture import grasp_force_picture
from palpate.reporting.picture import Picture
from palpate.reporting.report import FigureTable, Paragraph, Pictures, Report, Section
from palpate.runtime import Ending

IGNORING = ", ignoring spin"
"""At the end of the titles of pictures of such a control."""


def grasp_report(grasp: Grasp) -> Report:
    """Return the report on a grasp."""
    return Report(
        title=title(grasp),
        outcome=outcome(grasp),
        figures=key_figures(grasp),
        sections=(
            Section("What was seen", tuple(Paragraph(each) for each in account(grasp))),
            Section("From the first touch to the last", (Pictures(lambda: _over_time(grasp)),)),
            *_least_forces(grasp),
            *_ignoring_spin(grasp),
            computing(grasp.run.timing),
        ),
        asked=asked(grasp),
        advice=advice(grasp),
        settings=settings(grasp),
        footer="Loads that the object exerts on the fingers.",
        reached=grasp.run.ending is Ending.DONE and not grasp.dropped,
    )


def _over_time(grasp: Grasp, note: str = "") -> Iterator[Picture | None]:
    yield over_time(grasp, note)
    yield moments_picture(grasp, note)


def _least_forces(grasp: Grasp) -> Iterator[Section]:
    at = heaviest_load(grasp)
    if at is None:
        return

    def draw() -> Iterator[Picture | None]:
        yield grasp_force_picture(at.grasp, at.forces, at.load, at.disturbance)

    yield Section(
        "The least forces where the load is heaviest",
        (Paragraph(f"At {at.time:.3g} s, by what the contacts really bear."), Pictures(draw)),
    )


def _ignoring_spin(grasp: Grasp) -> Iterator[Section]:
    other = grasp.comparison
    if other is None:
        return

    pictures = Pictures(lambda: _over_time(other, IGNORING))
    yield Section("A control that ignores spin", (FigureTable(compared(grasp)), pictures))
