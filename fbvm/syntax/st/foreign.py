"""Operators, signs and literals of other languages that are met in Structured Text, and what to write for them."""

from __future__ import annotations

import re

OPERATORS = {"==": ("EQUAL", "=", "`=` compares"), "!=": ("UNEQUAL", "<>", "write `<>`"),
             "&&": ("AND", "AND", "write AND"), "||": ("OR", "OR", "write OR"), "|": ("OR", "OR", "write OR"),
             "!": ("NOT", "NOT", "write NOT, or `<>` for unequal"), "~": ("NOT", "NOT", "write NOT"),
             "=:": ("ASSIGN", ":=", "write `:=`"), "=<": ("LESS_EQUAL", "<=", "write `<=`"),
             "><": ("UNEQUAL", "<>", "write `<>`"), ":==": ("ASSIGN", ":=", "write `:=`"),
             "> =": ("GREATER_EQUAL", ">=", "`>=` is one sign, without a space inside"),
             "< =": ("LESS_EQUAL", "<=", "`<=` is one sign, without a space inside"),
             "< >": ("UNEQUAL", "<>", "`<>` is one sign, without a space inside"),
             "->": ("DOT", ".", "write `^.` behind a reference"),
             "<<": ("STAR", "*", "write SHL(value, count)"), ">>": ("STAR", "*", "write SHR(value, count)"),
             "++": ("", "", "write `x := x + 1`"), "--": ("", "", "write `x := x - 1`"),
             "%": ("MOD", "MOD", "write MOD for the remainder; an address has letters and digits behind `%`")}
"""Operators of other languages -> our terminal, its text, and advice."""

SIGNS = tuple((re.compile(shape), advice) for shape, advice in (
    (r"\?", "write SEL(condition, if_false, if_true)"),
    (r"#[ \t]*(?:include|define|if|ifdef|ifndef|pragma)\b", "there is no preprocessor: declare constants in VAR CONSTANT"),
    (r"(?<!\.)%[A-Za-z]", "an address has a number behind its letters: %QX0.0, %MW10"),
    (r"(?<=\w)\$", "a name has letters, digits and `_`"),
    (r"#[A-Za-z_]", "`#` in front of a name is Siemens SCL: leave it out"),
    (r"(?i)@EXTERNAL\b", "RuSTy now writes the pragma {external}, in front of a POU whose body is in another language"),
    (r"#", "a type stands in front of `#`, and no space"),
    (r"\\", "the escape in a string is `$`")))
"""Characters with which no token begins, and a hint."""
LITERALS = tuple((re.compile(row[0]), *row[1:]) for row in (
    (r"#([0-9.]+(?:[mun]s|[dhms]))\b", "TYPED_LITERAL", r"T#\1", r"`\g<0>` is no duration", r"a duration is written T#\1"),
    (r"(?<!\w)[#$]([0-9A-Fa-f]+)\b", "NUMBER", r"16#\1", r"`\g<0>` is no number", r"hexadecimal digits are written 16#\1"),
    (r"[\u2018-\u201f`\u00b4]([^'\u2018-\u201f`\u00b4\r\n]*)[\u2018-\u201f`\u00b4]", "STRING_LITERAL", r"'\1'",
     "the quotes are not straight", r"a text is written '\1'"),
    (r"#[ \t]+[A-Za-z][^\r\n]*", "", "", "`#` begins no comment", "a comment begins with // or stands in (* *)")))
"""Forms of other languages: pattern, our terminal and its text, message, hint."""
