"""Feeling through what is held: the wrench on an object, where it touches, and whether at one place."""

from palpate.sensing.held.external_wrench import (
    ExternalWrenches,
    FingersFelt,
    HeldBody,
    ObjectMotion,
    external_wrench,
    external_wrenches,
)
from palpate.sensing.held.felt_place import FeltPlace, PlaceFelt
from palpate.sensing.held.locating import LocatedTool, locate_tool, typed_tool
from palpate.sensing.held.one_contact import ContactBounds, ContactCount, CountedContacts, count_contacts
from palpate.sensing.held.tool_contact import FeltContacts, HeldTool, felt_in_hand, felt_on_tool, tool_contact

__all__ = [
    "ContactBounds",
    "ContactCount",
    "CountedContacts",
    "ExternalWrenches",
    "FeltContacts",
    "FeltPlace",
    "FingersFelt",
    "HeldBody",
    "HeldTool",
    "LocatedTool",
    "ObjectMotion",
    "PlaceFelt",
    "count_contacts",
    "external_wrench",
    "external_wrenches",
    "felt_in_hand",
    "felt_on_tool",
    "locate_tool",
    "tool_contact",
    "typed_tool",
]
