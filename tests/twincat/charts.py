"""Continuous function charts as TwinCAT's files keep them, of our own making: each pin has its name as its Id."""

from __future__ import annotations

from collections.abc import Sequence
from xml.sax.saxutils import escape

INPUT, OUTPUT, TEXT = ' n="Input"', ' n="Output"', ' n="Text"'


def _value(name: str, text: str) -> str:
    return f'<v n="{name}">{escape(text)}</v>\n'


def _list(name: str, kind: str, entries: Sequence[str]) -> str:
    return f'<o n="{name}" t="CFCItemList">\n<l2 n="InnerList" cet="{kind}">\n{"".join(entries)}</l2>\n</o>\n'


def pin(number: str, more: str = "", of: str = "") -> str:
    """A pin; `-` in front of its Id negates it, `more` are other values of it."""
    given = "".join(_value(*each.split("=")) for each in more.split())
    return f"<o{of}>\n{_value('Negated', str(number.startswith('-')).lower())}{given}{_value('Id', number.lstrip('-'))}</o>\n"


def _text(text: str, of: str = "") -> str:
    return f"<o{of}>\n{_value('Text', chr(34) + text + chr(34))}</o>\n"


def operand(text: str, output: str) -> str:
    return f'<o t="CFCInputElement">\n{pin(output, of=OUTPUT)}{_text(text, TEXT)}</o>\n'


def result(text: str, source: str, more: str = "") -> str:
    return f'<o t="CFCOutputElement">\n{pin(source, more, INPUT)}{_text(text, TEXT)}</o>\n'


def box(kind: str, call: str, inputs: str, outputs: str, instance: str = "", texts: Sequence[str] | None = None, more: str = "",
        parameters: Sequence[str] = ()) -> str:  # fmt: skip
    """A box: pins are `name:Id`, the name of an operator's is empty."""
    pins = [[each.rpartition(":") for each in words.split()] for words in (inputs, outputs)]
    given = texts if texts is not None else [*(name for side in pins for name, _, _ in side), kind, instance]
    sides = "".join(_list(name, "CFCPin", [pin(number) for _, _, number in side])
                    for name, side in zip(("Inputs", "Outputs"), pins, strict=True))
    values = "".join(_value(*each.split("=")) for each in more.split())
    return (f'<o t="CFCBoxElement">\n{sides}{_list("Texts", "CFCText", [_text(each) for each in given])}'
            f'{_list("Parameters", "Parameter", parameters)}{values}{_value("KindOfCall", call)}</o>\n')  # fmt: skip


def wired(begins: str, *ends: str) -> str:
    """Wires from one pin to others."""
    return "".join(f'<o t="CFCConnection">\n{_value("SourcePinId", begins)}{_value("DestPinId", end)}</o>\n' for end in ends)


def chart(*entries: str) -> str:
    """The implementation with these entries."""
    return ('<Implementation>\n<CFC>\n<XmlArchive>\n<Data>\n<o t="CFCImplementationObject">\n'
            f'{_list("Items", "", entries)}</o>\n</Data>\n</XmlArchive>\n</CFC>\n</Implementation>\n')  # fmt: skip
