"""How a map is cut into patches and how far it reaches beyond what was felt."""

import dataclasses
from dataclasses import dataclass, field
from typing import Self

from palpate.errors import InvalidValueError, check_positive, not_negative, positive
from palpate.mapping.surface_map.model import SurfaceModel

DEFAULT_ROW = 2e-3
"""Distance of rows that the default lengths are made for [m]."""

REACH_OF_ROWS = 0.75
"""Reach over the distance of rows; see `MapSettings.for_rows`."""


@dataclass(frozen=True, slots=True)
class MapSettings:
    """What a `SurfaceMap` is built with.

    Lengths suit rows up to 2 mm apart on a surface whose radii are above 3 mm; `for_rows` scales them. How they
    were chosen is measured by `benchmarks/surface_maps.py`.

    Attributes:
        model: Belief about surface and noise to start from, and the centre of what `learn` looks for.
        bias: Largest constant offset of contacts along the normal that calibration leaves [m]. It cannot be seen
            in the contacts; 0 claims a perfect finger.
        stretch: Contacts are averaged over this length of path [m]; about the correlation length of the noise,
            since shorter stretches repeat what their neighbours say.
        longest_pause: A longer time between contacts is a lift-off, and starts another stretch [s].
        reach: A point farther than this from all contacts is unobserved [m]: three quarters of the distance of
            rows.
        patch_spacing: A contact farther than this from the centre of all patches starts a new one [m].
        patch_reach: Where the weight of a patch ends [m].
        patch_data: A patch is fitted to stretches within this distance of its centre [m].
        patch_stretches: At most this many, evenly chosen; bounds the cost of a patch (its cube) and its memory
            (its square) where rows lie close or a place is felt again. Rows 1 mm apart leave 80 on a flat patch
            and more on a bent one: with 64 of them deviations were up to a tenth wider than need be.

    Raises:
        InvalidValueError: A value is not positive (`bias`: negative), or the lengths do not nest.
    """

    model: SurfaceModel = field(default_factory=SurfaceModel)
    bias: float = 0.0
    stretch: float = 1.0e-3
    longest_pause: float = 0.1
    reach: float = 1.5e-3
    patch_spacing: float = 3.0e-3
    patch_reach: float = 4.0e-3
    patch_data: float = 5.0e-3
    patch_stretches: int = 96

    def __post_init__(self) -> None:
        not_negative("bias", self.bias, "m")
        check_positive(self, stretch="m", reach="m", patch_spacing="m", patch_reach="m", patch_data="m")
        positive("longest_pause", self.longest_pause, "s", infinite_allowed=True)
        if self.patch_stretches < 1:
            raise InvalidValueError(f"patch_stretches = {self.patch_stretches}: must be 1 or more")
        if not self.patch_spacing < self.patch_reach <= self.patch_data:
            raise InvalidValueError(
                f"patch_spacing = {self.patch_spacing} m, patch_reach = {self.patch_reach} m, patch_data = "
                f"{self.patch_data} m: must grow in this order, or there are gaps between patches"
            )

    @property
    def rows(self) -> float:
        """Distance of rows that the reach is made for [m]."""
        return self.reach / REACH_OF_ROWS

    @classmethod
    def for_rows(cls, distance: float, *, model: SurfaceModel | None = None, bias: float = 0.0) -> Self:
        """Return settings for rows `distance` apart [m]; below 2 mm only the reach shrinks."""
        rows = positive("distance", distance, "m") / DEFAULT_ROW
        base = cls(model=model or SurfaceModel(), bias=bias)
        grown = max(1.0, rows)
        return dataclasses.replace(
            base,
            reach=max(rows * base.reach, base.stretch),
            stretch=grown * base.stretch,
            patch_spacing=grown * base.patch_spacing,
            patch_reach=grown * base.patch_reach,
            patch_data=grown * base.patch_data,
        )
