"""Colours for blocks of Structured Text (```iecst), which Pygments does not know."""

from __future__ import annotations

import re

from pygments.lexer import RegexLexer, bygroups, words
from pygments.token import Comment, Keyword, Name, Number, Operator, Punctuation, String, Text, Whitespace
from sphinx.application import Sphinx

DECLARATIONS = (
    "PROGRAM", "FUNCTION_BLOCK", "FUNCTION", "TYPE", "STRUCT", "VAR", "VAR_INPUT", "VAR_OUTPUT", "VAR_IN_OUT",
    "VAR_TEMP", "VAR_EXTERNAL", "VAR_GLOBAL", "VAR_CONFIG", "VAR_ACCESS", "CONFIGURATION", "RESOURCE", "TASK", "WITH",
    "CONSTANT", "RETAIN", "AT", "ARRAY", "OF", "REF_TO", "POINTER", "REFERENCE", "TO", "INITIAL_STEP", "STEP",
    "TRANSITION", "FROM", "ACTION", "NAMESPACE", "USING",
)  # fmt: skip
STATEMENTS = (
    "IF", "THEN", "ELSIF", "ELSE", "CASE", "FOR", "BY", "DO", "WHILE", "REPEAT", "UNTIL", "EXIT", "CONTINUE",
    "RETURN", "JMP", "ASSERT",
)  # fmt: skip
TYPES = (
    "BOOL", "BYTE", "WORD", "DWORD", "LWORD", "SINT", "INT", "DINT", "LINT", "USINT", "UINT", "UDINT", "ULINT",
    "REAL", "LREAL", "TIME", "LTIME", "DATE", "LDATE", "TOD", "LTOD", "TIME_OF_DAY", "DT", "LDT", "DATE_AND_TIME",
    "CHAR", "WCHAR", "STRING", "WSTRING",
)  # fmt: skip


class StructuredText(RegexLexer):
    """IEC 61131-3 Structured Text, with the rungs and steps that may stand in it."""

    name = "IEC 61131-3 Structured Text"
    aliases = ("iecst",)
    flags = re.IGNORECASE | re.MULTILINE
    tokens = {  # noqa: RUF012
        "root": [
            (r"\s+", Whitespace),
            (r"\(\*.*?\*\)|/\*.*?\*/|//.*?$", Comment),
            (r"\{.*?\}", Comment.Preproc),
            (r"'(?:\$.|[^'$])*'|\"(?:\$.|[^\"$])*\"", String),
            (r"(?:L?TIME|L?T|L?DATE|L?D|L?TOD|L?DT|DATE_AND_TIME|TIME_OF_DAY)#[\w.:+-]+", Number),
            (r"\b(?:\w+#)*\d[\d_]*(?:\.\d+)?(?:E[+-]?\d+)?\b|\b\d+#\w+", Number),
            (r"\bLADDER\b", Keyword.Declaration, "ladder"),
            (words(DECLARATIONS, r"\b(?:END_)?", r"\b"), Keyword.Declaration),
            (words(STATEMENTS, r"\b(?:END_)?", r"\b"), Keyword),
            (words(TYPES, r"\b", r"\b"), Keyword.Type),
            (r"\b(?:TRUE|FALSE|NULL)\b", Keyword.Constant),
            (r"\b(?:AND|OR|XOR|NOT|MOD)\b|:=|=>|<=|>=|<>|\*\*|[-+*/=<>&^]", Operator),
            (r"%\w+(?:\.\w+)*|\b(?:CIO|W|H|A|D|E\d*_?|T|C)\s?\d+(?:\.\d+)?\b", Name.Constant),
            (r"\w+(?=\()", Name.Function),
            (r"\w+", Name),
            (r"[()\[\],;:.#@|]", Punctuation),
            (r".", Text),
        ],
        "ladder": [
            (r"\bEND_LADDER\b", Keyword.Declaration, "#pop"),
            (r"^([^\S\n]*)(RUNG\b)(.*?)$", bygroups(Whitespace, Keyword.Declaration, Comment)),
            (r"^([^\S\n]*)([@%!]?[A-Z][A-Z0-9_]*)(?=\s)", bygroups(Whitespace, Keyword)),
            (r"[#&][\da-f]+\b", Number),
            (r"[^\S\n]+|\n", Whitespace),
            (r"[^\s#&]+|[#&]", Text),
        ],
    }


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the lexer under the name that follows the three backquotes."""
    app.add_lexer("iecst", StructuredText)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
