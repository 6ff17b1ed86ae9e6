"""Surface motion tracking that is gated during steps of the set force.

On a contact softer than assumed, a tip that presses harder travels farther than expected: its own motion looks
like a receding surface, and following that presses harder still. So during a step, measurements that would add to
it are replaced by the prediction. Those that oppose it are kept: on a contact stiffer than assumed they limit the
overshoot.
"""

from palpate.controllers.surface_motion import SurfaceMotion


class GatedSurfaceMotion(SurfaceMotion):
    """Tracks and predicts the velocity of a surface along the normal, with gating during force steps."""

    def update_in_step(self, normal_velocity: float, normal_force: float, sign: float) -> None:
        """Take the measurements of a period in which the set force steps, instead of `update`.

        Args:
            normal_velocity: n.v of the tip, into the object [m/s].
            normal_force: [N].
            sign: Of the step: positive if the force increases.
        """
        before = normal_force if self._force is None else self._force
        measured = normal_velocity - (normal_force - before) * self._per_force
        predicted = self._value + self._slope + 0.5 * self._curve
        if (measured - predicted) * sign > 0.0:
            normal_velocity += predicted - measured
        self.update(normal_velocity, normal_force)
