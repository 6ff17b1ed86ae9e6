"""Make the README's picture: `make picture`, or `python docs/make_picture.py`."""

from pathlib import Path

import matplotlib.image
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from palpate.experiments.explore import explore
from palpate.experiments.explore_config import ExploreConfig
from palpate.experiments.explore_report import exploration_report
from palpate.reporting.error_picture import error_map
from palpate.reporting.surface_picture import touched_surface

DOTS_PER_INCH = 110


def pixels(figure: Figure) -> np.ndarray:
    """Return a figure as an RGB picture."""
    figure.set_dpi(DOTS_PER_INCH)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[..., :3]


def main() -> None:
    """Explore an ellipsoid and put what was felt beside where the errors are."""
    exploration = explore(
        ExploreConfig(object="ellipsoid", width=0.05, speed=0.03, force_noise=0.01, moment_noise=1e-4)
    )
    report = exploration_report(exploration)
    assert report.point_error is not None
    left = pixels(touched_surface(report.cloud, report.height_map).full)
    right = pixels(error_map(report.cloud, report.point_error).full)
    height = max(len(left), len(right))
    padded = [np.pad(p, ((0, height - len(p)), (0, 0), (0, 0)), constant_values=255) for p in (left, right)]
    target = Path(__file__).parent / "exploration.png"
    matplotlib.image.imsave(target, np.hstack(padded))
    print(f"{target}: points {1e6 * exploration.point_rms:.1f} um RMS from the true surface")


if __name__ == "__main__":
    main()
