"""Builds the nodes of type declarations and type specifications (grammar/declarations.lark, 6.4)."""

from __future__ import annotations

from fbvm.syntax.st.expressions import Item
from fbvm.syntax.st.lexer import Token
from fbvm.syntax.st.statements import Statements
from fbvm.syntax.tree import (
    Argument,
    ArraySpec,
    ConstructedSpec,
    Declaration,
    EnumSpec,
    Expr,
    Form,
    Initial,
    Name,
    NamedType,
    NameRef,
    RefSpec,
    StringSpec,
    StructSpec,
    SubrangeSpec,
    TypeDecl,
    TypeSpec,
    UnionSpec,
    VarDecl,
)
from fbvm.syntax.tree.node import changed

EnumMember = tuple[Name, Expr | None]


class Types(Statements):
    """The functions of the rules of types."""

    def type_declaration(self, word: Token, declarations: list[Declaration], end: Token) -> list[Declaration]:
        return declarations

    def modified_type_declaration(self, word: Token, modifiers: list[Token], declarations: list[Declaration],
                                  end: Token) -> list[Declaration]:
        internal = any(each.text.upper() == "INTERNAL" for each in modifiers)
        return [changed(each, internal=internal) if isinstance(each, TypeDecl) else each for each in declarations]

    def type_decl(self, token: Token, colon: Token, spec: TypeSpec, sign: Token | None, initial: Initial | None,
                  end: Token) -> TypeDecl:
        return TypeDecl(token.start, end.end, self.declared(token), spec, initial)

    def type_decl_open(self, token: Token, colon: Token, spec: TypeSpec, end: Token | None = None) -> TypeDecl:
        return TypeDecl(token.start, end.end if end else spec.end, self.declared(token), spec, None)

    def type_decl_extends(self, token: Token, word: Token, bases: list[NamedType], colon: Token, spec: TypeSpec,
                          end: Token | None) -> TypeDecl:
        if isinstance(spec, StructSpec) and word.text.upper() == "EXTENDS":
            spec = StructSpec(bases[0].start, spec.end, spec.members, spec.overlap, tuple(bases))
        else:
            self.report("S0101", word.start, word.end, f"{word.text} belongs to a block", "a structure EXTENDS another one")
        return TypeDecl(token.start, end.end if end else spec.end, self.declared(token), spec, None)

    # --- names and strings ---

    def type_name(self, token: Token) -> NamedType:
        return NamedType(token.start, token.end, token.text)

    def type_name_dotted(self, name: NamedType, dot: Token, token: Token) -> NamedType:
        return NamedType(name.start, token.end, f"{name.text}.{token.text}")

    def type_name_given(self, name: NamedType, opener: Token, values: list[Expr], closer: Token) -> NamedType:
        self.forms.append(Form("generic_constants", opener.start, closer.end, (
            "S0901", "generic constants behind the name of a block are of CODESYS", "give each size a block of its own")))
        return NamedType(name.start, closer.end, name.text, tuple(values))

    def named_type(self, name: NamedType) -> NamedType:
        kind = self.generic_types.get(name.text.upper())
        return NamedType(name.start, name.end, kind) if kind else name

    def string_plain(self, word: Token) -> StringSpec:
        return StringSpec(word.start, word.end, word.type == "WSTRING", None)

    def string_sized(self, word: Token, opener: Token, length: Expr, closer: Token) -> StringSpec:
        return StringSpec(word.start, closer.end, word.type == "WSTRING", length)

    # --- subranges and enumerations ---

    def subrange_spec(self, base: NamedType, opener: Token, low: Expr, sign: Token, high: Expr,
                      closer: Token) -> SubrangeSpec:
        return SubrangeSpec(base.start, closer.end, base, low, high)

    def enum_plain(self, opener: Token, members: list[EnumMember], closer: Token) -> EnumSpec:
        return EnumSpec(opener.start, closer.end, None, tuple(members))

    def based(self, base: NamedType, opener: Token, given: list[Argument], closer: Token) -> EnumSpec | ConstructedSpec:
        """`INT (A, B := 3)` is an enumeration; where other things stand in the parentheses, they are arguments."""
        members: list[EnumMember] = []
        for each in given:
            if each.kind == ":=" and each.name is not None and each.value is not None:
                members.append((each.name, each.value))
            elif each.kind == "" and isinstance(each.value, NameRef):
                members.append((Name(each.start, each.end, each.value.text), None))
            else:
                return ConstructedSpec(base.start, closer.end, base, None, tuple(given))
        return EnumSpec(base.start, closer.end, base, tuple(members))

    def constructed_plain(self, base: NamedType, opener: Token, closer: Token) -> ConstructedSpec:
        return ConstructedSpec(base.start, closer.end, base, None)

    def constructed_elements(self, base: NamedType, opener: Token, items: list[list[Item]], closer: Token) -> ConstructedSpec:
        return ConstructedSpec(base.start, closer.end, base, self.array_init(opener, items, closer))

    def enum_based_behind(self, opener: Token, members: list[EnumMember], closer: Token, base: NamedType) -> EnumSpec:
        return EnumSpec(opener.start, base.end, base, tuple(members))

    def enum_member(self, token: Token, sign: Token | None, value: Expr | None) -> EnumMember:
        return self.declared(token), value

    # --- composite types ---

    def array_spec(self, word: Token, opener: Token, dimensions: list[tuple[Expr, Expr] | None], closer: Token,
                   of: Token, element: TypeSpec) -> ArraySpec:
        return ArraySpec(word.start, element.end, tuple(dimensions), element)

    def dimension(self, low: Expr, sign: Token, high: Expr) -> tuple[Expr, Expr]:
        return low, high

    def dimension_open(self, star: Token) -> None:
        return None

    def struct_spec(self, word: Token, overlap: Token | None, members: list[VarDecl], end: Token) -> StructSpec:
        return StructSpec(word.start, end.end, tuple(members), overlap is not None)

    def union_spec(self, word: Token, members: list[VarDecl], end: Token) -> UnionSpec:
        return UnionSpec(word.start, end.end, tuple(members))

    def ref_to(self, word: Token, target: TypeSpec) -> RefSpec:
        return RefSpec(word.start, target.end, "REF_TO", target)

    def pointer_to(self, word: Token, to: Token, target: TypeSpec) -> RefSpec:
        return RefSpec(word.start, target.end, f"{word.text.upper()} TO", target)
