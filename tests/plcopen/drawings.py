"""Writes documents for tests in few words, in the way of the editors, and runs what comes of them."""

from __future__ import annotations

import re

from fbvm.base.diagnostics import Source
from fbvm.code.compiler import compile_sources
from fbvm.interchange.imported import Imported
from fbvm.interchange.plcopen.read.importing import import_xml
from fbvm.machine.plc import Plc

NAMESPACE = "http://www.plcopen.org/xml/tc6_0201"
XHTML = "http://www.w3.org/1999/xhtml"


def variable(name: str, kind: str = "BOOL", value: str = "") -> str:
    """A declaration."""
    inner = f"<{kind}/>" if kind.isupper() and kind not in ("TON", "TOF", "CTU", "SR") else f'<derived name="{kind}"/>'
    initial = f'<initialValue><simpleValue value="{value}"/></initialValue>' if value else ""
    return f'<variable name="{name}"><type>{inner}</type>{initial}</variable>'


def pou(body: str, declared: str = "", kind: str = "program", name: str = "Main", language: str = "LD") -> str:
    """A POU whose `declared` are names of BOOL variables, or variable() in text."""
    text = declared if "<" in declared else "".join(variable(word) for word in declared.split())
    listed = text if "Vars>" in text else f"<localVars>{text}</localVars>"
    result = "<returnType><BOOL/></returnType>" if kind == "function" else ""
    return (f'<pou name="{name}" pouType="{kind}"><interface>{result}{listed}</interface>'
            f"<body><{language}>{body}</{language}></body></pou>")


def document(*pous: str, namespace: str = NAMESPACE, types: str = "") -> bytes:
    """A whole document."""
    return (f'<?xml version="1.0" encoding="utf-8"?>\n<project xmlns="{namespace}" xmlns:xhtml="{XHTML}">'
            f"<types><dataTypes>{types}</dataTypes><pous>{''.join(pous)}</pous></types></project>").encode()


RAIL = '<leftPowerRail localId="1"><connectionPointOut formalParameter=""/></leftPowerRail>'


def wires(sources: str) -> str:
    """`2 3.Q`: what is connected."""
    made = []
    for source in sources.split():
        number, _, pin = source.partition(".")
        made.append(f'<connection refLocalId="{number}"' + (f' formalParameter="{pin}"/>' if pin else "/>"))
    return f"<connectionPointIn>{''.join(made)}</connectionPointIn>"


def _at(at: str) -> str:
    return '<position x="{}" y="{}"/>'.format(*at.split(",")) if at else '<position x="0" y="0"/>'


def contact(number: int, sources: str, name: str, marks: str = "", at: str = "") -> str:
    return (f'<contact localId="{number}" {marks}>{_at(at)}{wires(sources)}<connectionPointOut/>'
            f"<variable>{name}</variable></contact>")


def coil(number: int, sources: str, name: str, marks: str = "", at: str = "") -> str:
    return f'<coil localId="{number}" {marks}>{_at(at)}{wires(sources)}<connectionPointOut/><variable>{name}</variable></coil>'


def value(number: int, text: str, marks: str = "", at: str = "") -> str:
    """An inVariable."""
    return f'<inVariable localId="{number}" {marks}>{_at(at)}<connectionPointOut/><expression>{text}</expression></inVariable>'


def result(number: int, sources: str, name: str, marks: str = "", at: str = "") -> str:
    """An outVariable."""
    return f'<outVariable localId="{number}" {marks}>{_at(at)}{wires(sources)}<expression>{name}</expression></outVariable>'


def block(number: int, kind: str, inputs: str, outputs: str, instance: str = "", at: str = "", marks: str = "",
          in_outs: str = "") -> str:
    """A block: `inputs` are `pin=sources`, sources parted by `+`; a pin with `!` in front is negated."""
    named = f' instanceName="{instance}"' if instance else ""

    def pin(text: str) -> str:
        name, _, sources = text.partition("=")
        negated = ' negated="true"' if name.startswith("!") else ""
        return f'<variable formalParameter="{name.lstrip("!")}"{negated}>{wires(sources.replace("+", " "))}</variable>'

    out = "".join(f'<variable formalParameter="{name}"><connectionPointOut/></variable>' for name in outputs.split(","))
    return (f'<block localId="{number}" typeName="{kind}"{named} {marks}>{_at(at)}<inputVariables>'
            f"{''.join(pin(text) for text in inputs.split())}</inputVariables><inOutVariables>"
            f"{''.join(pin(text) for text in in_outs.split())}</inOutVariables><outputVariables>{out}</outputVariables></block>")


def imported(*pous: str) -> Imported:
    return import_xml(document(*pous))


def codes(made: Imported) -> list[str]:
    """The codes of the messages, each of which marks the name of an element."""
    marked = [diagnostic.source.text[diagnostic.start : diagnostic.end] for diagnostic in made.diagnostics]
    assert [text for text in marked if not re.fullmatch(r"<[\w:]+", text)] == []
    return [diagnostic.code for diagnostic in made.diagnostics]


def plc(made: Imported, program: str = "Main") -> Plc:
    """A PLC with the imported program."""
    compiled = compile_sources([Source(name, text) for name, text in made.files.items()], program, lint=False)
    assert compiled.image is not None, "\n".join(d.render() for d in compiled.diagnostics)
    return Plc(compiled.image)


def states(made: Imported, names: str, scans: list[str]) -> list[str]:
    """What variables are after each scan, as 0 and 1; before a scan those in its text are set, as in `a=1 b=0`."""
    machine = plc(made)
    seen = []
    for settings in scans:
        for setting in settings.split():
            name, _, to = setting.partition("=")
            machine.write(f"Main.{name}", to == "1" if to in "01" else int(to))
        machine.scan()
        seen.append(" ".join(str(int(machine.read(f"Main.{name}"))) for name in names.split()))
    return seen
