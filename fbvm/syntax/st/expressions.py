"""Builds the nodes of expressions: literals, variables, operators, calls (grammar/st.lark, 7.3.2)."""

from __future__ import annotations

import re
from collections.abc import Callable

from fbvm.syntax.st import literals
from fbvm.syntax.st.builder import Builder
from fbvm.syntax.st.lexer import Token
from fbvm.syntax.tree import (
    Argument,
    ArrayInit,
    Binary,
    Call,
    Deref,
    Direct,
    EnumLiteral,
    Expr,
    Form,
    Index,
    Literal,
    Member,
    Name,
    NameRef,
    NullLiteral,
    Part,
    StructInit,
    TypeOperand,
    TypeSpec,
    Unary,
)

Item = tuple[Expr | None, Expr | None]
"""Repetition and value of an element of an array."""
REPEATED_LIMIT = 1_000_000
"""Most values that one `n(a, b)` of an array may stand for."""
Decode = Callable[[], literals.Decoded]

_BIT_OF_WORD = re.compile(r"%([IQM])X?(\d{1,9})\.(8|9|1[0-5])", re.I)
"""An address with a bit that a byte does not have."""


class Expressions(Builder):
    """The functions of the rules of expressions."""

    def number(self, token: Token) -> Literal:
        return self._decoded(token, lambda: literals.number(token.text), ("int", 0, None))

    def string_literal(self, token: Token) -> Literal:
        wide = token.text[0] == '"'
        kind = "wstring" if wide else "string"
        if not wide and not token.text.isascii() and any(ord(c) > 255 for c in token.text):
            self.report("S0192", token.start, token.end, "characters beyond Latin-1 become several bytes (UTF-8) each",
                        "LEN and the functions with positions count bytes")
        return self._decoded(token, lambda: literals.text_literal(token.text), (kind, "", None))

    def truth(self, token: Token) -> Literal:
        return Literal(token.start, token.end, "bool", token.type == "TRUE", None, token.text)

    def null(self, token: Token) -> NullLiteral:
        return NullLiteral(token.start, token.end)

    def typed_literal(self, token: Token) -> Literal | EnumLiteral:
        prefix, rest = token.text.split("#", 1)
        if prefix.upper() in literals.ELEMENTARY:
            return self._decoded(token, lambda: literals.typed(prefix.upper(), rest), ("int", 0, None))
        middle = token.start + len(prefix)
        if not rest[:1].isalpha() and rest[:1] != "_":
            self.report("S0105", token.start, token.end,
                        f"`{prefix}` is no elementary type, so no value can stand behind `#`",
                        f"`{prefix}#` wants the name of a member of an enumeration")
        return EnumLiteral(token.start, token.end, Name(token.start, middle, prefix), Name(middle + 1, token.end, rest))

    def _decoded(self, token: Token, decode: Decode, instead: literals.Decoded) -> Literal:
        try:
            kind, value, type_name = decode()
        except literals.OutOfRange as error:
            self.report("S0108", token.start, token.end, *error.args)
            kind, value, type_name = literals.WRONG, *instead[1:]
        except literals.Malformed as error:
            code = "S0104" if instead[0] in ("string", "wstring") else "S0105"
            self.report(code, token.start, token.end, *error.args)
            kind, value, type_name = literals.WRONG, *instead[1:]
        return Literal(token.start, token.end, kind, value, type_name, token.text)

    def address_of(self, sign: Token, operand: Expr) -> Call:
        """`&x`, which means REF(x)."""
        self.forms.append(Form("ampersand_refers", sign.start, operand.end, (
            "S0101", "an expression expected, but `&` found", "write REF(x), or ADR(x) for a pointer")))
        node = Call(sign.start, operand.end, NameRef(sign.start, sign.end, "REF"),
                    (Argument(operand.start, operand.end, "", None, operand),))
        self.deepen(node, operand)
        return node

    # --- variables ---

    def name_ref(self, token: Token) -> NameRef:
        return NameRef(token.start, token.end, token.text)

    def direct(self, token: Token) -> Direct:
        self.note_bit_of_word(token)
        return Direct(token.start, token.end, token.text)

    def note_bit_of_word(self, token: Token) -> None:
        """Note the address of a bit above 7, `%IX0.15`, which is one of a word."""
        if found := _BIT_OF_WORD.fullmatch(token.text):
            area, word, bit = found[1].upper(), int(found[2]), int(found[3])
            meant = f"%{area}X{2 * word + bit // 8}.{bit % 8}"
            self.forms.append(Form("bits_of_words", token.start, token.end, (
                "S0601", f"bit {bit} does not exist; bits are 0 to 7", f"bit {bit} of a word is {meant}"), (
                "S0193", f"{token.text} is {meant}: words are counted behind X in this project", f"write %{area}W{word}.{bit}")))

    def member(self, of: Expr, dot: Token, token: Token) -> Member:
        node = Member(of.start, token.end, of, Name(token.start, token.end, token.text))
        self.deepen(node, of)
        return node

    def member_literal(self, of: Expr, dot: Token, token: Token) -> Expr:
        """`Plant.Color#Red`, which means Plant.Color.Red."""
        literal = self.typed_literal(token)
        if not isinstance(literal, EnumLiteral):
            self.report("S0101", token.start, token.end, f"a name expected, but `{token.text}` found", "")
            return of
        kind = Member(of.start, literal.type_name.end, of, literal.type_name)
        self.deepen(kind, of)
        node = Member(of.start, token.end, kind, literal.member)
        self.deepen(node, kind)
        return node

    def part(self, of: Expr, token: Token) -> Part:
        text = token.text[1:].lstrip()
        size, digits = (text[1].upper(), text[2:]) if text[0] == "%" else ("X", text)
        if not digits.isdecimal() or len(digits) > 9:
            self.report("S0105", token.start, token.end, f"`{token.text}` is no part of a variable",
                        "write the number of the bit, .3 or .%X3, or of the byte or word, .%B1 or .%W1")
            digits = "0"
        node = Part(of.start, token.end, of, size, int(digits))
        self.deepen(node, of)
        return node

    def index(self, of: Expr, opener: Token, subscripts: list[Expr], closer: Token) -> Index:
        node = Index(of.start, closer.end, of, tuple(subscripts))
        self.deepen(node, of, max(subscripts, key=self.depth))
        return node

    def deref(self, of: Expr, caret: Token) -> Deref:
        node = Deref(of.start, caret.end, of)
        self.deepen(node, of)
        return node

    def call(self, callee: Expr, opener: Token, arguments: list[Argument] | None, closer: Token) -> Call:
        node = Call(callee.start, closer.end, callee, tuple(arguments or ()))
        values = [a.value for a in node.arguments if a.value is not None]
        self.deepen(node, callee, max(values, key=self.depth, default=None))
        return node

    def argument_positional(self, value: Expr) -> Argument:
        return Argument(value.start, value.end, "", None, value)

    def argument_type(self, spec: TypeSpec) -> Argument:
        return Argument(spec.start, spec.end, "", None, TypeOperand(spec.start, spec.end, spec))

    def argument_named(self, token: Token, sign: Token, value: Expr | None) -> Argument:
        return Argument(token.start, value.end if value else sign.end, sign.text, self.name(token), value)

    def argument_negated(self, word: Token, token: Token, sign: Token, value: Expr | None) -> Argument:
        return Argument(word.start, value.end if value else sign.end, sign.text, self.name(token), value, True)

    def depth(self, node: Expr) -> int:
        """Depth of an expression under construction."""
        return self.depths.get(node, 1)

    # --- operators ---

    def parenthesized(self, opener: Token, inner: Expr, closer: Token) -> Expr:
        return inner

    def unary(self, operator: Token, operand: Expr) -> Unary:
        node = Unary(operator.start, operand.end, operator.text.upper(), operand)
        self.deepen(node, operand)
        return node

    def binary(self, left: Expr, operator: Token, right: Expr) -> Binary:
        op = "AND" if operator.type == "AMPERSAND" else operator.text.upper()
        if op in ("AND_THEN", "OR_ELSE"):
            self.forms.append(Form("short_circuit_words", operator.start, operator.end, (
                "S0195", f"{op} is CODESYS's: the standard and other compilers do not have it",
                f"write {op[:3].strip('_')}, or IF in an IF")))
        node = Binary(left.start, right.end, op, left, right, operator.start)
        self.deepen(node, left, right)
        return node

    # --- arrays and structures ---

    def array_init(self, opener: Token, items: list[list[Item]] | None, closer: Token) -> ArrayInit:
        flat = tuple(item for group in items or () for item in group)
        node = ArrayInit(opener.start, closer.end, flat)
        self.deepen_over(node, [value for _, value in flat if value is not None])
        return node

    def array_item(self, value: Expr) -> list[Item]:
        return [(None, value)]

    def array_repeated(self, count: Token, opener: Token, items: list[list[Item]] | None, closer: Token) -> list[Item]:
        """`3(0)`; with several values in the parentheses they are written out, since each repetition has one value.

        A repetition in a repetition, `2(3(0), 1)`, is written out in the same way."""
        times = self.number(count)
        group = [item for each in items or () for item in each]
        nested = any(repetition is not None for repetition, _ in group)
        if nested:
            self.forms.append(Form("nested_repetitions", count.start, closer.end, (
                "S0101", "a repetition stands in a repetition",
                "write the elements of a row in brackets, 20([5(1)]), or multiply: 100(1)")))
        elif len(group) < 2:
            return [(times, group[0][1] if group else None)]
        if not isinstance(times.value, int) or times.value * len(group) > REPEATED_LIMIT:
            self.report("S0108", times.start, times.end,
                        f"`{count.text}` repetitions of {len(group)} values are too many")
            return []
        return group * times.value

    def struct_init(self, opener: Token, fields: list[tuple[Name, Expr]], closer: Token) -> StructInit:
        node = StructInit(opener.start, closer.end, tuple(fields))
        self.deepen_over(node, [value for _, value in fields])
        return node

    def assigned_condition(self, name: Token, sign: Token, value: Expr) -> StructInit:
        """`b := a` where a condition stands is `(b := a)`."""
        node = StructInit(name.start, value.end, ((Name(name.start, name.end, name.text), value),))
        self.deepen(node, value)
        return node

    def empty_struct(self, opener: Token, closer: Token) -> StructInit:
        self.forms.append(Form("empty_structures", opener.start, closer.end, (
            "S0101", "() is no initial value", "leave it out: what has no initial value begins with that of its type")))
        return StructInit(opener.start, closer.end, ())

    def deepen_over(self, node: Expr, values: list[Expr]) -> None:
        """Note the depth of a new node over any number of parts."""
        deepest = max(values, key=self.depth, default=None)
        if deepest is not None:
            self.deepen(node, deepest)

    def struct_field(self, token: Token, sign: Token, value: Expr) -> tuple[Name, Expr]:
        return self.name(token), value
