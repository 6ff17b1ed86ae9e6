"""Sliders for the live parameters of a controller that runs."""

import html
import math
from collections.abc import Callable, Sequence

import viser

from palpate.errors import InvalidValueError
from palpate.runtime.live import LiveParameter
from palpate.viewing.frames import Frames

STEPS = 100
"""Of a slider, at least; a step is 1, 2 or 5 times a power of ten."""

_PADDED = '<div style="padding: 0 1em">{}</div>'


class LiveControls:
    """One slider per parameter, and what the parameter is meanwhile; one thread steps it."""

    def __init__(
        self,
        server: viser.ViserServer,
        parameters: Sequence[LiveParameter],
        request: Callable[[str, float], None],
    ) -> None:
        """Add the sliders to the panel.

        Args:
            server: Where.
            parameters: With which values the run begins; none of them, no sliders.
            request: Called with a parameter's name and the value that somebody wants.
        """
        self._request, self._parameters, self._over = request, tuple(parameters), False
        self._sliders: list[_Slider] = []
        if not parameters:
            return
        with server.gui.add_folder("Change while it runs"):
            self._sliders = [_Slider(server, parameter) for parameter in self._parameters]
            self._status = server.gui.add_html(_PADDED.format("as it began"))

    def step(self, frames: Frames) -> None:
        """Ask for what was moved since the last time, and show what the run reports.

        Args:
            frames: What is new of the run.
        """
        if self._over:
            return
        for slider in self._sliders:
            moved = slider.moved()
            if moved is None:
                continue
            parameter = slider.parameter
            try:
                wanted = parameter.checked(moved)
            except InvalidValueError as error:
                slider.refuse()
                self._show_status(f"refused: {error}")
            else:
                self._request(parameter.name, wanted)
                slider.asked = wanted
                self._show_status(f"requested: {parameter.name} {shown(wanted)} {parameter.unit}")
        if len(frames):
            values, targets = frames.live_values[-1].tolist(), frames.live_targets[-1].tolist()
            for slider, value, target in zip(self._sliders, values, targets, strict=True):
                slider.show(value, target)

    def end(self) -> None:
        """The run is over: nothing can be changed any more."""
        self._over = True
        for slider in self._sliders:
            slider.end()
        if self._sliders:
            self._show_status("the run is over")

    def _show_status(self, text: str) -> None:
        self._status.content = _PADDED.format(html.escape(text))


class _Slider:
    """One of them; `asked` is what was asked for and the run has not taken up yet."""

    asked: float | None

    def __init__(self, server: viser.ViserServer, parameter: LiveParameter) -> None:
        self.parameter, self.asked = parameter, None
        unit = f" [{parameter.unit}]" if parameter.unit else ""
        self.handle = server.gui.add_slider(
            f"{parameter.name}{unit}",
            parameter.lower,
            parameter.upper,
            slider_step(parameter.upper - parameter.lower),
            parameter.value,
            hint=f"{parameter.description}; {parameter.lower:g} to {parameter.upper:g} {parameter.unit}".strip(),
        )
        self._stands = self._accepted = parameter.value
        self._now = server.gui.add_html(_PADDED.format(""))
        self._now_shown = ""

    def moved(self) -> float | None:
        """Return where somebody has put it since the last time; None if nobody has."""
        stands = float(self.handle.value)
        if stands == self._stands:
            return None
        self._stands = stands
        return stands

    def refuse(self) -> None:
        """Go back to where it was."""
        self._put(self._accepted if self.asked is None else self.asked)

    def end(self) -> None:
        """Stand where the run has left it."""
        self._put(self._accepted)
        self.handle.disabled = True

    def show(self, value: float, target: float) -> None:
        """Show what the parameter is, and follow changes that were asked for elsewhere."""
        if self.asked is None:
            if target != self._accepted:
                self._put(target)
        elif target == self.asked:
            self.asked = None
        self._accepted = target
        now = f"now {shown(value)} {self.parameter.unit}"
        if now != self._now_shown:
            self._now_shown = now
            self._now.content = _PADDED.format(html.escape(now))

    def _put(self, value: float) -> None:
        self._stands = value
        self.handle.value = value  # type: ignore[misc]  # it has a setter, which mypy does not find


def shown(value: float) -> str:
    """Return a value for people, four digits."""
    return f"{value:.4g}"


def slider_step(span: float) -> float:
    """Return 1, 2 or 5 times a power of ten that leaves a slider at least `STEPS` steps; 1 for no span."""
    if not span > 0.0:
        return 1.0
    fine = span / STEPS
    power = 10.0 ** math.floor(math.log10(fine))
    return next((factor * power for factor in (5.0, 2.0) if factor * power <= fine), power)
