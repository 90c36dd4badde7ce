"""Text to tree: `parse` is the front door of the Structured Text front end."""

from __future__ import annotations

from contextlib import suppress

from fbvm.base.diagnostics import Diagnostic, Source
from fbvm.syntax.automaton import Automaton
from fbvm.syntax.lexer import Lexer
from fbvm.syntax.recovery import Recovery, Stop
from fbvm.syntax.tree import SourceText
from fbvm.syntax.types import Types


def parse(source: Source) -> tuple[SourceText, list[Diagnostic]]:
    """The tree of a text and what is wrong with it, in the order of the text.

    Never raises for any text: what cannot be understood is left out of the tree and has a diagnostic."""
    builder = Types(source)
    lexer = Lexer(source.text, builder.report)
    automaton = Automaton(builder, lexer.tokens())
    automaton.text = source.text
    tree = SourceText(0, len(source.text), ())
    with suppress(Stop):
        tree = automaton.run(Recovery(automaton, builder))
    tree.pragmas = tuple(lexer.pragmas)
    return tree, sorted(builder.diagnostics, key=Diagnostic.order)
