"""Lowering of calls of POUs: inputs in, body, outputs out; EN and ENO."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fbvm.base.types import BOOL, DINT, LINT, AnyType, OpenArrayType, RefType, followed, machine
from fbvm.check.expressions.constants import default
from fbvm.check.symbols.facts import PouCall, Variable
from fbvm.code.lowering.any_parameters import described
from fbvm.code.lowering.places import Place
from fbvm.code.lowering.values import is_aggregate, nothing
from fbvm.code.operations import INTEGERS, Address, Block, Node
from fbvm.syntax import tree

if TYPE_CHECKING:
    from fbvm.code.lowering.bodies import BodyLowering

TRUE: Node = ("const", "b", 1)
FALSE: Node = ("const", "b", 0)


class CallLowering:
    """Lowers the calls of POUs in one body.

    With EN FALSE nothing of the call happens but that EN and ENO become FALSE: inputs are neither worked out nor
    passed, the body is not run, outputs keep their values, a function's result is the default of its type."""

    def __init__(self, body: BodyLowering) -> None:
        self.body = body

    def statement(self, call: tree.Call, called: PouCall) -> None:
        """A call whose result, if there is one, is thrown away."""
        if called.pou.home is None:
            self._guarded(call, called, None)
            return
        instance = self.body.places.of(called.instance) if called.instance is not None else Place(("self", 0, ()), BOOL)
        self.body.out.append(("call", self.body.program.number(called.pou), instance.address))

    def value(self, call: tree.Call, called: PouCall) -> Node:
        """A call of a function for its result."""
        result = called.pou.result
        assert result is not None
        number = self.body.temporary()
        form = machine(result.type)
        place = self._place(called, result, None)
        after: Block = (("let", number, form, self.body.places.load(place)),)
        if called.enable is not None:
            empty = nothing(form)
            if form in INTEGERS:  # an enumeration begins with its first member
                empty = ("const", form, int.from_bytes(default(result.type), "little"))
            self.body.out.append(("let", number, form, empty))
        self._guarded(call, called, after)
        return ("tmp", form, number)

    def aggregate(self, call: tree.Call, called: PouCall) -> Place:
        """A call of a function whose result is an array or a structure: the place of the result."""
        result = called.pou.result
        assert result is not None
        place = self._place(called, result, None)
        if called.enable is not None:
            self.body.out.append(("fill", place.address, result.initial))
        self._guarded(call, called, None)
        return place

    # --- parts ------------------------------------------------------------------------------------------------------

    def _guarded(self, call: tree.Call, called: PouCall, after: Block | None) -> None:
        """The whole call, inside an IF where EN is given or declared."""
        body = self.body
        site = body.site(call)
        instance = body.places.fixed(body.places.of(called.instance)) if called.instance is not None else None
        own_en = self._parameter(called, "EN", "VAR_INPUT")
        own_eno = self._parameter(called, "ENO", "VAR_OUTPUT")
        enable = body.value(called.enable, BOOL) if called.enable is not None else None
        if own_en is not None:
            place = self._place(called, own_en, instance)
            if enable is not None:
                body.write(place, enable, site)
            elif called.pou.is_function:
                body.write(place, TRUE, site)
            enable = body.places.load(place)
        if enable is None:
            self._run(call, called, instance, site, own_eno)
            body.out += after or ()
            self._report(called, TRUE, site)
            return
        enable = body.keep(enable)
        with body.block() as inner:
            self._run(call, called, instance, site, own_eno)
            inner += after or ()
        otherwise: Block = ()
        if own_eno is not None and (instance is not None or called.outputs):
            otherwise = (body.places.store(self._place(called, own_eno, instance), FALSE, site),)
            with body.block() as falls:
                self._outputs([o for o in called.outputs if o[0] is own_eno], called, instance, site)
            otherwise += tuple(falls)
        body.out.append(("if", ((enable, tuple(inner)),), otherwise))
        self._report(called, enable, site)

    def _report(self, called: PouCall, enable: Node, site: int) -> None:
        """ENO of a POU that declares none: whether it was run."""
        for target, negated in called.enabled:
            node: Node = ("not", "b", enable) if negated else enable
            self.body.write(self.body.places.of(target), node, site)

    def _run(self, call: tree.Call, called: PouCall, instance: Place | None, site: int, eno: Variable | None) -> None:
        self._inputs(called, instance, site)
        if eno is not None and (called.pou.enables_itself or not called.pou.writes_eno):
            self.body.out.append(self.body.places.store(self._place(called, eno, instance), TRUE, site))
        address: Address | None = instance.address if instance is not None else None
        self._execute(called, address)
        self._outputs(called.outputs, called, instance, site)
        for variable, expr in called.in_outs if called.pou.actions else ():
            if self._ends(expr):  # an ACTION that is called later finds nothing instead of what has ended
                body = self.body
                body.out.append(("store", "ref", self._place(called, variable, instance).address, ("const", "ref", 0)))

    def _execute(self, called: PouCall, address: Address | None) -> None:
        """Run the body, unless a task of its own does."""
        run: Node = ("call", self.body.program.number(called.pou), address)
        if called.tasked is None:
            self.body.out.append(run)
            return
        places = self.body.places
        self.body.out.append(("if", ((("not", "b", places.load(places.slot(called.tasked))), (run,)),), ()))

    def _ends(self, expr: tree.Expr) -> bool:
        """True for what an in-out is bound to and may end with the body that passes it."""
        variable = self.body.facts.variables.get(self.body.facts.root(expr))
        return variable is not None and (variable.kind == "VAR_IN_OUT" or variable.place == "frame")

    def _inputs(self, called: PouCall, instance: Place | None, site: int) -> None:
        body = self.body
        passed = sorted([*called.inputs, *called.in_outs], key=lambda pair: pair[1].start)
        aggregates = [(v, e) for v, e in passed if v.kind == "VAR_INPUT" and is_aggregate(v.type)]
        passed = [pair for pair in passed if pair not in aggregates]
        nodes = body.values.sequence(self._argument(variable, expr) for variable, expr in passed)
        for variable, expr in aggregates:
            body.copy(self._place(called, variable, instance), body.aggregate(expr), site)
        for (variable, expr), node in zip(passed, nodes, strict=True):
            place = self._place(called, variable, instance)
            if variable.kind == "VAR_IN_OUT":
                body.out.append(("store", "ref", place.address, node))
                if isinstance(variable.type, OpenArrayType):
                    self._bounds(place, expr)
                elif isinstance(variable.type, AnyType):
                    self._described(place, expr)
            else:
                body.write(place, node, site)
        if called.pou.is_function:
            given = {id(v) for v, _ in called.inputs}
            for variable in called.pou.parameters("VAR_INPUT"):
                if id(variable) not in given and variable.name.upper() != "EN":
                    place = self._place(called, variable, instance)
                    body.out.append(("fill", place.address, variable.initial))

    def _bounds(self, slot: Place, expr: tree.Expr) -> None:
        """Store the bounds of what is passed to ARRAY [*] beside its reference."""
        for number, node in enumerate(self.body.places.bounds(expr)):
            self.body.out.append(("store", "i64", slot.moved(8 + 8 * number, LINT).address, node))

    def _described(self, slot: Place, expr: tree.Expr) -> None:
        """Store the size and type of what is passed to an ANY beside its reference."""
        for offset, node in described(self.body, expr):
            self.body.out.append(("store", "i32", slot.moved(offset, DINT).address, node))

    def _argument(self, variable: Variable, expr: tree.Expr) -> Node:
        if variable.kind == "VAR_IN_OUT":
            return self.body.places.reference(self.body.places.of(expr))
        if isinstance(variable.type, RefType) and variable.type.follows:
            return self.body.pointers.lent(expr)
        return self.body.value(expr, variable.type)

    def _outputs(self, outputs: list[tuple[Variable, tree.Expr, bool]], called: PouCall, instance: Place | None,
                 site: int) -> None:
        body = self.body
        for variable, target, negated in outputs:
            source = self._place(called, variable, instance)
            if source.type is not (kind := followed(source.type)):
                source = Place((("ref", body.places.load(source), site), 0, ()), kind)
            place = body.places.of(target)
            if is_aggregate(source.type):
                body.copy(place, source, site)
                continue
            node = body.places.load(source)
            if negated:
                node = ("not", "b", node)
            body.write(place, body.converted(node, source.type, place.type), site)

    def _parameter(self, called: PouCall, name: str, kind: str) -> Variable | None:
        return next((v for v in called.pou.parameters(kind) if v.name.upper() == name), None)

    def _place(self, called: PouCall, variable: Variable, instance: Place | None) -> Place:
        """The slot of a callee's variable; of one that VAR_CONFIG gives a place, that place."""
        if instance is None or variable.place != "self":
            return self.body.places.slot(variable)
        slot = instance.moved(variable.offset, variable.type)
        return self.body.places.behind(slot, self.body.entry_site) if variable.open else slot
