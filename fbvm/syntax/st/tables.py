"""The grammar as tables: LALR(1) actions, rules and terminals, made from `grammar/*.lark` by lark and cached as JSON.

lark is only imported when no valid cache file is found.  The driver that runs the tables is in `automaton`.
"""

from __future__ import annotations

import json
import os
import sys
from functools import cache
from importlib.util import find_spec
from typing import Any, NamedTuple

from fbvm.base.cache import Cache, name_of
from fbvm.base.data import data_folder

FILES = {"st": ("common.lark", "declarations.lark", "st.lark"), "mnemonics": ("mnemonics.lark",),
         "il": ("common.lark", "declarations.lark", "st.lark", "il.lark")}
"""The files of each language."""
STORED = Cache("grammars", b"fbvm grammar 3\n", 16 << 20)

STARTS = {"st": "source_text", "mnemonics": "line", "il": "operand_list"}


class Rule(NamedTuple):
    """One alternative of a production.

    `action` names the builder's function; None for a rule that hands on its only child.  `places` tells for each
    argument of the function which child it is, None for an optional part that is absent; None if they are all children
    in order."""

    origin: str
    size: int
    action: str | None
    places: tuple[int | None, ...] | None


class Terminal(NamedTuple):
    """A terminal: its pattern is a `literal` text or a regular expression; a `reserved` word is never a name."""

    name: str
    pattern: str
    ignore_case: bool
    literal: bool
    reserved: bool


class Tables(NamedTuple):
    """`actions[state][symbol]`: a state to shift to (>= 0), or ~index of the rule to reduce by."""

    start: int
    end: int
    actions: tuple[dict[str, int], ...]
    rules: tuple[Rule, ...]
    terminals: tuple[Terminal, ...]


@cache
def tables(language: str) -> Tables:
    """The tables of a language's grammar, from the cache if it holds them."""
    text = grammar_text(language)
    name = name_of((sys.version, _lark_identity(), language, text))
    try:
        return _from_plain(json.loads(STORED.read(name) or b""))
    except (ValueError, TypeError, LookupError, AttributeError, RecursionError):
        plain = compile_grammar(text, STARTS[language])
    STORED.write(name, json.dumps(plain, separators=(",", ":")).encode())
    return _from_plain(plain)


def grammar_text(language: str) -> str:
    """The grammar of a language as one text."""
    return "\n".join((data_folder("grammar") / name).read_text(encoding="utf-8") for name in FILES[language])


def _lark_identity() -> str:
    """Which lark is installed, without importing it."""
    spec = find_spec("lark")
    if spec is None or spec.origin is None:
        return ""
    status = os.stat(spec.origin)
    return f"{spec.origin} {status.st_size} {status.st_mtime_ns}"


def _from_plain(plain: dict[str, Any]) -> Tables:
    rules = tuple(Rule(str(o), int(n), a, None if p is None else tuple(p)) for o, n, a, p in plain["rules"])
    actions: tuple[dict[str, int], ...] = tuple(plain["actions"])
    states, count = len(actions), len(rules)
    if not all(-count <= act < states for row in actions for act in row.values()):
        raise ValueError("an action points outside the tables")
    return Tables(plain["start"], plain["end"], actions, rules, tuple(Terminal(*row) for row in plain["terminals"]))


def compile_grammar(text: str, start: str) -> dict[str, Any]:
    """Run lark over the grammar's text and take its tables as plain lists and dictionaries."""
    from lark import Lark
    from lark.grammar import Rule as LarkRule
    from lark.lexer import Lexer, TerminalDef

    class NoLexer(Lexer):
        """Ours is `lexer`; lark need not prepare one."""

        __future_interface__ = 2

        def __init__(self, conf: Any) -> None:
            pass

        def lex(self, lexer_state: Any, parser_state: Any) -> Any:
            return iter(())

    lark = Lark(text, parser="lalr", lexer=NoLexer, start=start, keep_all_tokens=True, maybe_placeholders=True)
    data, memo = lark.memo_serialize([TerminalDef, LarkRule])
    terminals = [
        [t.name, t.pattern.value, "i" in t.pattern.flags, t.pattern.type == "str", t.priority > 0]
        for t in lark.terminals]
    return {**_numbered(data["parser"]["parser"], memo, start), "terminals": terminals}


def _numbered(table: dict[str, Any], memo: dict[int, Any], start: str) -> dict[str, Any]:
    """lark's states and rules with numbers that are the same on every run: states as they are met from the start, in
    the order of their symbols."""
    names = table["tokens"]
    used = {arg["@"] for row in table["states"].values() for kind, arg in row.values() if kind}
    rules = sorted(used, key=lambda number: _rule_key(memo[number]))
    rule_numbers = {number: index for index, number in enumerate(rules)}
    todo = [table["start_states"][start]]
    order = {todo[0]: 0}
    for state in todo:
        for _, (kind, arg) in sorted((names[token], act) for token, act in table["states"][state].items() if not act[0]):
            if kind == 0 and arg not in order:
                order[arg] = len(order)
                todo.append(arg)
    actions: list[dict[str, int]] = []
    for state in todo:
        acts = sorted((names[token], act) for token, act in table["states"][state].items() if not act[0])
        reduces = [(names[token], act) for token, act in table["states"][state].items() if act[0]]
        row = {name: order[arg] for name, (_, arg) in acts}
        row |= {name: ~rule_numbers[arg["@"]] for name, (_, arg) in sorted(reduces, key=lambda item: item[0])}
        actions.append(row)
    return {"start": 0, "end": order[table["end_states"][start]], "actions": actions,
            "rules": [_plain_rule(memo[number]) for number in rules]}


def _rule_key(rule: dict[str, Any]) -> tuple[Any, ...]:
    return (rule["origin"]["name"], [symbol["name"] for symbol in rule["expansion"]], rule["alias"] or "",
            list(rule["options"]["empty_indices"]))


def _plain_rule(rule: dict[str, Any]) -> list[Any]:
    options, size = rule["options"], len(rule["expansion"])
    action = rule["alias"] or rule["origin"]["name"]
    if options["expand1"] and size == 1 and not rule["alias"]:
        action = None
    empty = options["empty_indices"]
    places: list[int | None] | None = None
    if any(empty):
        places, child = [], 0
        for absent in empty:
            places.append(None if absent else child)
            child += not absent
    return [rule["origin"]["name"], size, action, places]
