"""Network diagrams as TwinCAT's files keep them, of our own making."""

from __future__ import annotations

from collections.abc import Sequence
from xml.sax.saxutils import escape

from twincat_files import HEAD


def _value(name: str, text: str) -> str:
    return f'<v n="{name}">{escape(text)}</v>\n'


def _text(name: str, text: str) -> str:
    return _value(name, f'"{text}"') if text else f'<n n="{name}" />\n'


def _flags(bits: int, name: str = ' n="Flags" t="Flags"') -> str:
    return f"<o{name}>{_value('Flags', str(bits))}</o>\n"


def operand(name: str, kind: str = "BOOL", bits: int = 0, of: str = "") -> str:
    """An operand; `of` says in which member it is."""
    return f"<o{of}>\n{_value('Operand', chr(34) + name + chr(34))}{_value('Type', chr(34) + kind + chr(34))}{_flags(bits)}</o>\n"


def leaf(name: str, kind: str = "BOOL", bits: int = 0) -> str:
    inner = operand(name, kind, bits, ' n="Operand" t="Operand"')
    return f'<o t="BoxTreeOperand">\n{inner}</o>\n'


def outputs(targets: Sequence[str]) -> str:
    return f'<o n="OutputItems" t="OutputItemList">\n<l2 n="OutputItems" cet="Operand">\n{"".join(targets)}</l2>\n</o>\n'


NOTHING = "<n />\n"
END = '<o t="BoxTreeTerminator">\n<n n="Input" />\n</o>\n'
LEADS = NOTHING
"""The output of a box that leads on."""


def named(tree: str, name: str) -> str:
    """A tree as the member of that name."""
    return tree.replace("<o t=", f'<o n="{name}" t=', 1)


def assign(value: str, *targets: str) -> str:
    return f'<o t="BoxTreeAssign">\n{outputs(targets)}{_flags(0)}{named(value, "RValue")}</o>\n'


def _words(name: str, words: str, types: str) -> str:
    lists = "".join(f'<l2 n="{which}" cet="String">\n{"".join(f"<v>{word.strip(chr(45))}</v>" for word in listed.split())}</l2>\n'
                    for which, listed in (("Names", words), ("Types", types)))
    return f'<o n="{name}" t="ParamList">\n{lists}</o>\n'


def box(kind: str, inputs: Sequence[str], call: str, *, instance: str = "", names: tuple[str, str] = ("", ""),
        outs: tuple[str, str] = ("-", "-"), targets: Sequence[str] = (LEADS,), bits: int = 0, input_bits: Sequence[int] = (),
        enabled: bool = False) -> str:  # fmt: skip
    """A box: names and types of inputs (`names`) and outputs (`outs`) are words, `-` for a pin without a name."""
    of = operand(instance, kind, 0, ' n="Instance" t="Operand"')
    flags = f'<l2 n="InputFlags" cet="Flags">\n{"".join(_flags(each, "") for each in input_bits)}</l2>\n'
    return (f'<o t="BoxTreeBox">\n{_value("BoxType", chr(34) + kind + chr(34))}{of}{outputs(targets)}{_flags(bits)}'
            f'{flags if input_bits else ""}<l2 n="InputItems">\n{"".join(inputs)}</l2>\n{_words("InputParam", *names)}'
            f'{_words("OutputParam", *outs)}{_value("CallType", call)}{_value("EN", str(enabled).lower())}'
            f'{_value("ProvidesSTSnippet", "false")}</o>\n')  # fmt: skip


def wire(number: int, begun: str = "") -> str:
    """A wire that branches: where it begins, or where it is taken."""
    return f'<o t="BoxTreeDemux">\n{named(begun, "Input")}{_value("VarId", str(number))}</o>\n'


def parallel(*branches: str, feed: str = "") -> str:
    return (f'<o t="BoxTreeParallel">\n{named(feed, "Input")}<l2 n="Trees">\n{"".join(branches)}</l2>\n'
            f'{_value("Mode", "BoxShortCircuit")}</o>\n')  # fmt: skip


def network(*trees: str, label: str = "", comment: str = "", commented_out: bool = False) -> str:
    return (f'<o>\n{_text("Comment", comment)}{_text("Label", label)}{_value("OutCommented", str(commented_out).lower())}'
            f'<l2 n="ILLines" />\n<l2 n="NetworkItems">\n{"".join(trees)}</l2>\n</o>\n')  # fmt: skip


def drawn(view: str, *networks: str) -> str:
    """The implementation with these networks, viewed as Ld or Fbd."""
    return (f'<Implementation>\n<NWL>\n<XmlArchive>\n<Data>\n<o t="NWLImplementationObject">\n{_text("DefaultViewMode", view)}'
            f'<l2 n="NetworkList" cet="Network">\n{"".join(networks)}</l2>\n</o>\n</Data>\n</XmlArchive>\n</NWL>\n'
            "</Implementation>\n")  # fmt: skip


def pou(declaration: str, implementation: str, *members: str) -> str:
    """The file of a POU."""
    return (f'{HEAD}<POU Name="Main" Id="{{1}}">\n<Declaration><![CDATA[{declaration}]]></Declaration>\n{implementation}'
            f'{"".join(members)}</POU>\n</TcPlcObject>\n')  # fmt: skip
