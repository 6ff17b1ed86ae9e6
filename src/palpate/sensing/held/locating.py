"""Where a tool is held, found by touching known things with it: a calibration of a tip whose size is known.

`palpate.sensing.tip_calibration` finds center and orientation of a fingertip in its sensor's frame from touches of
a ball, an edge or a plate that stand still about where they are believed. A held tool is such a tip in the hand's
frame, and what gives way when it presses is the grip. Believed poses and places must be right to less than the
tool's smallest radius: where it would be touched from its other side, no touch makes sense.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from palpate.errors import FloatArray, InvalidValueError
from palpate.estimation import Assumption, BrokenAssumption, Verdict
from palpate.kinematics.pose import Pose
from palpate.sensing.contact_jacobian import cross_matrices
from palpate.sensing.held.tool_contact import HeldTool
from palpate.sensing.tip_calibration import Instrument, TipFit, Touches, TouchTarget, TypedTip, fit_tip, tip_shape

GRIP_STIFFNESS = 20e3
"""[N/m] to start from: fingertips of rubber that hold a tool give way by 0.05 mm per newton."""

KNOWN_SIZE = 1e-4
"""How wrong a tool's sizes are at least, relative: of one whose size is known."""


@dataclass(frozen=True, slots=True, eq=False)
class LocatedTool:
    """A tool, where it was found to be held.

    Attributes:
        tool: With the pose that was found, and its covariance.
        fit: Of which touches, with its verdict; lengths that were known are in it, too.
    """

    tool: HeldTool
    fit: TipFit

    @property
    def verdict(self) -> Verdict:
        """Whether the touches agree with one another and with the tool, and tell where it is held."""
        return Verdict(
            (
                *_untold(self.fit),
                # that sizes are not told does not matter: they are known
                *(each for each in self.fit.verdict.broken if each.assumption is not Assumption.CONDITIONED),
            )
        )


def _untold(fit: TipFit) -> Iterator[BrokenAssumption]:
    pose = [i for name in ("center", "rotation") for i in range(len(fit.told))[fit.unknowns.blocks[name]]]
    missing = [fit.unknowns.each[i].name for i in pose if not fit.told[i]]
    if missing:
        yield BrokenAssumption(
            Assumption.CONDITIONED,
            f"the touches do not tell {', '.join(missing)} of the tool in the hand",
            "touch with its end as well as with its side, from all around and far apart along it",
        )


def typed_tool(tool: HeldTool, grip_stiffness: float = GRIP_STIFFNESS) -> TypedTip:
    """Return the tip that a held tool is, to calibrate it or to plan touches that tell where it is.

    Args:
        tool: As believed; the covariance of its pose says how wrong that may be.
        grip_stiffness: Of the hand that holds it, about [N/m].

    Raises:
        InvalidValueError: Touches calibrate no such surface, or the pose is said to be exact.
    """
    if not (np.diag(tool.pose_covariance) > 0.0).all():
        raise InvalidValueError(
            "pose_covariance of the tool: must say how wrong its pose may be, above 0 throughout"
        )
    shape, size_sd = tip_shape(tool.surface), tool.tip.size_sd
    R, p = np.array(tool.pose.rotation), np.array(tool.pose.position)
    center, rotation = _own_frame(tool)
    sd = np.sqrt(np.diag(tool.pose_covariance))
    arm = float(np.linalg.norm(R @ center))
    return TypedTip(
        shape=replace(shape, size_sd=tuple(max(size_sd / size, KNOWN_SIZE) for size in shape.sizes)),
        center=R @ center + p,
        rotation=R @ rotation,
        stiffness=grip_stiffness,
        # the tool turns about its frame's origin, the tip about its center
        center_sd=float(np.hypot(sd[:3].max(), arm * sd[3:].max())),
        rotation_sd=float(sd[3:].max()),
    )


def locate_tool(
    tool: HeldTool,
    touches: Touches,
    targets: Sequence[TouchTarget],
    instrument: Instrument | None = None,
    grip_stiffness: float = GRIP_STIFFNESS,
) -> LocatedTool:
    """Return where a tool is held.

    What touches cannot tell stays as believed, with the covariance that was given: how a round pin is turned about
    its axis, or, if it was touched at its side alone, where it is along that.

    Args:
        tool: As believed.
        touches: By it, in the frame that its pose is given in: the sensor's of `Touches` is the hand's.
        targets: What was touched.
        instrument: What measures; see `fit_tip`.
        grip_stiffness: Of the hand that holds it, about [N/m].

    Raises:
        InvalidValueError: As in `typed_tool` and `fit_tip`.
    """
    typed = typed_tool(tool, grip_stiffness)
    fit = fit_tip(touches, tuple(targets), typed, instrument)
    center, rotation = _own_frame(tool)
    R = fit.rotation @ rotation.T
    p = fit.center - R @ center
    known = fit.model_covariance()[:6, :6]
    for axis in typed.shape.round_about:  # which the fit leaves out
        direction = fit.rotation[:, axis]
        variance = direction @ tool.pose_covariance[3:, 3:] @ direction
        known[3:, 3:] += variance * np.outer(direction, direction)
    about_origin = np.eye(6)
    about_origin[:3, 3:] = -cross_matrices((p - fit.center)[None])[0]
    covariance = about_origin @ known @ about_origin.T
    x, y, z = R.tolist()
    pose = Pose((float(p[0]), float(p[1]), float(p[2])), (tuple(x), tuple(y), tuple(z)))
    return LocatedTool(replace(tool, pose=pose, pose_covariance=0.5 * (covariance + covariance.T)), fit)


def _own_frame(tool: HeldTool) -> tuple[FloatArray, FloatArray]:
    """Return center and axes of the surface in the tool's frame, shapes (3,) and (3, 3)."""
    surface = tool.surface
    center, rotation = (getattr(surface, name, None) for name in ("center", "rotation"))
    if center is None or rotation is None:
        raise InvalidValueError(f"surface is a {type(surface).__name__}: must have a center and a rotation")
    return np.asarray(center), np.asarray(rotation)
