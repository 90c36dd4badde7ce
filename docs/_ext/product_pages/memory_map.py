"""The page of memory: areas, condition flags, words in which the CPU unit tells programs about time, mailboxes."""

from __future__ import annotations

import re
import tomllib

from fbvm.base.areas import AREAS, E_BANKS, E_PLC_ADDRESS, E_WORDS, FLAG_AREAS, PLC_ADDRESSES, PORTABLE_AREAS, SLOTS_OFFSET, Area
from fbvm.machine.scan.clock_words import ALWAYS_ON, PERIODS_NS
from fbvm.syntax.ladder.operands import SYMBOLS
from fbvm.watch.values import show_time
from product_pages.libraries import FBLIB, names
from product_pages.markdown import HOUSE, code, page, sentences_of_constants, table

NAME = "reference/memory"
FLAGS = HOUSE / "fblib/omron/ladder/CX_Flags.st"
HEADS = ("area", "what it is", "first", "last", "kept over a warm start", "programs write", "byte in the flat memory")


def pages() -> dict[str, str]:
    """The page of all memory."""
    return {NAME: page(
        "# Memory",
        "A PLC has one flat memory. Omron areas count 16-bit words, flag areas bits, the portable areas `%I`, `%Q` and `%M` "
        "bytes. An address names a word (`D100`, `CIO 1519`), a bit of one (`CIO 1519.03`, `W0.15`) or, in a portable area, a "
        "size and a number (`%MW10` is bytes 20 and 21, `%IX0.3` a bit). Variables are bound to addresses with `AT`; "
        "tests and commands read and write the same addresses.",
        "## Areas", table(HEADS, [_area(area) for area in AREAS.values()]),
        f"Slots of globals and instances begin at byte {SLOTS_OFFSET}, mailboxes follow, then those E banks that a program or a "
        f"unit names: `E0_0` to `E{E_BANKS - 1:X}_{E_WORDS - 1}`, {E_BANKS} banks of {E_WORDS} words, kept over a warm start. "
        "A program writes `E0_100`; `E0:100` means the same.",
        "## Condition flags", table(("flag", "address", ""), _flags()),
        "## Clock pulses", "A pulse is OFF for the first half of its period and ON for the second (assumed).",
        table(("address", "symbol", "period"), _pulses()),
        "## Words of the auxiliary area", table(("address", ""), _words()),
        "## PLC memory addresses", "Index registers point to words by these numbers (assumed).",
        table(("area", "first address"), [*((code(area), code(f"{at:05X} hex")) for area, at in PLC_ADDRESSES.items()),
                                          (code("E0"), code(f"{E_PLC_ADDRESS:05X} hex"))]),
        "## Mailboxes", "A unit whose vendor documents no words between block and port brings an area of its own. Blocks of its "
        "library bind the words with `AT`, and each instance claims a slot at its first call.",
        table(("library", "area", "words of the head", "slots", "words of a slot"), _mailboxes()),
    )}  # fmt: skip


def _area(area: Area) -> tuple[str, ...]:
    is_portable, last = area.name in PORTABLE_AREAS, area.count - 1
    first, final = (f"%{area.name}B0", f"%{area.name}B{last}") if is_portable else (f"{area.name}0", f"{area.name}{last}")
    written = "all" if not area.read_only else "none" if area.read_only >= area.count else f"from {area.name}{area.read_only} on"
    what = "a bit each" if area.name in FLAG_AREAS else "bytes" if is_portable else "words"
    return (code(area.name), f"{area.title} ({what})", code(first), code(final), "yes" if area.retained else "no", written,
            str(area.offset))  # fmt: skip


def _flags() -> list[tuple[str, str, str]]:
    """The condition flags as the library of instructions declares them."""
    found = re.findall(r"^\s*(P_\w+)\s+AT (CF\d+)\s*: BOOL;(?:\s*//\s*(.*))?$", FLAGS.read_text(encoding="utf-8"), re.M)
    return [(code(name), code(address), said) for name, address, said in found]


def _pulses() -> list[tuple[str, str, str]]:
    symbols = {address: symbol for symbol, address in SYMBOLS.items()}
    rows = [(f"CF{number}", "always ON" if number == ALWAYS_ON else show_time(period_ns).removeprefix("T#"))
            for number, period_ns in sorted(PERIODS_NS.items(), key=lambda row: row[1])]  # fmt: skip
    return [(code(address), code(symbols[address]), said) for address, said in rows]


def _words() -> list[tuple[str, str]]:
    """Words and bits of A: of the scan by the modules that write them, of failures by the library that does."""
    modules = [HOUSE / "fbvm/machine/scan" / name for name in ("clock_words.py", "watch_cycle.py")]
    rows = []
    for said in (sentence for module in modules for sentence in sentences_of_constants(module)):
        if found := re.match(r"(A\d+(?:\.\d+)?(?: and A\d+)?)(?:: |, | )(.*)", said):
            rows.append((code(found[1]), found[2][:1].upper() + found[2][1:]))
    comments = re.findall(r"AT (A[\d.]+)\s*: [^;]*;\s*(?://\s*(.*))?$", FLAGS.read_text(encoding="utf-8"), re.M)
    rows += [(code(address), f"Written by instructions of ladder{': ' if said else ''}{said}.") for address, said in comments]
    return sorted(rows, key=lambda row: [int(part) for part in re.findall(r"\d+", row[0])])


def _mailboxes() -> list[tuple[str, ...]]:
    rows = []
    for name in names():
        about = tomllib.loads((FBLIB / name / "library.toml").read_text(encoding="utf-8"))
        if mailbox := about.get("mailbox"):
            sizes = (str(mailbox[key]) for key in ("head", "slots", "slot"))
            rows.append((f"[{name}](libraries/{name.replace('/', '-')}.md)", code(mailbox["area"]), *sizes))
    return rows
