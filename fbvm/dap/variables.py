"""Scopes and variables of a stop: inputs, outputs, locals, globals, areas, the words of units, what is forced, the run itself.

A variable is named by its whole path or its address wherever it comes back (`evaluateName`)."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace

from fbvm.base.areas import Area
from fbvm.base.digits import whole_number
from fbvm.base.types import BOOL, ArrayType, Elementary, EnumType, Field, StructType, base
from fbvm.dap.memory import reference_of
from fbvm.dap.session import Body, Container, DebugSession, Refusal, StackFrame
from fbvm.step.past_session import PastSession
from fbvm.step.properties import PropertyValue
from fbvm.step.session import Session
from fbvm.watch.paths import Place, Span, element
from fbvm.watch.places import parse_for
from fbvm.watch.scopes import Scope
from fbvm.watch.values import Value, in_hexadecimal, show, show_time

MOST_ROWS = 256
"""Rows that a client without paging gets at once; more are in nodes of so many."""
MOST_ELEMENTS = 16
"""Arrays up to so many elements have them as their value; of others these are not read."""
SECTIONS = (("Inputs", ("VAR_INPUT",), "arguments"), ("Outputs", ("VAR_OUTPUT",), ""), ("In-outs", ("VAR_IN_OUT",), ""))
"""Scopes by the sections of a POU, and their presentation hints; all others are Locals."""
FORCED = " (forced)"
_BESIDE = re.compile(r"(?: \((?:16#[0-9A-F]+|-?\d+)\))?(?:  .*)?$", re.S)
"""What is shown behind a literal: its number, or its value in hexadecimal, and what the word means."""


def scopes(debug: DebugSession, frame: StackFrame) -> list[Body]:
    """The scopes of a frame; those without variables are left out."""
    rows: list[Body] = []
    session = debug.plc(frame.plc)
    _add_sections(debug, rows, frame)
    facts = session.facts
    found = [_found(session, field.name) for field in facts.symbols.values()]
    programs = [place for place in found if isinstance(place.type, StructType) and place.type.block]
    variables_of = [place for place in found if place not in programs]
    _add(debug, rows, "Globals", _places(debug, session, variables_of), len(variables_of))
    _add(debug, rows, "Programs", _places(debug, session, programs), len(programs))
    _add(debug, rows, "Areas", _areas(debug, session), len(facts.areas), expensive=True)
    described = [_found(session, address) for address in facts.described]
    _add(debug, rows, "Units", _places(debug, session, described), len(described), hint="registers", paged=True)
    forces = [_found(session, name) for name in _forces(session)]
    _add(debug, rows, "Forced", _places(debug, session, forces), len(forces))
    runtime = _runtime(debug, frame.plc)
    _add(debug, rows, "Runtime", Container(lambda start, count: _cut(runtime, start, count), _unwritable), len(runtime))
    changes = [change.place for change in session.changes()]
    _add(debug, rows, "Last change", _places(debug, session, changes), len(changes), paged=True)
    return rows


def _add_sections(debug: DebugSession, rows: list[Body], frame: StackFrame) -> None:
    """The variables of the instance by their sections."""
    scope = debug.scope(frame)
    session, instance = debug.plc(frame.plc), scope.instance
    _add_frame(debug, rows, session, scope)
    if instance is None or not isinstance(instance.type, StructType):
        return
    fields = [field for field in instance.type.fields.values() if "$" not in field.name]
    special = {kind for _, kinds, _ in SECTIONS for kind in kinds}
    for name, kinds, hint in (*SECTIONS, ("Locals", (), "locals")):
        chosen = [field for field in fields if (field.kind in kinds if kinds else field.kind not in special)]
        _add(debug, rows, name, _fields(debug, session, instance, chosen), len(chosen), hint=hint)
    properties = session.properties.of(instance.type)
    _add(debug, rows, "Properties", _values(debug, session, instance, properties), len(properties), expensive=True)


def _add_frame(debug: DebugSession, rows: list[Body], session: Session | PastSession, scope: Scope) -> None:
    """The variables that live while the body is executed: those of a function by their sections, else as Temporary."""
    named = {field.name: field.kind for field in scope.local.values()}
    parts = [(name, kinds, hint) for name, kinds, hint in SECTIONS if scope.instance is None]
    special = {kind for _, kinds, _ in parts for kind in kinds}
    for name, kinds, hint in (*parts, ("Locals" if scope.instance is None else "Temporary", (), "locals")):
        chosen = [own for own, kind in named.items() if (kind in kinds if kinds else kind not in special)]
        places = [place for own in chosen if isinstance(place := scope.find(own), Place)]
        _add(debug, rows, name, _places(debug, session, places, scope), len(places), hint=hint)


def _add(debug: DebugSession, rows: list[Body], name: str, container: Container, count: int, *, hint: str = "",
         expensive: bool = False, paged: bool = False) -> None:  # fmt: skip
    if not count:
        return
    row: Body = {"name": name, "variablesReference": debug.refer(container), "expensive": expensive}
    row["indexedVariables" if paged else "namedVariables"] = count
    if hint:
        row["presentationHint"] = hint
    rows.append(row)


def _found(session: Session | PastSession, name: str) -> Place:
    found = session.player.find(name)
    assert isinstance(found, Place)
    return found


def _forces(session: Session | PastSession) -> Iterable[str]:
    return session.plc.forces if isinstance(session, Session) else ()


def _unwritable(name: str) -> Place:
    raise Refusal(f"{name} is shown only; it cannot be written")


def variables(debug: DebugSession, arguments: Body) -> list[Body]:
    """The rows of a container, those that a client asks for."""
    container: Container = debug.referred(arguments.get("variablesReference"), Container)
    start, count = int(arguments.get("start") or 0), arguments.get("count")
    debug.hexadecimal = bool((arguments.get("format") or {}).get("hex"))
    return container.children(start, int(count) if count else None)


# --- containers ------------------------------------------------------------------------------------------------------


def _cut(rows: Sequence[Body], start: int, count: int | None) -> list[Body]:
    return list(rows[start : None if count is None else start + count])


def _fields(debug: DebugSession, session: Session | PastSession, instance: Place, fields: Sequence[Field]) -> Container:
    """The variables of an instance."""

    def children(start: int, count: int | None) -> list[Body]:
        chosen = fields[start : None if count is None else start + count]
        return [variable(debug, session, _member(session, instance, field), field.name) for field in chosen]

    return Container(children, lambda name: session.player.find(f"{instance.name}.{name}"))


def _members(debug: DebugSession, session: Session | PastSession, instance: Place, fields: Sequence[Field],
             properties: Sequence[str]) -> Container:  # fmt: skip
    """The variables of an instance, and its properties, whose accessors are executed when somebody asks for the value."""
    variables_of = _fields(debug, session, instance, fields)

    def children(start: int, count: int | None) -> list[Body]:
        end = len(fields) + len(properties) if count is None else start + count
        chosen = properties[max(0, start - len(fields)) : max(0, end - len(fields))]
        return variables_of.children(start, count) + [_lazy(debug, session, instance, name) for name in chosen]

    return Container(children, variables_of.named)


def _lazy(debug: DebugSession, session: Session | PastSession, instance: Place, name: str) -> Body:
    """The row of a property that is not read yet: its one child has the value."""
    container = _values(debug, session, instance, [name])
    return {"name": name, "value": "", "evaluateName": f"{instance.name}.{name}", "variablesReference": debug.refer(container),
            "presentationHint": {"kind": "property", "attributes": ["readOnly"], "lazy": True}}  # fmt: skip


def _values(debug: DebugSession, session: Session | PastSession, instance: Place, names: Sequence[str]) -> Container:
    """Properties, which are read when a client asks for the rows."""
    return Container(lambda start, count: _property_rows(debug, session, instance, _chosen(names, start, count)), _unwritable)


def _chosen(names: Sequence[str], start: int, count: int | None) -> Sequence[str]:
    return names[start : None if count is None else start + count]


def _property_rows(debug: DebugSession, session: Session | PastSession, instance: Place, names: Sequence[str]) -> list[Body]:
    """The values of properties of an instance; of one whose accessor ends with a trap, what it says."""
    rows: list[Body] = []
    for name in names:
        try:
            made = session.property(f"{instance.name}.{name}", Scope(session.player.find))
        except ValueError as error:
            rows.append({"name": name, "value": str(error), "variablesReference": 0})
            continue
        if made is not None:
            rows.append(property_row(debug, session, made, name))
    return rows


def property_row(debug: DebugSession, session: Session | PastSession, made: PropertyValue, name: str) -> Body:
    """The row of a property that was read."""
    value = session.names.name_references(made.place.type, made.value)
    return {"name": name, "value": _shown(debug, made.place, value) if value is not None else "NULL",
            "type": made.place.type.name, "evaluateName": made.place.name, "variablesReference": 0,
            "presentationHint": {"kind": "property", "attributes": ["readOnly"]}}  # fmt: skip


def _member(session: Session | PastSession, instance: Place, field: Field) -> Place:
    return _found(session, f"{instance.name}.{field.name}")


def _places(debug: DebugSession, session: Session | PastSession, places: Sequence[Place],
            scope: Scope | None = None) -> Container:  # fmt: skip
    """Variables and addresses by their names."""

    def children(start: int, count: int | None) -> list[Body]:
        return [variable(debug, session, place, place.name) for place in places[start : None if count is None else start + count]]

    return Container(children, scope.find if scope else session.player.find)


def _areas(debug: DebugSession, session: Session | PastSession) -> Container:
    """The memory areas."""
    areas = list(session.facts.areas.values())

    def children(start: int, count: int | None) -> list[Body]:
        return [_area(debug, session, area) for area in areas[start : None if count is None else start + count]]

    return Container(children, session.player.find)


def _area(debug: DebugSession, session: Session | PastSession, area: Area) -> Body:
    width = area.address_bits or area.unit_bits
    units = area.size_bytes * 8 // width

    def rows(start: int, count: int) -> list[Body]:
        found: list[Body] = []
        for number in range(start, min(start + count, units)):
            bits = number * width
            unit = Place("", BOOL, area.offset + bits // 8, bits % 8 if width == 1 else None)
            name = f"{area.name}{number}" if area.unit_bits == 1 else session.names.address(unit)
            if name:
                found.append(variable(debug, session, _found(session, name), name))
        return found

    row: Body = {"name": area.name, "value": area.title or f"{units} units", "type": "area",
                 "memoryReference": reference_of(area.offset)}  # fmt: skip
    return _indexed(debug, row, units, rows, session.player.find)


def _indexed(debug: DebugSession, row: Body, count: int, rows: Callable[[int, int], list[Body]],
             named: Callable[[str], Place | Span]) -> Body:  # fmt: skip
    """A row whose children have numbers: for a client that pages them by itself, else in nodes."""
    row["indexedVariables"] = count
    if debug.supports("supportsVariablePaging") or count <= MOST_ROWS:
        def children(start: int, wanted: int | None) -> list[Body]:
            return rows(start, min(count - start, count if wanted is None else wanted)) if start < count else []
    else:
        row["indexedVariables"] = -(-count // MOST_ROWS)

        def children(start: int, wanted: int | None) -> list[Body]:
            nodes: list[Body] = []
            for first in list(range(0, count, MOST_ROWS))[start : None if wanted is None else start + wanted]:
                size = min(MOST_ROWS, count - first)
                inner = Container(lambda at, most, first=first, size=size: _cut(rows(first, size), at, most), named)  # type: ignore[misc]
                nodes.append({"name": f"[{first}..{first + size - 1}]", "value": "", "variablesReference": debug.refer(inner)})
            return nodes

    row["variablesReference"] = debug.refer(Container(children, named))
    return row


# --- variables -------------------------------------------------------------------------------------------------------


def variable(debug: DebugSession, session: Session | PastSession, place: Place, name: str, *, bare: bool = False) -> Body:
    """The row of a variable or address; `bare` without what marks it as forced."""
    plain = base(place.type)
    row: Body = {"name": name, "value": text_of(debug, session, place, bare=bare), "type": place.type.name,
                 "evaluateName": _expression(place), "variablesReference": 0}  # fmt: skip
    hint: Body = {"attributes": []}
    if place.constant:
        hint["attributes"] += ["constant", "readOnly"]
    if isinstance(session, PastSession):
        hint["attributes"].append("readOnly")
    if place.name in set(_forces(session)):
        hint["attributes"].append("forced")
    if hint["attributes"]:
        row["presentationHint"] = hint
    if isinstance(plain, ArrayType):
        row |= {"memoryReference": reference_of(place.offset)} if not place.hops else {}
        array = plain

        def rows(start: int, count: int) -> list[Body]:
            found = [element(place, array, number) for number in range(start, start + count)]
            return [variable(debug, session, one, one.name[len(place.name):]) for one in found]

        return _indexed(debug, row, array.count, rows, lambda part: session.player.find(f"{place.name}{part}"))
    if isinstance(plain, StructType):
        fields = [field for field in plain.fields.values() if "$" not in field.name]
        row |= {"memoryReference": reference_of(place.offset)} if not place.hops else {}
        properties = session.properties.of(plain) if plain.block else []
        row["namedVariables"] = len(fields) + len(properties)
        row["variablesReference"] = debug.refer(_members(debug, session, place, fields, properties))
    elif place.area:
        row["memoryReference"] = reference_of(place.offset)
    return row


def _expression(place: Place) -> str:
    """What names a place in expressions, in which T0005 is the present value of a timer."""
    return f"{place.area}{whole_number(place.name[1:])}" if place.area in ("TF", "CNF") else place.name


def text_of(debug: DebugSession, session: Session | PastSession, place: Place, *, bare: bool = False) -> str:
    """The value of a place: `T#50ms`, `129 (16#0081)` of a word of an area, `Filling (2)` of an enumeration."""
    plain = base(place.type)
    if isinstance(plain, StructType):
        return plain.name
    if isinstance(plain, ArrayType) and plain.count > MOST_ELEMENTS:
        return place.type.name
    value = session.names.name_references(place.type, session.player.read(place))
    if value is None:
        return "NULL"
    text = _shown(debug, place, value)
    if bare:
        return show(place.type, value)
    facts = session.facts
    if said := facts.described.get(place.name):
        meaning = facts.meanings.get(place.name, {}).get(value) if isinstance(value, int) else None
        text += f"  {said}" + (f": {meaning}" if meaning else "")
    return text + FORCED * (place.name in set(_forces(session)))


def _shown(debug: DebugSession, place: Place, value: Value) -> str:
    """The literal of a value; where hexadecimal is asked for, that of integers and bit strings."""
    plain = base(place.type)
    if debug.hexadecimal or place.hexadecimal:
        is_number = isinstance(plain, Elementary) and not plain.families.isdisjoint(("ANY_INT", "ANY_BIT"))
        if is_number and isinstance(value, int) and not isinstance(value, bool):
            return in_hexadecimal(place.type, value)
        return show(place.type, value, hexadecimal=True)
    text = show(place.type, value)
    if place.area and isinstance(value, int) and not isinstance(value, bool) and not isinstance(plain, EnumType):
        text += f" ({show(place.type, value, hexadecimal=True)})"
    return text


def _runtime(debug: DebugSession, name: str) -> list[Body]:
    """The state of the run."""
    session = debug.plc(name)
    rows = {
        "scan": str(session.here.scan), "statement": str(session.here.step), "time": show_time(session.now_ns),
        "cycle": show_time(session.facts.cycle_ns),
    }  # fmt: skip
    if isinstance(session, Session):
        live = session.units
        rows |= {"mode": session.plc.mode.value, "executed scans": str(live.scans), "budget": str(live.budget),
                 "engine": "machine code" if live.engine.machine is not None else "Python",
                 "warnings": "; ".join(live.warnings) or "none"}  # fmt: skip
    else:
        scans = session.source.scans
        rows |= {"recorded scans": f"{scans.start} to {scans.stop - 1}"}
    if session.trap:
        rows["trap"] = str(session.trap)
    return [{"name": name, "value": value, "variablesReference": 0, "presentationHint": {"attributes": ["readOnly"]}}
            for name, value in rows.items()]


def _written(text: str) -> str:
    """The literal in the text of a value as it is shown, which editors send back."""
    text = text.strip()
    if text[:1] in ("'", '"', "[", "("):
        return text.removesuffix(FORCED)
    return _BESIDE.sub("", text.removesuffix(FORCED), count=1).strip()


def set_variable(debug: DebugSession, place: Place | Span, text: str) -> Body:
    """Writes a value at this position, once.  Raises Refusal, ValueError or TypeError."""
    session = debug.plc()
    if isinstance(place, Span):
        raise Refusal("set one value after the other")
    if isinstance(base(place.type), StructType):
        raise Refusal(f"{place.name} is {place.type.name}: set its members")
    value = parse_for(place, _written(text))
    end = session.units.scans if isinstance(session, Session) else 0
    here = session.here
    session.act(lambda plc: plc.write(place, value))
    debug.running.forget()
    said = f"wrote {place.name} := {show(place.type, value)} in scan {here.scan}"
    if end > here.scan + 1:
        said += f"; scans {here.scan + 1}..{end - 1} are forgotten"
    debug.send_event("output", {"category": "console", "output": f"{said}\n"})
    return variable(debug, session, replace(place), place.name)
