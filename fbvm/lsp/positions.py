"""Places in a text as the protocol has them: lines from 0, and columns in the units that were agreed upon, UTF-16 by default."""

from __future__ import annotations

from lsprotocol import types

from fbvm.base.diagnostics import Source

UNITS = {types.PositionEncodingKind.Utf8: "utf-8", types.PositionEncodingKind.Utf16: "utf-16-le"}
_SIZES = {"utf-8": 1, "utf-16-le": 2}


class Positions:
    """Places in one text.  `units` is the encoding whose units count, as the server and its client have agreed."""

    def __init__(self, source: Source, units: types.PositionEncodingKind | str = types.PositionEncodingKind.Utf16) -> None:
        self.source = source
        self._encoding = UNITS.get(types.PositionEncodingKind(units))

    def position(self, offset: int) -> types.Position:
        """The position of a character of the text, counted from 0."""
        offset = min(max(offset, 0), len(self.source.text))
        line, column = self.source.place(offset)
        before = self.source.text[offset - column + 1:offset]
        return types.Position(line - 1, self._length(before))

    def range(self, start: int, end: int) -> types.Range:
        """The range of a piece of the text."""
        return types.Range(self.position(start), self.position(max(start, end)))

    def offset(self, position: types.Position) -> int:
        """The offset of a position in characters; of one behind the end of its line or of the text, that end."""
        starts = self.source.line_starts
        if position.line >= len(starts):
            return len(self.source.text)
        start = starts[position.line]
        line = self.source.line(position.line + 1)
        if self._encoding is None or line.isascii():
            return start + min(position.character, len(line))
        cut = line.encode(self._encoding)[:position.character * _SIZES[self._encoding]]
        return start + len(cut.decode(self._encoding, "ignore"))

    def _length(self, text: str) -> int:
        if self._encoding is None or text.isascii():
            return len(text)
        return len(text.encode(self._encoding)) // _SIZES[self._encoding]
