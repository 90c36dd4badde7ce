"""Formats source text: `formatted` returns the canonical text of a program, which means the same.

Every name is spelt as where it is declared first; words of the language and names of elementary types are in capitals.
Literals, comments and pragmas keep their text.  A line end inside a statement is kept only if a comment needs it, an empty
line between statements only once.
"""

from __future__ import annotations

from fbvm.base.diagnostics import Diagnostic, Source, errors
from fbvm.syntax.formatter.comments import Comments
from fbvm.syntax.formatter.declarations import DeclarationLayout
from fbvm.syntax.formatter.layout import Doc, Printer
from fbvm.syntax.formatter.names import NOTHING, Outside, Spelling
from fbvm.syntax.ladder.notation import Notation
from fbvm.syntax.parser import parse
from fbvm.syntax.st.automaton import Automaton, ErrorRecovery
from fbvm.syntax.st.lexer import Lexer

REFUSED = {"S0901"}
"""Errors of texts that are parsed all the same, and can therefore be formatted."""


def formatted(source: Source, outside: Outside = NOTHING, notation: Notation | None = None) -> tuple[str, list[Diagnostic]]:
    """The canonical text, with the line ends of the source; and the syntax errors.  With any of them it is the text of the
    source, untouched.  `outside` knows the spelling of names that the text does not declare; `notation` is how rungs are
    written, None if each stays as it is."""
    tree, diagnostics = parse(source)
    wrong = [d for d in errors(diagnostics) if d.code not in REFUSED]
    if wrong:
        return source.text, wrong
    windows = source.text.count("\r\n") * 2 > source.text.count("\n")
    if "\r\n" in source.text:
        source = Source(source.name, source.text.replace("\r\n", "\n"), source.library)
        tree, _ = parse(source)
    text = _printed(source, Spelling(tree, outside), notation)
    return text.replace("\n", "\r\n") if windows else text, []


def _printed(source: Source, spelling: Spelling, notation: Notation | None) -> str:
    """The canonical text of a text without errors."""
    tokens = list(Lexer(source.text, lambda *message: None).tokens())
    comments = Comments(source.text, tokens)
    layout = DeclarationLayout(comments, spelling)
    layout.notation = notation
    doc: Doc = Automaton(layout, iter(tokens), source.text).run(_no_mender)
    return Printer(comments).print(doc)


def _no_mender(stuck: Automaton) -> ErrorRecovery:
    raise AssertionError("a text without errors needs no repair")
