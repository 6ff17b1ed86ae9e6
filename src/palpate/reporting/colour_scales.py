"""Anchors of the colour scales, evenly spaced.

Viridis: van der Walt and Smith, matplotlib 1.5 (2015), CC0. Signed: ColorBrewer's RdBu (Brewer, Harrower, 2003).
"""

from collections.abc import Mapping

from palpate.reporting.marks import ColourScale

VIRIDIS = (
    "#440154",
    "#482878",
    "#3e4989",
    "#31688e",
    "#26828e",
    "#1f9e89",
    "#35b779",
    "#6ece58",
    "#b5de2b",
    "#fde725",
)

ANCHORS: Mapping[ColourScale, tuple[str, ...]] = {
    ColourScale.HEIGHT: VIRIDIS,
    ColourScale.TIME: VIRIDIS[3:8],
    ColourScale.SHARE: VIRIDIS[::-1],
    ColourScale.ERROR: (
        "#053061",
        "#2166ac",
        "#4393c3",
        "#92c5de",
        "#d1e5f0",
        "#f7f7f7",
        "#fddbc7",
        "#f4a582",
        "#d6604d",
        "#b2182b",
        "#67001f",
    ),
}
