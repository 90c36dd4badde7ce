"""Rows of tables of symbols."""

from __future__ import annotations

import re
from collections.abc import Mapping

from fbvm.interchange.contents import Declared
from fbvm.interchange.cx.markup import CxText, Row, Value
from fbvm.interchange.cx.read.symbols import TYPES, symbols
from fbvm.interchange.cx.write.rungs import MARK, NEW


class RowError(Exception):
    """A declaration that no row can say; the arguments are the declaration and why."""


def changed_rows(text: CxText, table: Value, old: Mapping[str, Declared],
                 new: Mapping[str, Declared]) -> tuple[str, int, list[str]] | None:
    """The rows of a table, how many there are, and the names of symbols that differ; None if none does.

    old: what the table declares, by name in small letters.  new: what it shall declare.  Raises RowError."""
    gone = old.keys() - new.keys()
    differ = [key for key, one in new.items() if old.get(key) != one]
    if not gone and not differ:
        return None
    end = "\r\n" if "\r\n" in text.text else "\n"
    saved = {one.own.casefold(): one for one in symbols(table.rows) if one.name}
    by_row = {id(one.row): key for key, one in saved.items()}
    made, count = [], 0
    at = table.inner
    for row in table.rows:
        key = by_row.get(id(row), "")
        line = text.text[at:row.end]
        at = row.end
        if key in gone:
            continue
        made.append(_row(text, new[key], row, saved[key].name, end) if key in differ else line)
        count += 1
    for key in differ:
        if key not in saved:
            made.append(_row(text, new[key], None, new[key].name, end))
            count += 1
    return "".join(made), count, [old[key].name for key in gone] + [new[key].name for key in differ]


def _row(text: CxText, one: Declared, row: Row | None, name: str, end: str) -> str:
    """A row: name, address, type, as many fields as the format of the file has, and the comment."""
    version = float(found[0]) if (found := re.match(r"\d+\.\d+", text.root.string("CXProgVer"))) else 1.8
    columns = len(row.fields) if row else 5 if version < 1.8 else 6 if version < 2 else 7
    found_array = re.fullmatch(r"ARRAY ?\[0 ?\.\. ?(\d+)\] OF (\w+)", one.type, re.I)
    kind = (found_array[2] if found_array else one.type).upper()
    if kind not in TYPES:
        raise RowError(one, f"a table of symbols has no type {one.type}; instances are made in CX-Programmer")
    before = row.fields[2].strip() if row else ""
    shown = before if TYPES.get(before) == kind else kind  # a CHANNEL stays one
    if found_array:
        shown = f"{kind}[{int(found_array[1]) + 1}]"
    address = re.sub(r"^(?:%|CIO *)+", "", one.address.strip(), flags=re.I)
    address = re.sub(r"^(T|C)N?F(?=\d)", r"\1", address)
    middle = [""] * (columns - 4)
    if not address:
        middle[0 if columns == 5 else 1] = "A"
    comment, raw = one.comment, ""
    if '"' in comment:
        raw, comment = f"{end}{MARK.format(NEW)}{end}{comment}{MARK.format(NEW)}", ""
    elif "," in comment or comment.startswith(" "):
        comment = f'"{comment}"'
    indent = " " * 3
    return f"{indent}{','.join((name, address, shown, *middle, comment))}{raw};{end}"
