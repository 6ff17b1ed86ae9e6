"""A surface whose motion is followed, but not where a step of force would pass for it.

On a contact that is softer than it was taken for, a tip that is sent to press more goes farther than it should
have to: its own way passes for a surface that gives way, and following that presses more still. So while the
force steps, what would add to the step is not believed, and the surface is taken to go on as it did. What brakes
the step is believed: on a contact that is stiffer than thought, that keeps the force from going too far.
"""

from palpate.controllers.surface_motion import SurfaceMotion


class CoastingSurface(SurfaceMotion):
    """Tracks and predicts the velocity of a surface along the normal, steps of force taken into account."""

    def update_in_step(self, normal_velocity: float, normal_force: float, way: float) -> None:
        """Take what was measured in this period; takes the place of `update`.

        Args:
            normal_velocity: n.v of the tip, into the object [m/s].
            normal_force: [N].
            way: Of the step: positive if the force is to grow.
        """
        before = normal_force if self._force is None else self._force
        measured = normal_velocity - (normal_force - before) * self._per_force
        predicted = self._value + self._slope + 0.5 * self._curve
        if (measured - predicted) * way > 0.0:
            # as if just that had been measured
            normal_velocity += predicted - measured
        self.update(normal_velocity, normal_force)
