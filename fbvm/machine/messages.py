"""Messages of log points: text with names in braces, `level {Main.Level}, code {D200:x}`."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass

from fbvm.watch.paths import Place, Span, UnknownPlace
from fbvm.watch.values import Value, show

_PART = re.compile(r"\{\{|\}\}|\{([^{}]*)\}|[{}]")


@dataclass(frozen=True)
class Message:
    """A message: its parts, each a text or a name; of a name True if it is shown in hexadecimal."""

    parts: tuple[str | tuple[str, bool], ...]

    @property
    def names(self) -> list[str]:
        """The names in braces."""
        return [part[0] for part in self.parts if not isinstance(part, str)]

    def text(self, find: Callable[[str], Place | Span], read: Callable[[Place | Span], Value]) -> str:
        """The message with the present values.  A name that `find` does not find stands there as the reason."""
        return "".join(part if isinstance(part, str) else _shown(*part, find, read) for part in self.parts)


def parse_message(text: str) -> Message:
    """The message that a text writes; `{{` and `}}` are braces.  Raises ValueError for a brace that is not closed.

    >>> parse_message("{{n}} = {Main.n:x}").parts
    ('{', 'n', '}', ' = ', ('Main.n', True))
    """
    parts: list[str | tuple[str, bool]] = []
    at = 0
    for match in _PART.finditer(text):
        if match.start() > at:
            parts.append(text[at : match.start()])
        at = match.end()
        if match[0] in ("{{", "}}"):
            parts.append(match[0][0])
        elif match[1] is None or not match[1].strip():
            raise ValueError(f"{text!r}: write {{name}}, or {{{{ for a brace")
        else:
            name, colon, form = match[1].rpartition(":")
            is_hexadecimal = bool(colon) and form.strip().lower() == "x"
            parts.append((name.strip() if is_hexadecimal else match[1].strip(), is_hexadecimal))
    if at < len(text):
        parts.append(text[at:])
    return Message(tuple(parts))


def _shown(name: str, is_hexadecimal: bool, find: Callable[[str], Place | Span], read: Callable[[Place | Span], Value]) -> str:
    try:
        found = find(name)
    except UnknownPlace as error:
        return f"<{error}>"
    value = read(found)
    if isinstance(found, Span):
        values = value if isinstance(value, list) else []
        return "[" + ", ".join(show(place.type, item, is_hexadecimal)
                               for place, item in zip(found.places, values, strict=True)) + "]"
    return show(found.type, value, is_hexadecimal)
