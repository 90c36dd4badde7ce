"""The identities of the objects of a document, and `projectstructure`, which says what belongs to what.

TwinCAT takes methods, properties and actions only from a document whose `projectstructure` names them; CODESYS does without.
Sources: exports of TwinCAT 3.1, and what others have measured of its import.
"""

from __future__ import annotations

from collections.abc import Iterable
from uuid import NAMESPACE_URL, uuid5

from fbvm.interchange.markup import Element, element
from fbvm.interchange.plcopen.schema import CODESYS


def structure(objects: Iterable[Element]) -> Element | None:
    """The `data` with the structure of these POUs, types and INTERFACEs, all of which get their identities; None, and no
    identity, if none of them has methods, properties or actions."""
    found = list(objects)
    if not any(_members(one) for one in found):
        return None
    return _discarded("projectstructure", element("ProjectStructure", *(_row(one, "") for one in found)))


def _members(owner: Element) -> list[Element]:
    """The methods, properties and actions of a POU or an INTERFACE."""
    added = [data for holder in owner.all("addData") for data in holder.all("data")]
    holders = [*owner.all("actions", "Methods", "Properties"), *added]
    return [member for holder in holders for member in holder.all("action", "Method", "Property")]


def _row(one: Element, path: str) -> Element:
    """The row of an object, which gets its identity; `path` leads to it."""
    inside = f"{path}/{one.get('name')}"
    identity = str(uuid5(NAMESPACE_URL, f"urn:fbvm:object:{inside.upper()}"))
    if one.name in ("Method", "Property", "Interface"):
        one.attributes["ObjectId"] = identity
    else:
        if not one.all("addData"):
            one.content.append(element("addData"))
        one.all("addData")[0].content.append(_discarded("objectid", element("ObjectId", identity)))
    return element("Object", *(_row(member, inside) for member in _members(one)), Name=one.get("name"), ObjectId=identity)


def _discarded(name: str, content: Element) -> Element:
    """The `data` of that name of CODESYS, which other tools may leave out."""
    return element("data", content, name=f"{CODESYS}{name}", handleUnknown="discard")
