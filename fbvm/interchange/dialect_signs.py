"""Which dialect sources were written for, by signs in them: the tool that wrote a document, constructs that few tools take."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import NamedTuple

from fbvm.base.diagnostics import Source

FAMILIES = {"beremiz": "matiec", "codesys": "codesys", "codesys2": "codesys2", "twincat": "twincat"}
"""Families of tools that write documents, and the dialect of their programs."""
SIGNS = (
    ("twincat", r"\bTc[23]_\w+|\bT_MaxString\b|\bFB_(?:FormatString|File\w+|LocalSystemTime)\b|\bADSLOGSTR\b"),
    ("codesys twincat", r"\{attribute\b|\b__(?:ISVALIDREF|QUERYINTERFACE|QUERYPOINTER|TRY)\b|\bVAR_(?:STAT|INST)\b"
                        r"|\bAND_THEN\b|\bOR_ELSE\b"),
    ("codesys codesys2 twincat", r"\bPLC_PRG\b|\bSFC(?:Init|Reset|Pause)\b"),
    ("codesys", r"\bGVL\w*\s*\.|\bSMC_\w+|\bAXIS_REF_SM3\b|\bSysTimeRtc\w+"),
    ("codesys twincat strucpp", r"\b__(?:NEW|DELETE)\b|\bREFERENCE\s+TO\b"),
    ("codesys codesys2 twincat rusty strucpp", r"\bPOINTER\s+TO\b"),
    ("matiec", r"\bRESOURCE\s+(?:Res0|resource1)\s+ON\s+PLC\b|\bCONFIGURATION\s+Config0\b"
               r"|\b_TMP_\w+_OUT\b|\bCOMPUTE_FUNCTION_BLOCKS\b|\{\{|\{(?:disable|enable)\s+code\s+generation\}"
               r"|:\s*(?:HMI_[A-Z]+|python_(?:eval|poll)|LOGGER|RTC|SEMA)\s*;"),
    ("rusty", r"\{external\}|\{ref\}|@EXTERNAL\b|\bFUNCTION\s+\w+\s*<|\b__\w+__ctor\b|(?::=|\(|,)\s*&\s*[A-Za-z_]|\.%X[A-Za-z_]"),
    ("strucpp", r"\bTEST\s+''|\bSETUP\b[\s\S]*\bEND_SETUP\b|\{external\s|\bTEST_PROGRAM\b"),
    ("omron", r"\b_s(?:AXIS|GROUP)_REF\b|\b_e(?:MC|AXIS)_\w+|\b_sSOCKET\b|\bSkt(?:TCP|UDP)\w+|\b_E(?:C|IP)_\w+"
              r"|\bGet1[mu]sCnt\b|\bAry(?:Move|SDCL|Search|Max|Min|ByteTo)\w*\b"),
)
"""Dialects, and patterns of what few but their tools take."""
COMMENTS = (("codesys2", r"\(\*\s*@(?:NESTEDCOMMENTS|PATH|OBJECTFLAGS|SYMFILEFLAGS|GLOBAL_VARIABLE_LIST)\b"),)
"""The same for comments, in which exports of CODESYS 2.3 keep what they know of an object."""
FILES = (
    ("codesys2", r"(?i)\.exp$"),
    ("matiec", r"(?:^|[/\\])pous[/\\](?:programs|functions|function-blocks)[/\\]"),
)
"""Dialects, and patterns of names of files: exports of CODESYS 2.3, folders of OpenPLC Editor."""
PREFERRED = ("codesys", "twincat", "codesys2", "matiec", "rusty", "strucpp", "omron")
"""Of dialects with as many signs the first one is taken."""
_COMMENTS = re.compile(r"(?s)//[^\n]*|\(\*.*?\*\)|(')(?:\$.|[^'$\n])*'")
_MAKERS = {"codesys2": "CODESYS 2.3", "matiec": "OpenPLC Editor"}


@dataclass(frozen=True)
class Guess:
    """The dialect that was chosen, and why, as a part of a sentence."""

    dialect: str
    because: str


class Sign(NamedTuple):
    """Something in the sources: of which dialects it is a sign, and the words for it."""

    dialects: frozenset[str]
    words: str


def guessed(families: Iterable[tuple[str, str]], sources: Iterable[Source]) -> Guess:
    """The dialect of some sources.  `families` are those of the documents that they come from, each with the reason; without
    any sign it is `standard`.

    Without a document it is the dialect of which most signs are; what is a sign of another one only is named as well."""
    for family, reason in families:
        if family in FAMILIES:
            return Guess(FAMILIES[family], reason)
    signs = [sign for source in sources for sign in _signs(source)]
    if not signs:
        return Guess("standard", "nothing shows the tool that the sources were written for")
    chosen = max(PREFERRED, key=lambda name: sum(name in sign.dialects for sign in signs))
    own = [sign for sign in signs if chosen in sign.dialects]
    first = min(own, key=lambda sign: len(sign.dialects))
    others = [sign for sign in signs if chosen not in sign.dialects]
    against = f"; but {others[0].words} is of {_named(others[0])}" if others else ""
    return Guess(chosen, f"there is {first.words}{against}")


def _named(sign: Sign) -> str:
    *names, last = (name for name in PREFERRED if name in sign.dialects)
    return f"{', '.join(names)} or {last}" if names else last


def _signs(source: Source) -> Iterator[Sign]:
    """What a source shows, each place of it."""
    text = _COMMENTS.sub(lambda found: "''" if found[1] else " ", source.text)
    for table, searched in ((SIGNS, text), (COMMENTS, source.text)):
        for names, pattern in table:
            for match in re.finditer(pattern, searched):
                yield Sign(frozenset(names.split()), f"`{' '.join(match[0].split())[:30]}` in {source.name}")
    for name, pattern in FILES:
        if re.search(pattern, source.name):
            yield Sign(frozenset((name,)), f"the file {source.name}, as {_MAKERS[name]} names it")
