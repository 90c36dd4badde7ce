"""Builds the nodes of declarations: POUs, variables, types, configurations (grammar/declarations.lark)."""

from __future__ import annotations

from collections.abc import Sequence

from fbvm.syntax.sfc.elements import Part, SfcElements
from fbvm.syntax.st.expressions import Item
from fbvm.syntax.st.jumps import Jumps, Tangled
from fbvm.syntax.st.lexer import Token
from fbvm.syntax.st.refused import refused_what
from fbvm.syntax.st.statements import Items
from fbvm.syntax.tree import (
    Access,
    AccessVars,
    Action,
    Actions,
    Argument,
    ArrayInit,
    Block,
    BlockTask,
    Configuration,
    ConfigVar,
    ConfigVars,
    Declaration,
    Expr,
    GlobalVars,
    Initial,
    Location,
    Member,
    Name,
    NamedType,
    Node,
    Pou,
    ProgramInstance,
    Refused,
    RefusedStatement,
    Resource,
    SourceText,
    Task,
    TypeSpec,
    VarDecl,
    VarSection,
)
from fbvm.syntax.tree.sfc import Step, Transition

Head = tuple[Name, list[Refused]]
Settings = AccessVars | ConfigVars
Section = VarSection | Refused | Settings
Element = Action | Step | Transition | Refused
ConfigItem = VarSection | Task | ProgramInstance | Refused | Settings


class Declarations(SfcElements):
    """The functions of the rules of declarations."""

    def source_text(self, declarations: list[Declaration]) -> SourceText:
        return SourceText(0, len(self.source.text), tuple(declarations))

    # --- POUs ---

    def add_inheritance(self, refused: list[Refused], word: Token, names: list[NamedType]) -> list[Refused]:
        what, code = refused_what(word.text)
        refused.append(Refused(word.start, names[-1].end, what, code))
        return refused

    def pou_head(self, modifiers: list[Token], token: Token, inheritance: list[Refused]) -> Head:
        """FINAL, PUBLIC and their like say who may extend or name a POU, and change nothing that it does."""
        return self.declared(token), [*(self.refused(m) for m in modifiers if m.text.upper() == "ABSTRACT"), *inheritance]

    def pou(self, word: Token, head: Head, sections: list[Section], items: Items, actions: list[Element],
            end: Token) -> Pou:
        return self.function(word, head, None, None, sections, items, actions, end)

    def function(self, word: Token, head: Head, colon: Token | None, result: TypeSpec | None,
                 sections: list[Section], items: Items, actions: list[Element], end: Token) -> Pou:
        name, refused = head
        accesses = [s for s in sections if isinstance(s, AccessVars) and word.type == "PROGRAM"]
        refused += [_out_of_place(s) for s in (*sections, *actions)
                    if s not in accesses and not isinstance(s, VarSection | Action | Step | Transition)]
        blocks = [i for i in items if isinstance(i, RefusedStatement) and self.is_block(i)]
        refused += [Refused(b.start, b.end, b.what, b.code) for b in blocks]
        body = self.block([i for i in items if i not in blocks] if blocks else items)
        self.refuse_selves()
        declared = [s for s in sections if isinstance(s, VarSection)]
        own = [a for a in actions if isinstance(a, Action)]
        if self.ladders:
            from fbvm.syntax.ladder.blocks import begin

            own += [subroutine for ladder in self.ladders for subroutine in ladder.subroutines]
            if word.type == "PROGRAM":
                begin(self.ladders)
            declared += self.ladder_sections(declared)
        self.numbered = dict(self.numbered_everywhere)
        body = self.without_jumps(body, declared)
        if self.charted or any(isinstance(a, Step | Transition) for a in actions):
            from fbvm.syntax.sfc.charts import Charts

            charts = Charts(self, own, declared)
            body = charts.body(word, body, [a for a in actions if not isinstance(a, Refused)])
            own, declared = charts.actions, declared + charts.sections
        return Pou(word.start, end.end, word.text.upper(), name, result, tuple(declared), body, tuple(refused), tuple(own),
                   tuple(accesses))

    def without_jumps(self, body: Block, declared: list[VarSection]) -> Block:
        """The body of a POU with conditions and loops for its jumps; as it is where these cannot say the same."""
        jumps = Jumps(self.targets, self.labels)
        for jump in jumps.astray():
            self.report("S0201", jump.start, jump.end, f"there is no label {self.targets[jump]} here",
                        "write `name:` in front of the statement to go on with")
        try:
            made = jumps.body(body) if self.targets or self.labels else body
        except Tangled:
            made = body
        else:
            declared += [jumps.section(body)] if jumps.flags else []
        self.targets.clear()
        self.labels.clear()
        return made

    def ladder_sections(self, sections: list[VarSection]) -> list[VarSection]:
        """What the LADDERs of a POU need: memory of their steps, and instances that the POU has not declared itself."""
        from fbvm.syntax.ladder.blocks import undeclared

        first, last = self.ladders[0], self.ladders[-1]
        instances = undeclared([i for ladder in self.ladders for i in ladder.instances], sections, self.report)
        kept = {v.names[0].text: v for ladder in self.ladders for v in ladder.variables}
        temporaries = {v.names[0].text: v for ladder in self.ladders for v in ladder.temporaries}
        self.ladders.clear()
        return [VarSection(first.start, last.end, kind, (), tuple(variables), True)
                for kind, variables in (("VAR", [*kept.values(), *instances]), ("VAR_TEMP", temporaries.values())) if variables]

    def action(self, word: Token, owner: Token | None, dot: Token | None, token: Token, colon: Token | None, items: Items,
               end: Token) -> Action:
        body = self.block(items)
        self.refuse_selves()
        return Action(word.start, end.end, self.name(owner) if owner else None, self.declared(token), body)

    def action_chart(self, word: Token, token: Token, colon: Token, items: Items, parts: list[Part], end: Token) -> Action:
        made = self.action(word, None, None, token, colon, items, end)
        self.charted[made] = parts
        return made

    def actions_of(self, word: Token, owner: Token | None, actions: list[Element], end: Token) -> Actions:
        for part in (each for each in actions if isinstance(each, Step | Transition)):
            self.report("S0111", part.start, part.end, "a chart stands in its POU, not in ACTIONS", "")
        return Actions(word.start, end.end, self.name(owner) if owner else None,
                       tuple(a for a in actions if isinstance(a, Action)), tuple(a for a in actions if isinstance(a, Refused)))

    def is_block(self, statement: RefusedStatement) -> bool:
        """Whether a refused statement is a METHOD or the like, which belongs to the POU and not to its body."""
        return statement.what not in ("THIS", "SUPER", "JMP", "__TRY") and not statement.what.startswith("label")

    # --- variables ---

    def var_section(self, word: Token, qualifiers: list[Name], variables: list[VarDecl], end: Token) -> VarSection:
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
        return Location(token.start, token.end, token.text)

    # --- initial values ---

    def array_bare(self, first: list[Item], comma: Token, items: list[list[Item]]) -> ArrayInit:
        flat = (*first, *(item for group in items for item in group))
        parts = [part for item in flat for part in item if part is not None]
        return ArrayInit(parts[0].start, parts[-1].end, flat) if parts else ArrayInit(comma.start, comma.end, flat)

    def array_bare_repeated(self, count: Token, opener: Token, values: list[Initial] | None, closer: Token) -> ArrayInit:
        return ArrayInit(count.start, closer.end, tuple(self.array_repeated(count, opener, values, closer)))

    # --- configuration ---

    def configuration(self, word: Token, token: Token, items: list[ConfigItem | Resource], end: Token) -> Configuration:
        loose = [i for i in items if isinstance(i, (Task, ProgramInstance))]
        resources = [i for i in items if isinstance(i, Resource)]
        if loose:
            resources.append(_resource(loose[0].start, loose[-1].end, None, None, loose))
        return Configuration(
            word.start, end.end, self.declared(token), tuple(i for i in items if isinstance(i, VarSection)),
            tuple(resources), tuple(i for i in items if isinstance(i, Refused)), _settings(items))

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
        tuple(i for i in items if isinstance(i, Refused)), _settings(items))


def _out_of_place(item: Refused | Settings) -> Refused:
    """What a POU cannot have."""
    if isinstance(item, Refused):
        return item
    return Refused(item.start, item.end, f"{'VAR_ACCESS' if isinstance(item, AccessVars) else 'VAR_CONFIG'} of a POU", "S0901")


def _settings(items: Sequence[Node]) -> tuple[Settings, ...]:
    return tuple(i for i in items if isinstance(i, AccessVars | ConfigVars))
