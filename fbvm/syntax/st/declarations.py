"""Builds the nodes of declarations of variables and of configurations (grammar/declarations.lark, 6.5, 6.8)."""

from __future__ import annotations

from collections.abc import Sequence

from fbvm.syntax.st.expressions import Item
from fbvm.syntax.st.lexer import Token
from fbvm.syntax.st.types import Types
from fbvm.syntax.tree import (
    Access,
    AccessVars,
    Argument,
    ArrayInit,
    BlockTask,
    Configuration,
    ConfigVar,
    ConfigVars,
    Expr,
    Form,
    GlobalVars,
    Initial,
    Location,
    Member,
    Name,
    NamedType,
    Node,
    ProgramInstance,
    Resource,
    Task,
    TypeSpec,
    VarDecl,
    VarSection,
)

Settings = AccessVars | ConfigVars
SET_BY = {"S": {"RS"}, "R": {"SR", "CTU", "CTUD"}}
"""Operator of instruction lists -> standard blocks that have an input of that name (a counter may have its type in the name): in
front of an instance of these the operator gives the input, table 70."""
_LATCHING = frozenset().union(*SET_BY.values())
ConfigItem = VarSection | Task | ProgramInstance | Settings


class Declarations(Types):
    """The functions of the rules of variables and configurations."""

    # --- variables ---

    def var_section(self, word: Token, qualifiers: list[Name], variables: list[VarDecl], end: Token) -> VarSection:
        for declared in variables:
            if isinstance(declared.spec, NamedType) and declared.spec.text.upper().partition("_")[0] in _LATCHING:
                self.blocks.update((name.text.upper(), declared.spec.text.upper()) for name in declared.names)
        if word.text.upper() == "VAR_GENERIC":
            self.forms.append(Form("generic_constants", word.start, word.end, (
                "S0901", "VAR_GENERIC is of CODESYS", "declare VAR CONSTANT, and give each size a block of its own")))
        return VarSection(word.start, end.end, word.text.upper(), tuple(qualifiers), tuple(variables))

    def global_vars(self, section: VarSection) -> GlobalVars:
        for name in (name.text.upper() for variable in section.variables for name in variable.names):
            if name in self.numbered:
                self.numbered_everywhere[name] = self.numbered[name]
        return GlobalVars(section.start, section.end, section)

    def pass_over_variable(self, variables: list[VarDecl], semicolon: Token) -> list[VarDecl]:
        return variables

    def var_decl(self, names: list[Name], at: Token | None, location: Token | None, colon: Token, spec: TypeSpec,
                 edge: Token | None, sign: Token | None, initial: Initial | None, end: Token) -> VarDecl:
        place = self.location(location) if location else None
        if place or self.numbered:
            self.note_numbered(names, place.text if place else "")
        if sign and sign.text.upper() in ("S=", "R="):
            self.report("S0101", sign.start, sign.end, f"`{sign.text}` gives no initial value", "write `:=`")
        return VarDecl(names[0].start, end.end, tuple(names), place, spec, initial, edge.text.upper() if edge else "")

    def var_decl_nameless(self, at: Token, location: Token, colon: Token, spec: TypeSpec, sign: Token | None,
                          initial: Initial | None, end: Token) -> VarDecl:
        return VarDecl(at.start, end.end, (), self.location(location), spec, initial)

    def var_decl_struct(self, names: list[Name], at: Token | None, location: Token | None, colon: Token, spec: TypeSpec,
                        end: Token | None) -> VarDecl:
        place = self.location(location) if location else None
        return VarDecl(names[0].start, end.end if end else spec.end, tuple(names), place, spec, None)

    def var_decl_struct_init(self, names: list[Name], at: Token | None, location: Token | None, colon: Token,
                             spec: TypeSpec, sign: Token, initial: Initial, end: Token) -> VarDecl:
        return self.var_decl(names, at, location, colon, spec, None, sign, initial, end)

    def location(self, token: Token) -> Location:
        self.note_bit_of_word(token)
        return Location(token.start, token.end, token.text)

    # --- initial values ---

    def array_bare(self, first: list[Item], comma: Token, items: list[list[Item]]) -> ArrayInit:
        flat = (*first, *(item for group in items for item in group))
        parts = [part for item in flat for part in item if part is not None]
        return ArrayInit(parts[0].start, parts[-1].end, flat) if parts else ArrayInit(comma.start, comma.end, flat)

    def array_bare_repeated(self, count: Token, opener: Token, items: list[list[Item]] | None, closer: Token) -> ArrayInit:
        return ArrayInit(count.start, closer.end, tuple(self.array_repeated(count, opener, items, closer)))

    def array_round(self, opener: Token, bare: ArrayInit, closer: Token) -> ArrayInit:
        """`(1, 2, 3)`, which means [1, 2, 3]."""
        self.forms.append(Form("round_arrays", opener.start, closer.end, (
            "S0101", "the values of an array stand in parentheses", "write them in brackets: [1, 2, 3]")))
        node = ArrayInit(opener.start, closer.end, bare.items)
        self.deepen_over(node, [value for _, value in bare.items if value is not None])
        return node

    # --- configuration ---

    def configuration(self, word: Token, token: Token, items: list[ConfigItem | Resource], end: Token) -> Configuration:
        loose = [i for i in items if isinstance(i, (Task, ProgramInstance))]
        resources = [i for i in items if isinstance(i, Resource)]
        if loose:
            resources.append(_resource(loose[0].start, loose[-1].end, None, None, loose))
        return Configuration(
            word.start, end.end, self.declared(token), tuple(i for i in items if isinstance(i, VarSection)),
            tuple(resources), _settings(items))

    def resource(self, word: Token, token: Token, on: Token | None, processor: Token | None, items: list[ConfigItem],
                 end: Token) -> Resource:
        return _resource(word.start, end.end, self.declared(token), self.name(processor) if processor else None, items)

    def task(self, word: Token, token: Token, opener: Token, arguments: list[Argument] | None, closer: Token,
             end: Token) -> Task:
        parts: dict[str, Expr | None] = dict.fromkeys(("SINGLE", "INTERVAL", "PRIORITY"))
        for argument in arguments or ():
            key = argument.name.text.upper() if argument.name and argument.kind == ":=" else ""
            if key not in parts or argument.value is None:
                self.report("S0101", argument.start, argument.end, "a TASK takes SINGLE, INTERVAL and PRIORITY",
                            "write `INTERVAL := T#10ms, PRIORITY := 1`")
            elif parts[key] is not None:
                self.report("S0801", argument.start, argument.end, f"{key} is given twice", "")
            else:
                parts[key] = argument.value
        return Task(word.start, end.end, self.declared(token), parts["SINGLE"], parts["INTERVAL"], parts["PRIORITY"])

    def program_instance(self, word: Token, qualifiers: list[Name], token: Token, with_: Token | None,
                         task: Token | None, colon: Token, type_name: NamedType, end: Token) -> ProgramInstance:
        return self.program_connected(word, qualifiers, token, with_, task, colon, type_name, None, None, None, end)

    def program_connected(self, word: Token, qualifiers: list[Name], token: Token, with_: Token | None,
                          task: Token | None, colon: Token, type_name: NamedType, opener: Token | None,
                          connections: list[Argument | BlockTask] | None, closer: Token | None,
                          end: Token) -> ProgramInstance:
        given = connections or []
        return ProgramInstance(
            word.start, end.end, self.declared(token), tuple(qualifiers), self.name(task) if task else None,
            Name(type_name.start, type_name.end, type_name.text), tuple(c for c in given if isinstance(c, Argument)),
            tuple(c for c in given if isinstance(c, BlockTask)))

    def path_direct(self, of: Expr, dot: Token, address: Token) -> Member:
        return Member(of.start, address.end, of, Name(address.start, address.end, address.text))

    def access_decl(self, token: Token, colon: Token, path: Expr, second: Token, spec: TypeSpec, direction: Token | None,
                    end: Token) -> Access:
        writable = direction is not None and direction.text.upper() == "READ_WRITE"
        return Access(token.start, end.end, self.declared(token), path, spec, writable)

    def access_vars(self, word: Token, variables: list[Access], end: Token) -> AccessVars:
        return AccessVars(word.start, end.end, tuple(variables))

    def config_decl(self, path: Expr, at: Token | None, location: Token | None, colon: Token, spec: TypeSpec,
                    sign: Token | None, initial: Initial | None, end: Token) -> ConfigVar:
        return ConfigVar(path.start, end.end, path, self.location(location) if location else None, spec, initial)

    def config_vars(self, word: Token, variables: list[ConfigVar], end: Token) -> ConfigVars:
        return ConfigVars(word.start, end.end, tuple(variables))

    def fb_task(self, instance: Expr, with_: Token, task: Token) -> BlockTask:
        return BlockTask(instance.start, task.end, instance, self.name(task))


def _resource(start: int, end: int, name: Name | None, processor: Name | None,
              items: list[ConfigItem] | list[Task | ProgramInstance]) -> Resource:
    return Resource(
        start, end, name, processor, tuple(i for i in items if isinstance(i, VarSection)),
        tuple(i for i in items if isinstance(i, Task)), tuple(i for i in items if isinstance(i, ProgramInstance)),
        _settings(items))


def _settings(items: Sequence[Node]) -> tuple[Settings, ...]:
    return tuple(i for i in items if isinstance(i, AccessVars | ConfigVars))
