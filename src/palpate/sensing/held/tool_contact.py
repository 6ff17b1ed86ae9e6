"""What a held tool touches: its surface is a fingertip, its frame is held at a pose that is known more or less.

A wrench that the environment exerts on the tool is moved into the tool's frame, and solved there on its surface
as that of any fingertip (`palpate.sensing.contact_from_wrench`). How well the tool's pose is known counts in two
ways. On the tool, the wrench is moved to a place that is not quite the right one: to first order

    df = f x t,   dm = m x t + f x d

for a tool that is held further by d and turned by t, in its own axes. In the hand, the contact moves with the tool
as well, which is what an uncertain fingertip does (`palpate.sensing.tip_uncertainty`).
"""

from dataclasses import dataclass, field, replace

import numpy as np

from palpate.errors import FloatArray
from palpate.estimation.covariance import covariance_matrix
from palpate.kinematics.pose import Pose, checked_pose
from palpate.sensing.contact import Contact, Contacts
from palpate.sensing.contact_jacobian import ContactJacobians, cross_matrices
from palpate.sensing.held.external_wrench import POSE, ExternalWrenches
from palpate.sensing.held.wrench_frame import into_matrix, wrench_into
from palpate.sensing.solver import Surface, contact_from_wrench, contacts_from_wrenches
from palpate.sensing.tip_uncertainty import EXACT, PARAMETERS, TipUncertainty
from palpate.sensing.uncertainty import ContactUncertainties, center_of, contacts_uncertainties
from palpate.spatial import Wrench

HERE = Pose()
"""Of a tool whose surface is given in the frame of the wrench."""


@dataclass(frozen=True, slots=True, eq=False)
class HeldTool:
    """A tool of known shape, and where it is held.

    Attributes:
        surface: In the tool's frame.
        pose: Of the tool in the frame of the wrench: a palm's, an object's or a sensor's.
        pose_covariance: Of its position (3) [m] and rotation vector (3) [rad] along the axes of that frame, the
            rotation about the tool frame's origin, shape (6, 6).
        tip: How well its surface is known in the tool's frame.

    Raises:
        InvalidValueError: The pose is none, or the covariance.
    """

    surface: Surface
    pose: Pose = HERE
    pose_covariance: FloatArray = field(default_factory=lambda: np.zeros((6, 6)))
    tip: TipUncertainty = EXACT

    def __post_init__(self) -> None:
        checked_pose("pose", self.pose)
        checked = covariance_matrix("pose_covariance", self.pose_covariance, 6, remedy=POSE)
        object.__setattr__(self, "pose_covariance", checked)

    @property
    def tip_in_hand(self) -> TipUncertainty:
        """How well its surface is known in the frame of the wrench, along the tool's axes."""
        back = np.array(self.pose.rotation).T
        A = np.zeros((PARAMETERS, 6))
        A[:3, :3] = A[3:6, 3:] = back
        # it turns about the frame's origin, a fingertip about its center
        A[:3, 3:] = -cross_matrices(center_of(self.surface)[None])[0] @ back
        return TipUncertainty(self.tip.covariance + A @ self.pose_covariance @ A.T)


@dataclass(frozen=True, slots=True, eq=False)
class FeltContacts:
    """Contacts and how well they are known, in one frame.

    Attributes:
        contacts: n contacts.
        uncertainty: Theirs.
    """

    contacts: Contacts
    uncertainty: ContactUncertainties


def tool_contact(tool: HeldTool, wrench: Wrench) -> Contact:
    """Return where the tool touches now, in its own frame: for a control loop.

    Args:
        tool: What is held.
        wrench: What the environment exerts on it, in the frame that the tool's pose is given in.
    """
    return contact_from_wrench(tool.surface, wrench_into(tool.pose, wrench))


def felt_on_tool(tool: HeldTool, wrenches: ExternalWrenches) -> FeltContacts:
    """Return where on the tool it touches, in the tool's frame: along a pin, on a blade.

    Args:
        tool: What is held.
        wrenches: What the environment exerts on it, in the frame that the tool's pose is given in.
    """
    seen = wrenches.seen_from(tool.pose, tool.pose_covariance)
    contacts = contacts_from_wrenches(tool.surface, seen.wrench)
    return FeltContacts(contacts, contacts_uncertainties(tool.surface, contacts, seen.covariance, tool.tip))


def felt_in_hand(tool: HeldTool, wrenches: ExternalWrenches) -> FeltContacts:
    """Return where in the hand the tool touches, in the frame that its pose is given in.

    Args:
        tool: As in `felt_on_tool`.
        wrenches: As in `felt_on_tool`.
    """
    seen = wrenches.seen_from(tool.pose)
    contacts = contacts_from_wrenches(tool.surface, seen.wrench)
    known = contacts_uncertainties(tool.surface, contacts, seen.covariance, tool.tip_in_hand)
    R, p = np.array(tool.pose.rotation), np.array(tool.pose.position)
    X, J = into_matrix(tool.pose), known.jacobians
    return FeltContacts(
        contacts=replace(
            contacts,
            centroid=contacts.centroid @ R.T + p,
            normal=contacts.normal @ R.T,
            force=contacts.force @ R.T,
            tangential_force=contacts.tangential_force @ R.T,
        ),
        uncertainty=replace(
            known,
            centroid=R @ known.centroid @ R.T,
            normal=R @ known.normal @ R.T,
            tangential_force=R @ known.tangential_force @ R.T,
            jacobians=ContactJacobians(
                centroid=R @ J.centroid @ X,
                normal=R @ J.normal @ X,
                normal_force=J.normal_force @ X,
                tangential_force=R @ J.tangential_force @ X,
                spin_torque=J.spin_torque @ X,
            ),
        ),
    )
