"""The archive in which TwinCAT keeps network diagrams: objects of its editor, with their members, as elements.

    <o n="RValue" t="BoxTreeOperand">   an object as a member: its name and its type
    <v n="Title">"text"</v>             a value; texts stand in quotes
    <l2 n="NetworkItems" cet="Network"> a list; `cet` is the type of objects in it that name none
    <n n="Input" />                     nothing

The format is not published; this was read off files.  The bits of flags are those of measured files (1 to 8) and of the order in
which the editor's interface names them (16 and 32).
"""

from __future__ import annotations

from fbvm.interchange.markup import Element

NEGATED, SET, JUMP, RETURN, RISING, FALLING = 1, 2, 4, 8, 16, 32
"""What the bits of a flag mean; NEGATED and SET together reset."""


def member(of: Element, name: str) -> Element | None:
    """The object, value or list that is the member of that name; None if it is nothing, or not there."""
    found = next((child for child in of.children if child.get("n") == name), None)
    return None if found is None or found.name == "n" else found


def text(of: Element, name: str) -> str:
    """The value of a member, a text without its quotes; "" if it is nothing."""
    found = member(of, name)
    written = found.text.strip() if found is not None else ""
    return written[1:-1] if len(written) > 1 and written[0] == written[-1] == '"' else written


def is_true(of: Element, name: str) -> bool:
    """Whether a value is `true`."""
    return text(of, name).lower() == "true"


def listed(of: Element, name: str) -> list[tuple[str, Element]]:
    """The entries of a list that is a member, each with its type; an entry that is nothing has the type ""."""
    found = member(of, name)
    if found is None:
        return []
    each = found.get("cet")
    return [("" if entry.name == "n" else entry.get("t") or each, entry) for entry in found.children]


def words(of: Element, lists: str, name: str) -> list[str]:
    """The words of a list in an object that is a member, such as the names of inputs."""
    held = member(of, lists)
    return [entry.text.strip() for _, entry in listed(held, name)] if held is not None else []


def bits(of: Element) -> int:
    """The bits that an object of flags has; 0 if it tells none."""
    written = text(of, "Flags")
    return int(written) if written.isascii() and written.isdecimal() and len(written) < 9 else 0


def flags(of: Element) -> int:
    """The bits of the member Flags; 0 if there is none."""
    held = member(of, "Flags")
    return bits(held) if held is not None else 0
