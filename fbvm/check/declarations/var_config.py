"""VAR_CONFIG and VAR_ACCESS: paths from a configuration to variables of instances (IEC 61131-3 ed. 3, tables 16 and 62).

    VAR_CONFIG  station.program.instance.variable AT %IX0.3 : BOOL;  END_VAR      the place of `AT %I*`, or a first value
    VAR_ACCESS  name : station.program.variable : INT READ_WRITE;  END_VAR        another name, for those outside

The name of the RESOURCE may stand in front.  A path leads to what lies in an instance: not to in-outs and VAR_TEMP.
"""

from __future__ import annotations

from collections.abc import Iterator

from fbvm.base.areas import PORTABLE_AREAS, Address, AddressError
from fbvm.base.diagnostics import Source
from fbvm.base.dialects import takers
from fbvm.base.types import BOOL, BYTE, DWORD, LWORD, WORD, ArrayType, Field, StructType, Type, fold
from fbvm.check.declarations.hidden import own_name
from fbvm.check.declarations.initial_bytes import initial_bytes
from fbvm.check.declarations.locations import completes, example, is_open, location_of
from fbvm.check.declarations.specs import resolve
from fbvm.check.expressions.constant_integers import integer
from fbvm.check.expressions.scope import Scope
from fbvm.check.symbols.config_facts import AccessPath, Completed, Spot
from fbvm.check.symbols.containment import Containment
from fbvm.check.symbols.context import Context
from fbvm.check.symbols.facts import Variable
from fbvm.syntax import tree

_WIDTHS: dict[int, Type] = {8: BYTE, 32: DWORD, 64: LWORD}
_UNREACHED = ("VAR_IN_OUT", "VAR_TEMP", "VAR_EXTERNAL")


class VarConfig:
    """What the VAR_CONFIG and VAR_ACCESS sections of a project say, once its programs have their instances."""

    def __init__(self, context: Context) -> None:
        self.context = context
        self.report = context.report
        self.completed: dict[tuple[object, ...], Completed] = {}
        """What the rows say, by the root and the steps of the variable."""
        self.accesses: list[AccessPath] = []
        self._given: dict[tuple[object, ...], tuple[Source, int]] = {}
        """Where a variable got its place, or its value."""
        self._placed: set[tuple[object, ...]] = set()
        """Variables for which some row has a place, a wrong one included."""
        self._holds_open = Containment(context, lambda pou: any(variable.open for variable in pou.order))

    def resolve(self) -> None:
        """Resolve all sections; report what VAR_CONFIG leaves out."""
        for section, source in self.context.project.config_sections:
            for row in section.variables:
                if isinstance(row, tree.ConfigVar):
                    self._config(row, source)
                else:
                    self._access(row, source)
        for root in self.context.global_order:
            if root.kind == "PROGRAM" and isinstance(root.type, StructType):
                pou = self.context.block_of(root.type)
                for row in (row for section in pou.tree.accesses for row in section.variables):
                    self._access(row, pou.source, Spot(root, (), root.type))
        self._left_out()

    @property
    def _resource_name(self) -> str:
        """Folded name of the RESOURCE, "" if it has none."""
        resource = self.context.resource
        return fold(resource.name.text) if resource is not None and resource.name is not None else ""

    def _config(self, row: tree.ConfigVar, source: Source) -> None:
        spot = self._spot(row.path, source)
        scope = Scope(self.context, source, None)
        resolved = resolve(scope, row.spec)
        if spot is None or resolved is None or not self._fits(row.path, spot, resolved[0], source):
            return
        declared = spot.steps[-1] if spot.steps and isinstance(spot.steps[-1], Field) else None
        if declared is not None and declared.constant:
            self.report.add("S0501", source, row.path, f"{declared.name} is CONSTANT and takes no other value")
            return
        address = None
        if row.location is not None:
            address = self._address(row, row.location, spot, source)
            if address is None:
                return
        initial = initial_bytes(scope, spot.type, row.initial, resolved[1]) if row.initial is not None else None
        variable = self._declaration(spot)
        if variable is not None and variable.open and variable.explicit and initial is None:
            initial = variable.initial
        self._complete(Completed(spot, address, initial), row, source)

    def _address(self, row: tree.ConfigVar, location: tree.Location, spot: Spot, source: Source) -> Address | None:
        """The address that a row gives to a variable `AT %I*`; None after a diagnostic."""
        self._placed.add((spot.root, _key(spot)))
        variable = self._declaration(spot)
        if variable is None or not variable.open:
            self.report.add("S0604", source, location, "only a variable AT %I*, %Q* or %M* takes a place from VAR_CONFIG",
                            f"declare it  AT %I*, or take {takers('places_for_all')}")
            return None
        if is_open(location, spot.type):
            self.report.add("S0604", source, location, f"VAR_CONFIG gives the whole address, and {location.text} is none",
                            "write one such as %IX0.3 or %QW2")
            return None
        shown = tree.VarDecl(row.start, row.end, (), location, row.spec, None)
        address = location_of(self.context, shown, spot.type, source)
        if address is not None and variable.own is not None:
            self.report.add("S0193", source, location, f"{variable.name} is not declared AT %I*, %Q* or %M*, and lies here",
                            f"declare it  AT %{address.area.lstrip('%')[0] if address.area in PORTABLE_AREAS else 'M'}*")
            return address
        return address if address is not None and completes(self.context, address, variable, location, source) else None

    def _declaration(self, spot: Spot) -> Variable | None:
        """The variable of a block or program that a path leads to; None for a member of a structure, and for an element."""
        holder = self._holder(spot)
        if holder is None or not holder.block:
            return None
        step = spot.steps[-1]
        assert isinstance(step, Field)
        return self.context.block_of(holder).variables.get(fold(step.name))

    def _holder(self, spot: Spot) -> StructType | None:
        """The structure or instance whose member a path leads to."""
        if spot.root is None or not spot.steps or not isinstance(spot.steps[-1], Field):
            return None
        holder = spot.root.type
        for step in spot.steps[:-1]:
            holder = step.type if isinstance(step, Field) else holder.element if isinstance(holder, ArrayType) else holder
        return holder if isinstance(holder, StructType) else None

    def _complete(self, row: Completed, node: tree.ConfigVar, source: Source) -> None:
        """Keep what a row says, unless a row before it has given the same variable an address, or a value."""
        variable = _identity(row.spot)
        for what, written in (("place", node.location), ("value", node.initial)):
            key = what, *variable
            if written is not None and key in self._given:
                self.report.add("S0202", source, node.path, f"this variable has got its {what} already", "",
                                (*self._given[key], "by this row"))
                return
            if written is not None:
                self._given[key] = source, node.start
        before = self.completed.get(variable, row)
        initial = row.initial if node.initial is not None or before.initial is None else before.initial
        self.completed[variable] = Completed(row.spot, row.address or before.address, initial)

    def _access(self, row: tree.Access, source: Source, program: Spot | None = None) -> None:
        spot = self._spot(row.path, source, program)
        resolved = resolve(Scope(self.context, source, None), row.spec)
        if spot is None or resolved is None or not self._fits(row.path, spot, resolved[0], source):
            return
        constant = spot.steps and isinstance(spot.steps[-1], Field) and spot.steps[-1].constant
        if row.writable and (constant or spot.root is not None and spot.root.constant):
            self.report.add("S0501", source, row.path, f"{row.name.text} leads to a CONSTANT, which nobody writes")
            return
        self.accesses.append(AccessPath(row.name.text, spot, row.writable))

    def _fits(self, node: tree.Node, spot: Spot, kind: Type, source: Source) -> bool:
        if kind == spot.type:
            return True
        self.report.add("S0301", source, node, f"this is {spot.type}, and {kind} is written behind it")
        return False

    # --- paths ------------------------------------------------------------------------------------------------------

    def _spot(self, path: tree.Expr, source: Source, program: Spot | None = None) -> Spot | None:
        """The variable that a path in a program or in the configuration names; None after a diagnostic."""
        if isinstance(path, tree.Direct):
            return self._direct(path.text, path, source)
        if isinstance(path, tree.NameRef) and program is not None:
            name = tree.Name(path.start, path.end, path.text)
            return self._member(program, tree.Member(path.start, path.end, path, name), source)
        if isinstance(path, tree.NameRef):
            return self._root(path.text, path, source)
        if isinstance(path, tree.Member):
            if program is None and isinstance(path.of, tree.NameRef) and fold(path.of.text) == self._resource_name:
                name = path.name
                return self._direct(name.text, name, source) if name.text[0] == "%" else self._root(name.text, name, source)
            of = self._spot(path.of, source, program)
            return self._member(of, path, source) if of is not None else None
        if isinstance(path, tree.Index):
            of = self._spot(path.of, source, program)
            return self._element(of, path, source) if of is not None else None
        self.report.add("S0801", source, path, "a path is made of names, points and subscripts")
        return None

    def _root(self, name: str, node: tree.Node, source: Source) -> Spot | None:
        variable = self.context.project.globals.get(("", fold(name)))
        if variable is not None and not variable.reference:
            return Spot(variable, (), variable.type)
        known = [v.name for v in self.context.project.globals.values()]
        self.report.add("S0801", source, node, f"there is no program, global variable or resource {name} here",
                        self.context.project.nearest(name, [*known, self._resource_name]))
        return None

    def _direct(self, text: str, node: tree.Node, source: Source) -> Spot | None:
        try:
            address = self.context.address(text, source)
        except AddressError as error:
            self.report.add("S0601", source, node, str(error))
            return None
        self.context.use_area(address.area)
        kind = BOOL if address.bit is not None else _WIDTHS.get(address.size_bits, WORD)
        return Spot(None, (), kind, address)

    def _member(self, of: Spot, path: tree.Member, source: Source) -> Spot | None:
        kind = of.type
        field = kind.member(path.name.text) if isinstance(kind, StructType) else None
        reached = field is not None and field.kind not in _UNREACHED and \
            not (field.reference and not self._is_open(kind, field))
        if field is None or not reached:
            known = [f.name for f in kind.fields.values()] if isinstance(kind, StructType) else []
            self.report.add("S0210", source, path.name, f"{kind} has no {path.name.text} that a path can reach",
                            self.context.project.choices(path.name.text, known))
            return None
        return Spot(of.root, (*of.steps, field), field.type)

    def _is_open(self, kind: Type, field: Field) -> bool:
        assert isinstance(kind, StructType) and kind.block, "no member of a structure is a reference"
        return self.context.block_of(kind).variables[fold(field.name)].open

    def _element(self, of: Spot, path: tree.Index, source: Source) -> Spot | None:
        kind = of.type
        scope = Scope(self.context, source, None)
        numbers = [integer(scope, subscript) for subscript in path.subscripts]
        if not isinstance(kind, ArrayType) or len(numbers) != len(kind.bounds):
            self.report.add("S0304", source, path, f"this is {kind}, which has no such element")
            return None
        at = 0
        for number, (low, high) in zip(numbers, kind.bounds, strict=True):
            if number is None:
                return None
            if not low <= number <= high:
                self.report.add("S0702", source, path, f"subscript {number} is outside {low}..{high} of {kind}")
                return None
            at = at * (high - low + 1) + number - low
        return Spot(of.root, (*of.steps, at), kind.element)

    # --- what is left out -------------------------------------------------------------------------------------------

    def _left_out(self) -> None:
        """Report instances with a variable AT %I* for which no VAR_CONFIG gives an address; keep other variables in place."""
        for root in self.context.global_order:
            for path, spot, variable in () if root.reference else self._open_in(Spot(root, (), root.type), root.name):
                if variable.own is not None:
                    self._keep(spot, variable)
                elif (root, _key(spot)) not in self._placed:
                    self.report.add("S0801", variable.source, variable.node, f"no VAR_CONFIG says where {path} lies",
                                    f"write  {path} AT {example(variable)} : {variable.type};  or the whole address here")

    def _keep(self, spot: Spot, variable: Variable) -> None:
        """Let a variable that could have a place, and has none, be a variable of its instance."""
        key = _identity(spot)
        row = self.completed.get(key, Completed(spot, None, None))
        holder = self._holder(spot)
        if row.address is None and holder is not None:
            own = holder.fields[fold(own_name(variable.name))]
            self.completed[key] = Completed(spot, None, row.initial, Spot(spot.root, (*spot.steps[:-1], own), own.type))

    def _open_in(self, spot: Spot, path: str) -> Iterator[tuple[str, Spot, Variable]]:
        """The variables inside another one that VAR_CONFIG gives a place."""
        kind = spot.type
        if not self._holds_open(kind):
            return
        if isinstance(kind, ArrayType):
            for index in range(kind.count):
                yield from self._open_in(_inner(spot, index, kind.element), f"{path}[{kind.subscripts(index)}]")
        elif isinstance(kind, StructType) and not kind.block:
            for field in kind.fields.values():
                yield from self._open_in(_inner(spot, field, field.type), f"{path}.{field.name}")
        elif isinstance(kind, StructType):
            for variable in self.context.block_of(kind).order:
                if not variable.open and (variable.place != "self" or variable.reference):
                    continue
                there, inner = _inner(spot, kind.fields[fold(variable.name)], variable.type), f"{path}.{variable.name}"
                if variable.open:
                    yield inner, there, variable
                else:
                    yield from self._open_in(there, inner)


def _inner(spot: Spot, step: Field | int, kind: Type) -> Spot:
    return Spot(spot.root, (*spot.steps, step), kind)


def _identity(spot: Spot) -> tuple[object, ...]:
    return spot.root, str(spot.address), _key(spot)


def _key(spot: Spot) -> tuple[object, ...]:
    return tuple(fold(step.name) if isinstance(step, Field) else step for step in spot.steps)
