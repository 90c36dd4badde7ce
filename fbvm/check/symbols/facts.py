"""What the checker finds out: variables, POUs, and side tables about the nodes of the trees."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TypeGuard, get_args

from fbvm.base.areas import Address
from fbvm.base.diagnostics import Source
from fbvm.base.types import ArrayType, Elementary, Field, RefType, StructType, Type, fold
from fbvm.check.symbols.dynamic_facts import Ended, Made
from fbvm.syntax import tree
from fbvm.syntax.st.pragmas import shown_in_hexadecimal
from fbvm.syntax.tree import Action, Node, VarDecl, VarSection
from fbvm.syntax.tree import Pou as PouTree
from fbvm.syntax.tree.il import CallsInRow

Value = int | float | bool | bytes | str
"""A constant: bool for BOOL, int for integers, bits, times, enumerations and characters, float for reals, bytes for STRING,
for WSTRING a str of UTF-16 units."""

PartOf = tree.Member | tree.Index | tree.Part
"""Expressions that may name a part of a variable."""
_PARTS = frozenset(get_args(PartOf))

UNTYPED_INT = Elementary("an integer literal", 0, 1, "i64", frozenset())
UNTYPED_REAL = Elementary("a real literal", 0, 1, "f64", frozenset())
"""Types of literals (and of expressions of nothing but literals) to which no operand and no place has given a type yet."""


GLOBAL_SLOT, PROGRAM_SLOT = 49990, 50000
"""In the order of initialisation, the places of lists of global variables and of programs that have no attribute
global_init_slot.  Source: CODESYS online help, attribute global_init_slot."""


@dataclass(eq=False)
class Variable:
    """One declared variable.  `kind` is its section's word, or RESULT for a function's result.

    `place` says what `offset` counts from: "self" (the instance), "abs" (the buffer), "frame" (the frame of `owner`, whose
    place is known after layout) or "area" (`location`, whose place is known after layout)."""

    name: str
    type: Type
    kind: str
    source: Source
    node: tree.Node
    owner: Pou | None = None
    place: str = "self"
    offset: int = 0
    initial: bytes = b""
    explicit: bool = False
    """True if the declaration itself gives an initial value."""
    guards: bool = False  # True for an EN that holds calls back while it is FALSE
    value: Value | None = None
    """The value of a CONSTANT of elementary type."""
    wrong: bool = False
    """True for a CONSTANT whose value has an error that is reported."""
    constant: bool = False
    retain: bool = False
    reference: bool = False
    open: bool = False
    """True for `AT %I*` that VAR_CONFIG completes: a reference then, which never changes."""
    open_location: str = ""
    """What is written behind AT if `open`: `%I*`, `%QX*`, `%IW1.2.3`."""
    by_reference: bool = False
    """True for a VAR_INPUT whose kind is VAR_IN_OUT, since it reads the argument where that lies."""
    any_length: bool = False
    """True for an in-out STRING that is declared without a length."""
    location: Address | None = None
    edge: str = ""
    role: str = ""
    """"step" or "action" for the flags of one, which programs only read."""
    written: bool = False
    step: Variable | None = None
    """Of a variable that is called as a step of its POU, in a dialect that takes this: the flags of the step."""
    eno: Variable | None = None
    """Of an instance of whose last call `name.ENO` is read: the hidden variable that says whether it ran."""
    own: Variable | None = None
    """Of an in-out, in a dialect that takes values for it from outside: the hidden variable that holds these."""
    space: str = ""
    """The name of the list that declares a global variable; with `qualified` it must stand in front of its name."""
    qualified: bool = False
    declared: VarDecl | None = None
    """The declaration of it, with the arguments of FB_init."""
    init_slot: int = GLOBAL_SLOT
    """Of a global variable the place of its list in the order of initialisation."""
    object: int | None = None
    """The number of its object (see code.operations), or its position among those of an instance, once something refers to it."""

    @property
    def role_of_parameter(self) -> str:
        """What the declaration makes of a parameter that stands for its argument: an input or an in-out."""
        return "input" if self.by_reference or self.kind == "VAR_INPUT" else "in-out"

    @property
    def hexadecimal(self) -> bool:
        """True if the declaration asks tools to show it in hexadecimal."""
        return shown_in_hexadecimal(self.source.text, self.node.start)


@dataclass(eq=False)
class Pou:
    """What is known about a POU: its tree and, once resolved, its variables and layout."""

    name: str
    kind: str
    source: Source
    tree: tree.Pou
    variables: dict[str, Variable] = field(default_factory=dict)
    other_names: dict[str, str] = field(default_factory=dict)
    """Other names of pins that callers may use, folded, each with the pin's own name."""
    order: list[Variable] = field(default_factory=list)
    result: Variable | None = None
    type: StructType | None = None
    """The type of its instances (blocks and programs)."""
    initial: bytes = b""
    """Initial bytes of an instance, or of the frame of a function."""
    frame_size: int = 0
    frame_initial: bytes = b""
    """VAR_TEMP of blocks and all variables of functions live in the frame; `frame_initial` its bytes at entry."""
    frame_inputs: int = 0
    """Bytes at the start of a function's frame that the caller writes."""
    frame_given: int = 0
    """Bytes at the start of a method's frame that lie alike in its overrides: inputs, and what the caller reads."""
    frame_offset: int = 0
    stack_bytes: int = 0
    """Bytes of each of its frames on the stack, if calls of it may come back; a reference to the newest is at `frame_offset`."""
    number: int = -1
    as_written: bool = True
    """False if its tree is not that of its source, but was made for one call or one program."""
    template: PouTree | None = None
    """Of a block with VAR_GENERIC its tree as it is written, of which blocks for other constants are made."""
    nesting: int = 0  # of a block that was made so, how many such blocks ask for one another in front of it
    resolved: bool = False
    calls: dict[Pou, Node] = field(default_factory=dict)
    dynamic_calls: dict[Pou, Node] = field(default_factory=dict)
    """Of these the calls that may execute the body of a derived type instead."""
    writes_eno: bool = False
    enables_itself: bool = False
    """True if the body writes ENO without declaring it: ENO is TRUE at each start then."""
    constant_externals: set[str] = field(default_factory=set)
    """Folded names of global variables that it may only read, by VAR_EXTERNAL CONSTANT, though they are no constants."""
    failed_names: set[str] = field(default_factory=set)
    """Folded names whose declaration has an error: using them is not reported again."""
    inherits: bool = False
    """True if what it EXTENDS has an error that is reported: any unknown name may come from that."""
    later: dict[str, tuple[VarDecl, VarSection]] = field(default_factory=dict)
    """By folded name the declarations behind the one that is being resolved."""
    later_constants: dict[VarDecl, tuple[Type, bytes] | None] = field(default_factory=dict)
    """Of these the CONSTANTs that were named before: type and value; None while they are being resolved."""
    busy: bool = False
    awaited: list[RefType] = field(default_factory=list)
    """References to instances that were made while the POU was being resolved; they get their target afterwards."""
    edges: list[Edge] = field(default_factory=list)
    referred: list[Variable] = field(default_factory=list)
    """Variables of an instance that something refers to; each is an object of its own."""
    written_actions: list[tuple[Action, Source]] = field(default_factory=list)
    actions: dict[str, Pou] = field(default_factory=dict)
    """Its ACTIONs by folded name; each is a body that works on the same instance."""
    home: Pou | None = None
    """The POU that an ACTION belongs to."""
    block: Pou | None = None
    """The block, class, program or interface that a METHOD belongs to, or an accessor of a PROPERTY."""
    base: Pou | None = None
    """The block that it EXTENDS."""
    interfaces: list[Pou] = field(default_factory=list)
    """The interfaces that it IMPLEMENTS; those that an INTERFACE EXTENDS."""
    methods: dict[str, Pou] = field(default_factory=dict)
    """Its own methods by folded name; accessors of properties have the names `GET name` and `SET name`."""
    modifiers: frozenset[str] = frozenset()
    """The words of its head: ABSTRACT, FINAL, OVERRIDE, PUBLIC, PRIVATE, PROTECTED, INTERNAL."""
    identifier: int = 0
    """The number with which each of its instances begins."""
    this: Variable | None = None
    """Of a block that extends none: its instance as a whole, if a reference to it or to a derived one is made."""
    types: dict[str, Type] = field(default_factory=dict)
    """What generic types stand for in a function that was instantiated for one call."""
    passed_as_is: frozenset[str] | None = None
    """Folded names of the parameters of generic type that are taken as they are passed; None until `generics` finds them."""
    leases: list[int] = field(default_factory=list)
    """Leases that its body holds until it ends."""
    tasked: dict[Variable, Variable] = field(default_factory=dict)
    """Instances of a program that a CONFIGURATION gives tasks of their own, and the variable that says whether it does so
    for this instance of the program: calls do not run them then."""
    _by_kind: dict[str, tuple[int, tuple[Variable, ...]]] = field(default_factory=dict, repr=False)
    """Results of `parameters`, each with the length of `order`, which only grows."""

    @property
    def is_function(self) -> bool:
        return self.kind == "FUNCTION"

    @property
    def is_routine(self) -> bool:
        """True for a FUNCTION, METHOD or accessor: its variables lie in a frame and begin anew at each call."""
        return self.kind in ("FUNCTION", "METHOD", "GET", "SET")

    @property
    def own_block(self) -> Pou | None:
        """The POU on whose instance its body works; None for a FUNCTION."""
        return None if self.kind == "FUNCTION" else self.block or self.owner

    @property
    def key(self) -> str:
        """The key of a method or accessor among the methods of its block, of an ACTION its name."""
        name = fold(self.tree.name.text)
        return f"{self.kind} {name}" if self.kind in ("GET", "SET") else name

    def lineage(self) -> Iterator[Pou]:
        """Itself, what it EXTENDS, what that EXTENDS ..."""
        pou: Pou | None = self
        while pou is not None:
            yield pou
            pou = pou.base

    def method(self, key: str) -> Pou | None:
        """Its method of that key, its own or an inherited one; of an interface one of those that it extends."""
        if self.kind != "INTERFACE" or key in self.methods:
            return next((pou.methods[key] for pou in self.lineage() if key in pou.methods), None)
        return next((found for parent in self.interfaces if (found := parent.method(key)) is not None), None)

    def action(self, name: str) -> Pou | None:
        """Its ACTION of that folded name, its own or an inherited one."""
        return next((pou.actions[name] for pou in self.lineage() if name in pou.actions), None)

    def all_referred(self) -> list[Variable]:
        """The variables of its instances that something refers to: those of what it extends first."""
        return [variable for pou in [*self.lineage()][::-1] for variable in pou.referred]

    def refer_to_instances(self) -> Variable:
        """Make each instance of a block, and of those derived from it, something that references refer to as a whole."""
        *_, root = self.lineage()
        if root.this is None:
            assert root.type is not None
            root.this = Variable("THIS", root.type, "VAR", root.source, root.tree.name, root)
            root.referred.append(root.this)
        return root.this

    def is_failed(self, name: str) -> bool:
        """True if it is reported already why nothing is known under this name."""
        return self.inherits or fold(name) in self.failed_names or self.block is not None and self.block.is_failed(name)

    @property
    def has_failed_names(self) -> bool:
        """True if not all of its variables are known, which is reported already."""
        return self.inherits or bool(self.failed_names)

    @property
    def owner(self) -> Pou:
        """The POU whose variables its body sees: of an ACTION the one that it belongs to, else itself."""
        return self.home or self

    def parameters(self, kind: str) -> tuple[Variable, ...]:
        """Its variables of one kind, in the order of the declaration."""
        known = self._by_kind.get(kind)
        if known is None or known[0] != len(self.order):
            known = self._by_kind[kind] = len(self.order), tuple(v for v in self.order if v.kind == kind)
        return known[1]


@dataclass(frozen=True, eq=False)
class Edge:
    """An input declared R_EDGE or F_EDGE: what the caller writes, what the body reads, and the memory between calls."""

    raw: Variable
    hidden: Variable
    memory: Variable
    falling: bool


@dataclass(eq=False)
class PouCall:
    """A call of a function or of an instance.

    `instance` is the expression of the instance (None for a function); `inputs`, `in_outs` and `outputs` pair the
    parameter with its argument; `enable` is the argument for EN; `enabled` the target of ENO if the POU declares none."""

    pou: Pou
    instance: tree.Expr | None
    inputs: list[tuple[Variable, tree.Expr]] = field(default_factory=list)
    in_outs: list[tuple[Variable, tree.Expr]] = field(default_factory=list)
    kept: list[Variable] = field(default_factory=list)
    """In-outs without an argument, which keep the value that they have had, in a dialect that takes such calls."""
    outputs: list[tuple[Variable, tree.Expr, bool]] = field(default_factory=list)
    enable: tree.Expr | None = None
    enabled: list[tuple[tree.Expr, bool]] = field(default_factory=list)
    tasked: Variable | None = None
    """The variable that says whether the body is run by a task of its own, and not by calls."""
    dynamic: bool = False
    """True if the instance may be of a derived type, whose body is executed then."""


@dataclass(eq=False)
class StandardCall:
    """A call of a standard function: its lowering's key, arguments with the type each is wanted in, type variables."""

    key: str
    arguments: list[tuple[tree.Expr, Type]]
    detail: tuple[Type, ...] = ()


@dataclass(eq=False)
class Guard:
    """EN and ENO of a call of a standard function."""

    enable: tree.Expr | None = None
    enabled: list[tuple[tree.Expr, bool]] = field(default_factory=list)


@dataclass(frozen=True, eq=False)
class Holder:
    """The object around a target of a reference: `expr` is the variable or the address, None where the
    target is reached by a reference already.  A `lease` ends with the body."""

    expr: tree.Expr | None = None
    variable: Variable | None = None
    lease: int | None = None


@dataclass(frozen=True, eq=False)
class AggregatePart:
    """One value of an aggregate that is computed when the program runs: its offsets in the aggregate (several if it is
    repeated), its bit, its type and its expression."""

    places: tuple[int, ...]
    bit: int | None
    kind: Type
    value: tree.Expr


@dataclass(frozen=True, eq=False)
class Aggregate:
    """An array or structure written out in a statement: its variable in the frame, its bytes with all constant values, and
    the parts that are computed when the program runs."""

    place: Variable
    content: bytes
    parts: tuple[AggregatePart, ...]


@dataclass(frozen=True, eq=False)
class Start:
    """An initial value of a reference: `place` is the variable that REF(x) or ADR(x) names.

    `pou` is whose variables the place is looked for in, None for types and global variables.  A `late` one is made at
    each start of its body, since the variable that holds it lives in the frame."""

    place: tree.Expr
    whole: tree.Expr
    kind: RefType
    source: Source
    pou: Pou | None
    late: bool


@dataclass
class Facts:
    """Side tables by node."""

    types: dict[tree.Expr, Type] = field(default_factory=dict)
    wrong: set[tree.Expr] = field(default_factory=set)
    """Expressions without a type: a diagnostic says why."""
    constants: dict[tree.Expr, Value] = field(default_factory=dict)
    undefined: dict[tree.Expr, tuple[Source, str]] = field(default_factory=dict)
    """Calls of constants that have no value, where they stand, and the code of the trap that they become."""
    variables: dict[tree.Expr, Variable] = field(default_factory=dict)
    fields: dict[tree.Expr, Field] = field(default_factory=dict)
    bits: dict[tree.Expr, tree.Part] = field(default_factory=dict)
    """Member expressions that name a bit by a constant, and the bit."""
    directs: dict[tree.Expr, Address] = field(default_factory=dict)
    operands: dict[tree.Expr, Type] = field(default_factory=dict)
    """The type in which a binary operator works on its operands."""
    by_elements: set[tree.Expr] = field(default_factory=set)
    """Sums of a reference and a number of elements, not of bytes."""
    calls: dict[tree.Call, PouCall | StandardCall] = field(default_factory=dict)
    rewritten: dict[tree.Expr, tree.Expr] = field(default_factory=dict)
    """Expressions that mean the same as another one (ADD(a, b) is a + b)."""
    last_calls: dict[CallsInRow, tree.Call] = field(default_factory=dict)
    """Of calls of an instruction list one behind the other the last that has a result."""
    guards: dict[tree.Call, Guard] = field(default_factory=dict)
    labels: dict[tree.CaseBranch, tuple[tuple[int, int], ...]] = field(default_factory=dict)
    failed: set[tree.Expr] = field(default_factory=set)
    """Targets of assignment attempts that get NULL."""
    attempts: dict[tree.Expr, StructType] = field(default_factory=dict)
    """Targets of assignment attempts that get the reference if its instance is of this type, else NULL."""
    assigned: set[tree.Call] = field(default_factory=set)
    """Calls whose result is the whole value of an assignment."""
    reversed_bytes: set[tree.Call] = field(default_factory=set)
    """Calls whose result is the argument with its bytes in another order."""
    copies: dict[tree.Expr, Variable] = field(default_factory=dict)
    """Arguments on single bits for an ANY input, which reads a copy that fills a byte, and texts that a VAR_IN_OUT CONSTANT
    cannot read where they lie: the variable with the copy."""
    aggregates: dict[tree.Expr, Aggregate] = field(default_factory=dict)
    assignments: dict[tree.Expr, tree.Assign] = field(default_factory=dict)
    """Values `(a := b)`, with the assignments that they are in a dialect."""
    bare: dict[tree.CallStatement, tree.Call] = field(default_factory=dict)
    """Statements that name an ACTION without (), with the calls that they mean."""
    selves: dict[tree.Expr, Pou] = field(default_factory=dict)
    """THIS and SUPER, with the block as which they see the instance."""
    gets: dict[tree.Expr, tree.Call] = field(default_factory=dict)
    """Expressions that name a property, with the calls of GET that they mean."""
    as_interfaces: set[tree.Expr] = field(default_factory=set)
    """Instances to which an interface is made to refer."""
    sets: dict[tree.Expr, PouCall] = field(default_factory=dict)
    """Targets of assignments that name a property, with the calls of SET that they mean; those have no input yet."""
    text_cases: set[tree.Case] = field(default_factory=set)
    """CASE statements that choose by a STRING."""
    conditional: set[tree.Statement] = field(default_factory=set)
    """RETURN(condition), which leaves the POU if the condition holds."""
    sources: dict[tree.Node, Source] = field(default_factory=dict)
    followed: dict[tree.Expr, RefType] = field(default_factory=dict)
    """Expressions that name a REFERENCE TO, and its type; they stand for what it is bound to."""
    starts: list[Start] = field(default_factory=list)
    """References of initial values, in which each stands as its number here (see `code.layout.reference_marks`)."""
    holders: dict[tree.Expr, Holder] = field(default_factory=dict)
    """For each target of a reference the object within which the reference can be moved."""
    leases: dict[Variable, int] = field(default_factory=dict)
    made: dict[tree.Call, Made] = field(default_factory=dict)
    ended: dict[tree.Call, Ended] = field(default_factory=dict)
    referred: list[Variable] = field(default_factory=list)
    """Variables with one place that something refers to."""
    losses: list[tuple[Source, tree.Expr, str, str]] = field(default_factory=list)
    """Constants that their variables do not hold as they are written: source, node, code and message of the warning."""

    def is_part(self, expr: tree.Expr) -> TypeGuard[PartOf]:
        """True for a member, element or bit, which lies in what it is of; not for an element behind a pointer, nor for
        what a member that is declared REFERENCE TO is bound to."""
        return type(expr) in _PARTS and expr not in self.variables and expr not in self.gets and \
            expr not in self.followed and not isinstance(self.types.get(expr.of), RefType)  # type: ignore[attr-defined]

    def root(self, expr: tree.Expr) -> tree.Expr:
        """The variable, address, dereference or element behind a pointer of which a place is a part."""
        while self.is_part(expr):
            expr = expr.of
        return expr


def is_block(kind: Type) -> bool:
    """True for the type of a function block's or program's instances."""
    return isinstance(kind, StructType) and kind.block


def holds_block(kind: Type) -> bool:
    """True for an instance, and for arrays and structures that hold one."""
    if isinstance(kind, Elementary):
        return False
    if isinstance(kind, ArrayType):
        return holds_block(kind.element)
    return is_block(kind) or isinstance(kind, StructType) and any(holds_block(f.type) for f in kind.fields.values())
