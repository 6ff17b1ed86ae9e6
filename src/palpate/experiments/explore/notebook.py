"""What a notebook shows of an exploration: a piece of HTML with its pictures inside."""

from html import escape

from palpate.reporting.data import ExplorationReport
from palpate.runtime import palette


def exploration_html(report: ExplorationReport) -> str:
    """Return title, outcome, key figures, the touched surface and its errors, as HTML without style of its own."""
    # only who shows pictures waits for matplotlib
    from palpate.experiments.explore.error_picture import error_map
    from palpate.experiments.explore.surface_picture import touched_surface
    from palpate.reporting.encode import picture_uri

    rows = "".join(
        f"<tr><th>{escape(k.name)}</th><td>{escape(k.text)}</td><td>{escape(k.unit)}</td><td>{escape(k.note)}</td></tr>"
        for k in report.summary
    )
    parts = [f"<h4>{escape(report.title)}</h4><p>{escape(report.outcome)}</p><table>{rows}</table>"]
    cloud = report.cloud
    if len(cloud):
        mesh = None if report.map is None or not len(report.map.mesh.triangles) else report.map.mesh
        pictures = [touched_surface(cloud, mesh)]
        if report.point_error is not None:
            pictures.append(error_map(cloud, report.point_error, report.error_note))
        # a notebook does not say whether it is light or dark
        style = f"max-width: 30em; background: {palette.CARD.light}; color-scheme: light"
        parts += [
            f'<img src="{picture_uri(each, each.full)}" alt="{escape(each.title)}" style="{style}">'
            for each in pictures
        ]
    return "\n".join(parts)
