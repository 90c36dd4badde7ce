"""Which dialect sources were written for, by signs in them: the tool that wrote a document, constructs that few tools take."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass

from fbvm.base.diagnostics import Source

FAMILIES = {"beremiz": "matiec", "codesys": "codesys", "twincat": "twincat"}
"""Families of tools that write documents, and the dialect of their programs."""
SIGNS = (
    ("twincat", r"\bTc[23]_\w+|\bT_MaxString\b|\bFB_(?:FormatString|File\w+|LocalSystemTime)\b|\bADSLOGSTR\b"),
    ("codesys", r"\{attribute\b|\bPOINTER\s+TO\b|\b__(?:NEW|DELETE|ISVALIDREF|QUERYINTERFACE|TRY)\b|\bVAR_STAT\b|\bANDN?_THEN\b"
                r"|\bGVL\w*\s*\.|\bPLC_PRG\b|\bSFC(?:Init|Reset|Pause)\b|\bSMC_\w+|\bAXIS_REF_SM3\b"),
    ("matiec", r"\bRESOURCE\s+(?:Res0|resource1)\s+ON\s+PLC\b|\bCONFIGURATION\s+Config0\b"
               r"|\b_TMP_\w+_OUT\b|\bCOMPUTE_FUNCTION_BLOCKS\b|\{\{"
               r"|:\s*(?:HMI_[A-Z]+|python_(?:eval|poll)|LOGGER|RTC|SEMA)\s*;"),
    ("rusty", r"\{external\}|\{ref\}|@EXTERNAL\b|\bFUNCTION\s+\w+\s*<|\b__\w+__ctor\b"),
    ("strucpp", r"\bTEST\s+''|\bSETUP\b[\s\S]*\bEND_SETUP\b|\{external\s"),
)
"""Dialects, and patterns of what few but their tools take; the first of several that are found alike often is taken."""
FILES = (
    ("codesys", r"(?i)\.exp$"),
    ("matiec", r"(?:^|[/\\])pous[/\\](?:programs|functions|function-blocks)[/\\]"),
)
"""Dialects, and patterns of names of files: exports of CODESYS 2.3, folders of OpenPLC Editor."""
_COMMENTS = re.compile(r"(?s)//[^\n]*|\(\*.*?\*\)|(')(?:\$.|[^'$\n])*'")


_MAKERS = {"codesys": "CODESYS 2.3", "matiec": "OpenPLC Editor"}


@dataclass(frozen=True)
class Guess:
    """The dialect that was chosen, and why, as a part of a sentence."""

    dialect: str
    because: str


def guessed(families: Iterable[tuple[str, str]], sources: Iterable[Source]) -> Guess:
    """The dialect of some sources.  `families` are those of the documents that they come from, each with the reason; without
    any sign it is `standard`."""
    for family, reason in families:
        if family in FAMILIES:
            return Guess(FAMILIES[family], reason)
    found: dict[str, list[str]] = {}
    for source in sources:
        text = _COMMENTS.sub(lambda found: "''" if found[1] else " ", source.text)
        for name, pattern in SIGNS:
            found.setdefault(name, []).extend(f"`{' '.join(match[0].split())[:30]}` in {source.name}"
                                              for match in re.finditer(pattern, text))
        for name, pattern in FILES:
            if re.search(pattern, source.name):
                found.setdefault(name, []).append(f"the file {source.name}, as {_MAKERS[name]} names it")
    name = max(found, key=lambda known: len(found[known]), default="")
    if not name or not found[name]:
        return Guess("standard", "nothing shows the tool that the sources were written for")
    return Guess(name, f"there is {found[name][0]}")
