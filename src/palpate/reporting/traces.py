"""What plots of flat panels and of spaces share: traces, arrays, colours and names.

Colours stay roles, "role:felt" or "role:felt:0.2" with its opacity: the page puts the reader's theme in.
Arrays are base64 of little-endian numbers; single precision is finer than a screen.
"""

import base64
from dataclasses import dataclass
from html import escape
from typing import Any

import numpy as np
import numpy.typing as npt

from palpate.reporting.colour_scales import ANCHORS
from palpate.reporting.marks import Colouring, ColourScale, finite_limits
from palpate.runtime.palette import Colour

Json = dict[str, Any]
"""What plotly.js takes."""


@dataclass(slots=True)
class Plot:
    """A plot while it is put together; `extras` has for each trace what `page.js` does with it."""

    traces: list[Json]
    extras: list[Json]
    layout: Json

    def add(self, trace: Json, **extra: object) -> None:
        """Add a trace, with what `page.js` does with it."""
        self.traces.append(trace)
        self.extras.append(extra)


def packed(values: npt.ArrayLike) -> Json:
    """Return an array as plotly.js and `page.js` read it: numbers as 4 bytes each, whole ones signed."""
    array = np.asarray(values)
    kind, name = ("<i4", "i4") if np.issubdtype(array.dtype, np.integer) else ("<f4", "f4")
    return {"dtype": name, "bdata": base64.b64encode(np.ascontiguousarray(array, dtype=kind).tobytes()).decode()}


def role(colour: Colour, opacity: float = 1.0) -> str:
    """Return a role, which the page replaces by its colour in the reader's theme."""
    return f"role:{colour.name}" if opacity >= 1.0 else f"role:{colour.name}:{opacity:g}"


def scale_of(scale: ColourScale) -> list[list[object]]:
    """Return a colour scale as plotly.js takes it."""
    colours = ANCHORS[scale]
    return [[i / (len(colours) - 1), colour] for i, colour in enumerate(colours)]


def colouring_of(colouring: Colouring) -> Json:
    """Return what colours tell, as `page.js` reads it."""
    low, high = finite_limits(colouring)
    return {
        "quantity": colouring.quantity,
        "label": colouring.label,
        "unit": colouring.unit,
        "values": packed(colouring.values),
        "low": low,
        "high": high,
        "scale": scale_of(colouring.scale),
    }


def typed(text: str) -> str:
    """Text that people may have typed: plotly.js takes some markup for such."""
    return escape(text, quote=False)


def named(name: str) -> Json:
    """Return the name of a trace in the legend; "" is not shown there."""
    return {"name": typed(name), "showlegend": bool(name)}
