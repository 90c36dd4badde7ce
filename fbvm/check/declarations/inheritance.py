"""What blocks, classes and interfaces inherit and implement: their heads, overridden methods, members that are missing.

Source: IEC 61131-3 ed. 3, 6.6.5 to 6.6.8; what CODESYS and TwinCAT add is a row of `base.dialects`."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from fbvm.base.diagnostics import Source
from fbvm.base.types import ArrayType, StructType, Type, fold
from fbvm.check.declarations import generic_blocks
from fbvm.check.expressions.scope import Scope
from fbvm.check.symbols.context import Context
from fbvm.check.symbols.facts import Pou, Variable
from fbvm.check.symbols.report import with_article
from fbvm.syntax import tree

_BASES = {"FUNCTION_BLOCK": ("FUNCTION_BLOCK", "CLASS"), "CLASS": ("CLASS",), "INTERFACE": ("INTERFACE",)}
"""By kind of POU the kinds that it may EXTEND."""
_ACCESS = ("PRIVATE", "PROTECTED", "INTERNAL", "PUBLIC")
"""The access words from the narrowest on; INTERNAL and PROTECTED are not compared."""
_PARAMETERS = ("VAR_INPUT", "VAR_IN_OUT", "VAR_OUTPUT")


def resolve_head(context: Context, pou: Pou) -> None:
    """Find what a POU EXTENDS and IMPLEMENTS, and resolve it; what is wrong there is reported."""
    head, report = pou.tree, context.report
    allowed = _BASES.get(pou.kind)
    for spec in _without_query(head.bases) if allowed else ():
        found = _named(context, pou, spec, allowed or ())
        if found is None:
            pou.inherits = True
        elif pou.kind == "INTERFACE":
            pou.interfaces.append(found)
        elif pou.base is not None:
            report.add("S1001", pou.source, spec, f"{pou.name} extends {pou.base.name} already",
                       "a block has one base; of interfaces it may implement several")
        elif "FINAL" in found.modifiers:
            report.add("S1002", pou.source, spec, f"{found.name} is FINAL and cannot be extended")
            pou.inherits = True
        else:
            pou.base = found
    for spec in _without_query(head.interfaces) if pou.kind in ("FUNCTION_BLOCK", "CLASS") else ():
        found = _named(context, pou, spec, ("INTERFACE",))
        if found is not None:
            pou.interfaces.append(found)
    for spec in (*(() if allowed else head.bases), *(head.interfaces if pou.kind not in ("FUNCTION_BLOCK", "CLASS") else ())):
        said = ("an INTERFACE implements nothing", "an interface EXTENDS others") if pou.kind == "INTERFACE" else \
            (f"a {pou.kind} extends and implements nothing", "make it a FUNCTION_BLOCK" if pou.kind == "PROGRAM" else "")
        report.add("S1001", pou.source, spec, *said)


def _without_query(specs: Iterable[tree.NamedType]) -> Iterator[tree.NamedType]:
    """The names without __SYSTEM.IQueryInterface, which has no members: CODESYS wants it for __QUERYINTERFACE."""
    return (spec for spec in specs if fold(spec.text) != "__SYSTEM.IQUERYINTERFACE")


def _named(context: Context, pou: Pou, spec: tree.NamedType, kinds: tuple[str, ...]) -> Pou | None:
    """The resolved POU of one of `kinds` that a head names, or None after a diagnostic."""
    name = spec.text.rpartition(".")[2]
    found = context.project.pou(spec.text, pou.source) or context.project.pou(name, pou.source)
    if found is None and (why := context.project.why_unseen(spec.text, pou.source)) is not None:
        context.report.add(why[0], pou.source, spec, *why[1:])
        return None
    if found is None:
        known = [each.name for each in context.project.pous.values() if each.kind in kinds and each is not pou]
        context.report.add("S1001", pou.source, spec, f"there is no {' or '.join(kinds)} {spec.text}",
                           context.project.nearest(name, known))
        return None
    if found.kind not in kinds:
        context.report.add("S1001", pou.source, spec, f"{found.name} is {with_article(found.kind)}", _instead(pou, found))
        return None
    if found is pou or found.busy:
        context.report.add("S1001", pou.source, spec, f"{pou.name} extends itself" if found is pou else
                           f"{found.name} extends or holds {pou.name}", "a base is declared without what is derived from it")
        return None
    chosen = generic_blocks.chosen(Scope(context, pou.source, pou), found, spec)
    return chosen if chosen is not None and context.interface(chosen, pou.source, spec) and chosen.type is not None else None


def _instead(pou: Pou, found: Pou) -> str:
    """What to do where a head names something of the wrong kind; "" if that is nothing that may stand in a head."""
    if pou.kind == "INTERFACE":
        return "an interface extends interfaces only"
    if found.kind == "INTERFACE":
        return "IMPLEMENTS names interfaces"
    if pou.kind == "CLASS":
        return "a class extends classes only"
    return "EXTENDS names blocks" if found.kind in _BASES else ""


def shown(method: Pou) -> str:
    """How messages call a method or an accessor."""
    name = method.tree.name.text
    return f"the method {name}" if method.kind == "METHOD" else f"{method.kind.capitalize()} of the property {name}"


def refuse_abstract(context: Context, kind: Type, source: Source, node: tree.Node) -> None:
    """Report a variable that is or holds an instance of a block that is ABSTRACT."""
    while isinstance(kind, ArrayType):
        kind = kind.element
    if isinstance(kind, StructType) and not kind.block:
        for member in kind.fields.values():
            refuse_abstract(context, member.type, source, node)
    elif isinstance(kind, StructType) and "ABSTRACT" in context.block_of(kind).modifiers:
        lacking = ", ".join(shown(method) for method in missing(context.block_of(kind)))
        context.report.add("S1007", source, node, f"{kind} is ABSTRACT and has no instances",
                           "declare one of a block that extends it" + (f" and has {lacking}" if lacking else ""))


# --- members ----------------------------------------------------------------------------------------------------------


def check_members(context: Context, pou: Pou) -> None:
    """Check the methods of a POU against those that it inherits and implements."""
    for key, method in pou.methods.items():
        if key in ("FB_INIT", "FB_EXIT"):
            continue  # they are never called by way of their bases
        parents = [found for parent in (pou.base, *pou.interfaces) if parent and (found := parent.method(key)) is not None]
        for parent in parents:
            _check_override(context, pou, method, parent)
        if "OVERRIDE" in method.modifiers and not pou.inherits:
            _check_overriding(context, method, parents)
        if "ABSTRACT" in method.modifiers and pou.kind != "INTERFACE" and "ABSTRACT" not in pou.modifiers:
            _report(context, "S1007", method, f"{shown(method)} is ABSTRACT, and {pou.name} is not",
                    f"write {pou.kind} ABSTRACT {pou.name}")
    if pou.kind != "INTERFACE" and not pou.inherits:
        _check_complete(context, pou)
        for interface in pou.interfaces:
            for key, wanted in all_methods(interface).items():
                inherited = pou.base.method(key) if pou.base is not None and key not in pou.methods else None
                if inherited is not None:
                    _check_override(context, pou, inherited, wanted)


def _check_overriding(context: Context, method: Pou, parents: Sequence[Pou]) -> None:
    """Report a method with OVERRIDE, where `parents` are those of its name in its base and interfaces, that overrides none: a
    PRIVATE one is seen in its own block only."""
    if not parents:
        _report(context, "S1003", method, f"{shown(method)} overrides nothing", "leave OVERRIDE out, or name what it overrides")
    elif all("PRIVATE" in parent.modifiers for parent in parents):
        _report(context, "S1003", method, f"{shown(method)} overrides nothing: that of {_home(parents[0])} is PRIVATE",
                "leave OVERRIDE out: it is a method of its own", parents[0])


def _report(context: Context, code: str, method: Pou, message: str, hint: str = "", other: Pou | None = None) -> None:
    related = (other.source, other.tree.name.start, "declared here") if other is not None else None
    context.report.add(code, method.source, method.tree.name, message, hint, related)


def _check_override(context: Context, pou: Pou, method: Pou, parent: Pou) -> None:
    """Report what forbids that `method` overrides or implements `parent`: FINAL, its parameters, its access."""
    if "PRIVATE" in parent.modifiers:
        return
    if "FINAL" in parent.modifiers:
        _report(context, "S1002", method, f"{shown(method)} is FINAL in {_home(parent)} and cannot be overridden", "", parent)
    if not all(context.interface(each, pou.source, method.tree.name) for each in (method, parent)):
        return
    if method.has_failed_names or parent.has_failed_names:
        return
    if (difference := _difference(method, parent)):
        _report(context, "S1004", method, f"{shown(method)} of {_home(method)} differs from the one of {_home(parent)}: "
                f"{difference}", "an override has the same parameters, in the same order, and the same result", parent)
    elif _width(method) < _width(parent):
        _report(context, "S1006", method, f"{shown(method)} is {_access(method)} here and {_access(parent)} in {_home(parent)}",
                "what overrides may be seen as widely as what it overrides", parent)


def _home(method: Pou) -> str:
    assert method.block is not None
    return method.block.name


def _access(method: Pou) -> str:
    return next((word for word in _ACCESS if word in method.modifiers), "PUBLIC")


def _width(method: Pou) -> int:
    return {"PRIVATE": 0, "PROTECTED": 1, "INTERNAL": 1}.get(_access(method), 2)


def _difference(method: Pou, parent: Pou) -> str:
    """The first difference between two heads in words, "" if there is none."""
    mine, theirs = _parameters(method), _parameters(parent)
    for own, other in zip(mine, theirs, strict=False):
        if (own.kind, fold(own.name)) != (other.kind, fold(other.name)):
            return f"{own.kind} {own.name} stands here for {other.kind} {other.name}"
        if own.type != other.type:
            return f"{own.name} is {own.type} here and {other.type} there"
    if len(mine) != len(theirs):
        more = mine[len(theirs):] or theirs[len(mine):]
        return f"{more[0].name} stands {'here' if len(mine) > len(theirs) else 'there'} only"
    own_result, other_result = _result(method), _result(parent)
    if own_result != other_result:
        return f"its result is {own_result or 'none'} here and {other_result or 'none'} there"
    return ""


def _parameters(method: Pou) -> list[Variable]:
    return [variable for variable in method.order if variable.kind in _PARAMETERS]


def _result(method: Pou) -> Type | None:
    return method.result.type if method.result is not None else None


def all_methods(pou: Pou) -> dict[str, Pou]:
    """All methods that a POU has or promises, by key: its own, inherited ones, those of its interfaces."""
    found: dict[str, Pou] = {}
    for each in [*pou.lineage()][::-1]:
        if each.interfaces:
            found = {key: method for parent in each.interfaces for key, method in all_methods(parent).items()} | found
        found |= each.methods
    return found


def _unimplemented(pou: Pou) -> Iterator[Pou]:
    """The methods that a block inherits or promises, and that have no body in it."""
    own = {key: method for each in [*pou.lineage()][::-1] for key, method in each.methods.items()}
    for key, method in all_methods(pou).items():
        meant = own.get(key) or pou.method(key) or method
        if meant.block is not None and (meant.block.kind == "INTERFACE" or "ABSTRACT" in meant.modifiers):
            yield meant


def missing(pou: Pou) -> list[Pou]:
    """The methods that keep a block from having instances."""
    return list(_unimplemented(pou))


def _check_complete(context: Context, pou: Pou) -> None:
    """Report methods without a body in a block that is not ABSTRACT."""
    if "ABSTRACT" in pou.modifiers:
        return
    lacking = [method for method in missing(pou) if method.block is not pou]
    if lacking:
        names = ", ".join(f"{shown(method)[4:] if method.kind == 'METHOD' else shown(method)} of {_home(method)}"
                          for method in lacking)
        context.report.add("S1003", pou.source, pou.tree.name, f"{pou.name} lacks {names}",
                           f"write {_head(lacking[0])}, or make it {pou.kind} ABSTRACT {pou.name}")


def _head(method: Pou) -> str:
    """The head of a missing method, as it is written."""
    name, result = method.tree.name.text, method.tree.result
    if method.kind != "METHOD":
        return f"PROPERTY {name} with {method.kind}"
    text = method.source.text[result.start:result.end] if result is not None else ""
    return f"METHOD {name}" + (f" : {text}" if text else "")
