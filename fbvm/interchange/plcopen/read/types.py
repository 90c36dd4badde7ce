"""Types and values of a PLCopen document as text of Structured Text."""

from __future__ import annotations

import re

from fbvm.interchange.markup import Element
from fbvm.interchange.plcopen.read.document import Reading
from fbvm.interchange.plcopen.schema import ELEMENTARY, LOCATION

_LATER = frozenset(("LTIME", "LDATE", "LDT", "LTOD", "CHAR", "WCHAR"))
"""Types of edition 3, which some documents have in the same way; they are read and not written."""
_CONSTANT = re.compile(r"[^\W\d]\w*|W?STRING#.*")
"""What a text may begin with that is no literal: the name of a constant; or a literal that names its type."""
_TEXT = re.compile(r"(HMI_)?STRING(\[.*\])?")
_NAME = re.compile(r"((REFERENCE|POINTER)\s+TO\s+|REF_TO\s+|ARRAY\s*\[[\w\s.,*+-]*\]\s*OF\s+)*"
                   r"[^\W\d]\w*(\.[^\W\d]\w*)*", re.IGNORECASE)
"""The name of a type.  CODESYS writes a reference in its place, which the schema has no element for; editors that take any text
there also have arrays."""
_CONSTRUCTED = re.compile(rf"{_NAME.pattern}(\s*\([^;()]*\))?", re.IGNORECASE)
"""The same with arguments of FB_init."""
_TIME_OF_DAY = re.compile(r"(\d{1,3}):(\d{1,2}):(\d{1,2})(\.\d{1,9})?")
_DURATION = re.compile(r"P(?:(\d{1,12})D)?(?:T(?:(\d{1,12})H)?(?:(\d{1,12})M)?(?:(\d{1,12}(?:\.\d+)?)S)?)?")


def type_text(reading: Reading, holder: Element | None, owner: Element) -> str:
    """The type that stands in `type`, `baseType` or `returnType`; "" with a diagnostic at `owner` if there is none."""
    inner = next((part for part in holder.children if part.name not in ("addData", "documentation")), None) if holder else None
    if inner is None:
        reading.report("X0105", owner, f"{owner.get('name') or owner.name} has no type")
        return ""
    name = inner.name.upper()
    if name in ELEMENTARY | _LATER:
        return name
    if name in ("STRING", "WSTRING"):
        return f"{name}[{inner.get('length')}]" if inner.get("length") else name
    if inner.name in _WRITERS:
        return _WRITERS[inner.name](reading, inner)
    reading.report("X0105", inner, f"{inner.name} is no type of PLCopen XML")
    return ""


def type_and_value(reading: Reading, variable: Element) -> tuple[str, str]:
    """The type of a variable, and the initial value that a tool has written into the name of the type, `DWORD := 2#10`; "" for
    none."""
    derived = variable.one("type", "derived")
    name, sign, value = (part.strip() for part in (derived.get("name") if derived else "").partition(":="))
    if derived is None or not sign or not value or ";" in value or not _CONSTRUCTED.fullmatch(name):
        return type_text(reading, variable.one("type"), variable), ""
    reading.report("X0292", derived, f"the type of {variable.get('name')} is {name}, and {value} its initial value",
                   "an initial value stands in <initialValue>")
    return name, value


def _array(reading: Reading, element: Element) -> str:
    bounds = [f"{d.get('lower')}..{d.get('upper')}" for d in element.all("dimension")]
    return f"ARRAY [{', '.join(bounds)}] OF {type_text(reading, element.one('baseType'), element)}"


def _derived(reading: Reading, element: Element) -> str:
    name = element.get("name").strip()
    if not _NAME.fullmatch(name):
        reading.report("X0105", element, f"the type {name!r} is no name")
        return ""
    return name


def _enum(reading: Reading, element: Element) -> str:
    values = element.one("values")
    members = [f"{v.get('name')} := {v.get('value')}" if v.get("value") else v.get("name")
               for v in (values.all("value") if values else ())]
    base = element.one("baseType")
    return f"{type_text(reading, base, element) if base else ''} ({', '.join(members)})".strip()


def _struct(reading: Reading, element: Element) -> str:
    members = []
    for variable in element.all("variable"):
        kind = type_text(reading, variable.one("type"), variable)
        initial = value_text(variable.one("initialValue"), kind, reading.producer.family)
        address = f" AT {place}" if (place := location(variable)) else ""
        members.append(f"    {variable.get('name')}{address} : {kind}{initial and f' := {initial}'};{remark(note(variable))}\n")
    return f"STRUCT\n{''.join(members)}END_STRUCT"


def _subrange(reading: Reading, element: Element) -> str:
    limits = element.one("range") or element
    return f"{type_text(reading, element.one('baseType'), element)} ({limits.get('lower')}..{limits.get('upper')})"


def _pointer(reading: Reading, element: Element) -> str:
    return f"POINTER TO {type_text(reading, element.one('baseType'), element)}"


_WRITERS = {"array": _array, "derived": _derived, "enum": _enum, "struct": _struct, "subrangeSigned": _subrange,
            "subrangeUnsigned": _subrange, "subrange": _subrange, "pointer": _pointer}


def value_text(holder: Element | None, kind: str = "", family: str = "") -> str:
    """The value in `initialValue` and its like; "" if there is none.  What a STRING begins with gets the quotes that it lacks
    (`quoted`)."""
    inner = next((part for part in holder.children if part.name.endswith("Value")), None) if holder else None
    if inner is None:
        return ""
    if inner.name == "arrayValue":
        items = []
        for value in inner.all("value"):
            text, times = value_text(value) or "()", value.get("repetitionValue", "1")
            items.append(f"{times}({text})" if times != "1" else text)
        return f"[{', '.join(items)}]" if items else ""
    if inner.name == "structValue":
        fields = [f"{v.get('member')} := {value_text(v)}" for v in inner.all("value")]
        return f"({', '.join(fields)})" if fields else ""
    text = inner.get("value").strip()
    return initial_text(text, kind, family)


def initial_text(text: str, kind: str, family: str) -> str:
    """What a variable of a type begins with, as it is written in Structured Text."""
    quote = "'" if _TEXT.fullmatch(kind) else '"' if kind.startswith("WSTRING") else ""
    return quoted(text, quote, family) if quote and text else text


def quoted(text: str, quote: str, family: str) -> str:
    """What a STRING or WSTRING begins with, between its quotes.  Beremiz puts quotes around whatever has none of its own kind:
    in `"abc"` of a STRING, the double quotes are characters of the text on its PLC.  Double quotes of a STRING can only be meant
    as its quotes elsewhere, since a STRING takes no literal of a WSTRING.  Other tools may name a constant, and fbvm itself
    writes expressions.

    >>> print(quoted('"abc"', "'", "beremiz"), quoted('"abc"', "'", "codesys"), quoted("unit.name", "'", "fbvm"))
    '"abc"' 'abc' unit.name
    """
    if quote in (text[0], text[-1]) or family == "fbvm" or (family != "beremiz" and _CONSTANT.fullmatch(text)):
        return text
    if family != "beremiz" and len(text) > 1 and text[0] == text[-1] and text[0] in "'\"":
        text = text[1:-1]
    return quote + text.replace(quote, f"${quote}") + quote


def location(element: Element) -> str:
    """The address of a variable, from `address` or, if it is no IEC location, from fbvm's own data; "" if it has none."""
    return own_text(element, LOCATION) or element.get("address").strip()


def own_text(element: Element, name: str) -> str:
    """The text of fbvm's own data of a name at an element; "" if there is none."""
    added = element.one("addData")
    return next((data.text.strip() for data in added.all("data") if data.get("name") == name), "") if added else ""


def duration(text: str) -> str:
    """A duration as a literal, from `T#20ms`, `PT0.02S` (CODESYS), `20ms` (OpenPLC) or `00:00:00.02` (TC6 1.x); "" for another
    text, such as a name.

    >>> duration("PT0.02S"), duration("00:00:00.100000")
    ('T#20ms', 'T#100ms')
    """
    text = text.strip()
    if clock := _TIME_OF_DAY.fullmatch(text):
        hours, minutes, seconds, rest = clock.groups()
        text = f"PT{hours}H{minutes}M{seconds}{rest or ''}S"
    iso = _DURATION.fullmatch(text)
    if iso and any(iso.groups()):
        days, hours, minutes, seconds = iso.groups()
        parts = [f"{number}{unit}" for number, unit in ((days, "d"), (hours, "h"), (minutes, "m")) if number and int(number)]
        if seconds:
            micros = round(float(seconds) * 1_000_000)
            whole, rest = divmod(micros, 1_000_000)
            parts += [f"{whole}s"] if whole else []
            parts += [f"{rest // 1000}ms"] if rest // 1000 else []
            parts += [f"{rest % 1000}us"] if rest % 1000 else []
        return "T#" + ("".join(parts) or "0s")
    if re.fullmatch(r"(?i)(L?TIME|L?T)#[\d._a-z]+", text):
        return text
    return f"T#{text}" if re.fullmatch(r"(?i)(\d+(\.\d+)?(d|h|m|s|ms|us|ns))+", text) else ""


def note(element: Element) -> str:
    """The documentation of an element on one line."""
    inner = element.one("documentation")
    return " ".join(inner.text.split()) if inner else ""


def remark(text: str) -> str:
    """A note as a comment behind a declaration."""
    return f" // {text}" if text else ""
