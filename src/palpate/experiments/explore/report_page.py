"""The report on one exploration, as one HTML file."""

import os

from palpate.experiments.explore.growth_data import GrowthReport
from palpate.experiments.explore.map_data import MapReport, ShapeReport
from palpate.reporting.data import ExplorationReport
from palpate.reporting.story import story_of


def write_report(report: ExplorationReport, path: str | os.PathLike[str]) -> None:
    """Write `report` as one HTML file that needs nothing else: no network, no folder of pictures.

    It reads on a phone as on a screen, light or dark as the reader's system is. A former file at `path` is
    replaced once the new one is whole.

    Raises:
        OSError: The file cannot be written.
    """
    from palpate.reporting.page import write_page  # with matplotlib, for which only those who write wait

    write_page(report_html(report), path)


def report_html(report: ExplorationReport) -> str:
    """Return `report` as the text of an HTML document."""
    # matplotlib takes a third of a second to import: only those who write a report wait for it.
    from palpate.experiments.explore.error_picture import error_histogram, error_map
    from palpate.experiments.explore.spin_picture import spin_picture
    from palpate.experiments.explore.surface_picture import touched_surface, true_surface
    from palpate.reporting.force_picture import force_overview, force_zoom
    from palpate.reporting.page import COLUMNS, picture_cards, report_page, section, table
    from palpate.reporting.timing_picture import timing_picture
    from palpate.reporting.timing_table import timing_rows

    cloud, series = report.cloud, report.series
    shape, errors = [], []
    if len(cloud):
        mesh = None if report.map is None or not len(report.map.mesh.triangles) else report.map.mesh
        shape.append(touched_surface(cloud, mesh))
        if report.true_surface is not None:
            shape.append(true_surface(cloud, report.true_surface))
        if report.point_error is not None:
            errors = [error_map(cloud, report.point_error, report.error_note), error_histogram(report.point_error)]
    over_time = [force_overview(series), force_zoom(series), spin_picture(series, cloud)] if series.phase else []
    nothing = "" if len(cloud) else "<p>The finger felt nothing, so there is no surface to show.</p>"
    timing = table(timing_rows(report.timing), COLUMNS)
    return report_page(
        story_of(report, "Lengths and forces in the robot's base frame."),
        [
            section("The surface", [nothing, picture_cards(shape)]),
            section("The map", _map_parts(report.map)),
            section("How the map grew", _growth_parts(report.growth)),
            section("Which shape it is", _shape_parts(report.shape)),
            section("Errors of single points", [picture_cards(errors)]),
            section("Over time", [picture_cards(over_time)]),
            section("Computing", [timing, picture_cards([timing_picture(report.timing)])]),
        ],
    )


def _map_parts(told: MapReport | None) -> list[str]:
    """What a map is like, as HTML."""
    from palpate.experiments.explore.layer_picture import layer_picture
    from palpate.experiments.explore.map_picture import map_picture
    from palpate.reporting.page import COLUMNS, picture_cards, table

    if told is None:
        return []
    figures = table(told.rows, COLUMNS)
    if not len(told.mesh.triangles):
        return [figures, "<p>Contacts are too far apart: nothing of the surface counts as observed.</p>"]
    layers = [layer_picture(told.mesh, layer) for layer in told.layers]
    return [figures, picture_cards([map_picture(told), *layers])]


def _growth_parts(told: GrowthReport | None) -> list[str]:
    """How a map grew, as HTML."""
    from palpate.experiments.explore.growth_picture import growth_picture
    from palpate.experiments.explore.snapshots_picture import snapshots_picture
    from palpate.reporting.page import picture_cards

    if told is None:
        return []
    known = growth_picture(told) if told.curve.area.any() else None
    return [picture_cards([known, snapshots_picture(told)])]


def _shape_parts(told: ShapeReport | None) -> list[str]:
    """Which shape it is, as HTML."""
    from palpate.reporting.page import COLUMNS, table, text

    if told is None:
        return []
    misses = ("shape", "misses by", "", "verdict")
    return [
        f"<p>{text(told.sentence)}</p>",
        table(told.rows, COLUMNS),
        table(told.candidates, COLUMNS, misses),
    ]
