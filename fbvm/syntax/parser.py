"""Text to tree: `parse` is the front door of the Structured Text front end."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from itertools import chain, islice

from fbvm.base.diagnostics import Diagnostic, Source
from fbvm.syntax.pous import SourceBuilder
from fbvm.syntax.st.automaton import Automaton, ErrorRecovery
from fbvm.syntax.st.builder import Stop
from fbvm.syntax.st.lexer import Lexer, Token
from fbvm.syntax.tree import SourceText


def parse(source: Source, reached: Callable[[int], None] | None = None) -> tuple[SourceText, list[Diagnostic]]:
    """The tree of a text and what is wrong with it, in the order of the text.

    Never raises for any text: what cannot be understood is left out of the tree and has a diagnostic.  Tells now and then
    which character it has `reached`."""
    if xml := _XML.match(source.text):
        hint = _TWINCAT_HINT if _TWINCAT.search(source.text) else _PLCOPEN_HINT
        return SourceText(0, len(source.text), ()), [
            Diagnostic("S0101", source, xml.start(1), xml.end(1), "this is XML, no source", hint)]  # fmt: skip
    builder = SourceBuilder(source)
    lexer = Lexer(source.text, builder.report)
    tokens = lexer.tokens()
    automaton = Automaton(builder, _counted(tokens, reached) if reached else tokens, source.text)
    try:
        tree: SourceText = automaton.run(lambda stuck: _recovery(stuck, builder))
    except Stop:
        read = automaton.values[0] if automaton.values else []
        tree = SourceText(0, len(source.text), tuple(read))
    tree.pragmas, tree.forms = tuple(lexer.pragmas), (*lexer.forms, *builder.forms)
    return tree, sorted(builder.diagnostics, key=Diagnostic.order)


_XML = re.compile(r"\s*(<\?xml\b|<project\b)")
"""What exports of PLC tools begin with."""
_TWINCAT = re.compile(r"<TcPlcObject\b|http://schemas\.microsoft\.com/developer/msbuild/")
"""What stands in objects and projects of TwinCAT."""
_PLCOPEN_HINT = "`fbvm import FILE.xml -o DIR` makes sources of a project in PLCopen XML"
_TWINCAT_HINT = "it is of TwinCAT: check, run, test and export read .TcPOU, .plcproj and their like; its own editor formats them"


def _counted(tokens: Iterator[Token], reached: Callable[[int], None]) -> Iterator[Token]:
    """The tokens, and a word to the caller at some of them."""
    return chain.from_iterable(_portions(tokens, reached))


def _portions(tokens: Iterator[Token], reached: Callable[[int], None]) -> Iterator[Iterator[Token]]:
    for first in tokens:
        reached(first.start)
        yield chain((first,), islice(tokens, OFTEN - 1))


OFTEN = 5000
"""Tokens between two words to the caller: a tenth of a second."""


def _recovery(automaton: Automaton, builder: SourceBuilder) -> ErrorRecovery:
    """Who repairs; loaded when there is something to repair."""
    from fbvm.syntax.recovery.recovery import Recovery

    return Recovery(automaton, builder)
