"""Collision-tolerant motion in free space: lift off, rise, and travel above the object."""

from dataclasses import dataclass

from palpate.controllers.explore_parameters import ExploreParameters
from palpate.controllers.guarded_approach import lift_over
from palpate.controllers.paths.path_follower import NEAR_PLACE, Travel
from palpate.controllers.paths.strategy import PathPlane, Point
from palpate.controllers.tip_state import TipState
from palpate.runtime.data import Phase
from palpate.spatial import ZERO, Vector, add, dot, norm, scale, subtract

MAX_BUMPS = 8
"""Bound on the collisions of one flight that are avoided; then it ends as blocked."""


@dataclass(frozen=True, slots=True)
class Airspace:
    """In which flights take place.

    Attributes:
        parameters: Of the exploration: distances, speeds and the room.
        plane: Of the path.
        period: Of control [s].
        top: Height above the plane at which the run began [m]: the space there is free, as far as known.
    """

    parameters: ExploreParameters
    plane: PathPlane
    period: float
    top: float


class Flight:
    """One motion through the air: off the surface if the tip touches, then up and across, if a goal is given.

    A touch during it stops it: off that again, then on, higher by the lift's distance, but not above `top`. At
    that height, or if the tip does not come free, it is blocked; so is a goal outside of the room.

    Attributes:
        phase: LIFT or TRAVEL.
        arrived: Whether it ended well; None while it goes on.
    """

    def __init__(
        self,
        space: Airspace,
        state: TipState,
        goal: tuple[Point, float] | None = None,
        *,
        back: float | None = None,
    ) -> None:
        """Set off.

        Args:
            space: Where.
            state: Of the tip.
            goal: Where to in the plane, and at which height above it to cross [m]; None: only off the surface.
            back: Lift by so much along the plane's axis [m], whatever is felt, not along the felt normal.
        """
        self._space = space
        self._goal = goal
        self._bumps = 0
        self._free = True  # whether the tip came off what it touched since it last lifted
        self._travel: Travel | None = None
        self._from, self._since = state.position, state.time
        self._axis: Vector | None = None
        self._distance = space.parameters.lift_distance
        self.phase = Phase.LIFT
        self.arrived: bool | None = None
        if back is not None:
            self._axis, self._distance = space.plane.axis, back
        elif state.touching:
            self._lift(state)
        else:
            self._set_off(state)

    def step(self, state: TipState) -> None:
        """Take one period."""
        self._free = self._free or not state.touching
        if self.phase is Phase.LIFT:
            travel, elapsed = norm(subtract(state.position, self._from)), state.time - self._since
            if lift_over(travel, elapsed, self._distance, self._space.parameters.lift_speed):
                self._set_off(state)
        elif self._travel is not None:
            if state.touching and self._obstructed(self._travel, state):
                self._bump(self._travel, state)
            elif self._travel.finished:
                self.arrived = True

    def velocity(self, state: TipState, normal: Vector, surface_velocity: float) -> Vector:
        """Return the velocity for the next period [m/s].

        Args:
            state: Of the tip.
            normal: Into the object, smoothed; for lifting.
            surface_velocity: Of a surface that is followed, away from the tip [m/s].
        """
        if self.arrived is not None:
            return ZERO
        if self.phase is Phase.LIFT:  # away from a surface that comes after it, too
            speed = self._space.parameters.lift_speed - min(surface_velocity, 0.0)
            return scale(-speed, normal) if self._axis is None else scale(speed, self._axis)
        return ZERO if self._travel is None else self._travel.velocity(state.tip)

    def _lift(self, state: TipState) -> None:
        self.phase, self._free = Phase.LIFT, False
        self._from, self._since = state.position, state.time

    def _set_off(self, state: TipState) -> None:
        if self._goal is None:
            self.arrived = True
            return
        (to, height), space, wanted = self._goal, self._space, self._space.parameters
        # below where the run began the object may be an obstacle, and is met no faster than on landing
        low = height < space.top - NEAR_PLACE
        speed = min(wanted.landing_speed, wanted.travel_speed) if low else wanted.travel_speed
        travel = Travel(state.tip, to, height, space.plane, speed, wanted.acceleration, space.period)
        self.phase, self._travel = Phase.TRAVEL, travel
        end = add(space.plane.base(to, travel.height), subtract(state.position, state.tip))
        if travel.finished:
            self.arrived = True
        elif not wanted.room.holds(end):
            self.arrived = False

    def _obstructed(self, travel: Travel, state: TipState) -> bool:
        """Whether what is felt stands against the motion: rising leaves what does not overhang."""
        return travel.risen or dot(state.normal, self._space.plane.axis) > 0.0

    def _bump(self, travel: Travel, state: TipState) -> None:
        top, height = self._space.top, self._space.plane.flat(state.tip)[2]
        self._bumps += 1
        if (travel.risen and height > top - NEAR_PLACE) or not self._free or self._bumps > MAX_BUMPS:
            self.arrived = False
            return
        self._goal = (travel.to, min(max(travel.height, height) + self._space.parameters.lift_distance, top))
        self._axis, self._distance = None, self._space.parameters.lift_distance
        self._lift(state)
