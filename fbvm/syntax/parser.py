"""Text to tree: `parse` is the front door of the Structured Text front end."""

from __future__ import annotations

from fbvm.base.diagnostics import Diagnostic, Source
from fbvm.syntax.automaton import Automaton, Mender
from fbvm.syntax.builder import Stop
from fbvm.syntax.lexer import Lexer
from fbvm.syntax.tree import SourceText
from fbvm.syntax.types import Types


def parse(source: Source) -> tuple[SourceText, list[Diagnostic]]:
    """The tree of a text and what is wrong with it, in the order of the text.

    Never raises for any text: what cannot be understood is left out of the tree and has a diagnostic."""
    builder = Types(source)
    lexer = Lexer(source.text, builder.report)
    automaton = Automaton(builder, lexer.tokens(), source.text)
    try:
        tree: SourceText = automaton.run(lambda stuck: _recovery(stuck, builder))
    except Stop:
        read = automaton.values[0] if automaton.values else []
        tree = SourceText(0, len(source.text), tuple(read))
    tree.pragmas = tuple(lexer.pragmas)
    return tree, sorted(builder.diagnostics, key=Diagnostic.order)


def _recovery(automaton: Automaton, builder: Types) -> Mender:
    """Who mends; loaded when there is something to mend."""
    from fbvm.syntax.recovery import Recovery

    return Recovery(automaton, builder)
