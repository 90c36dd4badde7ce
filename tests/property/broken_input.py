"""Damaged files of all kinds, given to all verbs that read such files: diagnostics and exit statuses come out, in time.

`python tests/property/broken_input.py 100000` tries that many; a number behind it is the first seed."""

from __future__ import annotations

import faulthandler
import json
import os
import shutil
import struct
import sys
import tempfile
import time
import traceback
import zlib
from collections.abc import Callable
from contextlib import chdir
from functools import cache
from io import BytesIO
from pathlib import Path
from random import Random

if __name__ == "__main__":
    TESTS = Path(__file__).parents[1]
    sys.path[:0] = [str(TESTS.parent), *(str(TESTS / name) for name in ("unit/rigs", "twincat", "cx"))]

import broken_seeds
import codesys2_files
import twincat_files
from click.testing import CliRunner
from cx_text import Cxt
from old_files import write_old_journal, write_old_trace

from fbvm import Depth
from fbvm.cli.main import main
from fbvm.interchange.cx.compression import compress, decompress
from fbvm.live.drawings import DrawingError, clean_drawing
from fbvm.record.recording import container

ROOT = Path(__file__).parents[2]
LIMIT_S = 2.0
"""Processor time that a verb may take for a small file."""
HANGS_S = 300
"""Real time after which the search ends, for all verbs on one file: nothing is expected to wait, but the machine may be busy."""
STATUSES = range(6)
GOOD_CX = Cxt(
    symbols=["start,0.00,BOOL,,,", "level,D100,INT,,,"], local=["lamp,W1.00,BOOL,,,"],
    sections=[("Sec1", ["# first\nLD start\nOR lamp\nOUT lamp", "LD lamp\nTIM 0 #10\nMOV &5 level"])],
).bytes()  # fmt: skip
COUNTER = """PROGRAM Main VAR n : INT; d : INT := 3; s : STRING := 'x'; END_VAR n := n + 6 / d;
%D5 := INT_TO_WORD(n); END_PROGRAM
"""
LIST = """FUNCTION_BLOCK Lamp VAR_INPUT a, b : BOOL; END_VAR VAR_OUTPUT q : BOOL; END_VAR
LD a
ANDN ( b
OR q
)
ST q
END_FUNCTION_BLOCK
PROGRAM Main VAR n : INT; t : TON; lamp1 : Lamp; END_VAR
LD n
ADD 1
ST n
GT 100
JMPCN on
LD 0
ST n
on: CAL t(IN := TRUE, PT := T#1s)
CAL lamp1(a := t.Q, b := FALSE)
END_PROGRAM
"""
OBJECTS = """INTERFACE IRun METHOD Step : INT VAR_INPUT delta : INT; END_VAR END_METHOD END_INTERFACE
FUNCTION_BLOCK ABSTRACT Base IMPLEMENTS IRun
VAR PROTECTED n : INT; END_VAR
METHOD PUBLIC ABSTRACT Step : INT VAR_INPUT delta : INT; END_VAR END_METHOD
PROPERTY PUBLIC Count : INT GET Count := n; END_GET SET n := Count; END_SET END_PROPERTY
END_FUNCTION_BLOCK
FUNCTION_BLOCK FINAL Own EXTENDS Base
METHOD PUBLIC OVERRIDE Step : INT VAR_INPUT delta : INT; END_VAR n := n + delta; Step := n; END_METHOD
END_FUNCTION_BLOCK
PROGRAM Main VAR own1 : Own; run : IRun; n : INT; END_VAR
run := own1; IF run <> NULL THEN n := run.Step(delta := 2); END_IF; own1.Count := own1.Count + 1;
END_PROGRAM
"""
PROPERTY = b"Main.n < 100 AND Main.d = 3 OR D5 <> 16#12 AND NOT (Main.s = 'x')"
PROJECT = """[run]
net = "loop"
for = "20ms"

[[server]]
address = "192.168.250.1:502"

[[fault]]
kind = "slow"
latency = "5ms"

[plc.One]
sources = ["counter.st"]
cycle = "10ms"
count = 2
watch = ["Main.n"]

[[plc.One.unit]]
type = "ETN21"
address = "192.168.250.21"

[[plc.One.set]]
name = "Main.d"
value = 2
at = "10ms"
"""
LIBRARY = """title = "Blocks"
globals = ["lists.st"]
spaces = ["Own"]
writes = ["A"]

[mailbox]
area = "OWN"
head = 16
slots = 2
slot = 8

[pins]
Twice = { IN = "x" }
"""
WORDS = (
    "(*", "*)", "//", "'", '"', "$", "{", "}", "(", ")", "[", "]", ";", ":", ":=", "..", "=>", "#", "16#", "T#", "%", "%MW1",
    "D5", "E0_1", "CIO 1.00", "AT", "VAR", "END_VAR", "IF", "END_IF", "FOR", "CASE", "END_CASE", "ARRAY[1..2] OF", "STRUCT",
    "LADDER", "END_LADDER", "LD", "OUT", "AND", "TON", "INITIAL_STEP", "STEP", "TRANSITION", "ACTION", "END_ACTION", "PROGRAM",
    "END_PROGRAM", "FUNCTION", "END_FUNCTION", "TYPE", "END_TYPE", "CONFIGURATION", "RESOURCE", "TASK", "REF_TO", "STRING[3]",
    "|", "|--[ ]--", "--( )--|", "+--", "-1", "0", "1e999", "9" * 5000, "(" * 200, "[" * 200, "-" * 200, "\0", "\x1a", "\r", "\n",
    "\t", "\u00e4", "\U0001f600", "\u2028", "\ufeff", "null", "true", "{}", "[]", '"x"', "1.5", "-0", "<!--", "&amp;", "</pou>",
    "<variable/>", "[[", "]]", "=", "nan", "inf", ",", "{{script}}",
)  # fmt: skip
TEXT = "<text>"
"""Stands for what is in the file, as an argument."""
DRAWING = "<drawing>"
"""Stands for what `fbvm live` does with a drawing."""
KINDS: dict[str, tuple[str, tuple[tuple[str, ...], ...]]] = {
    "source": ("text.st", (
        ("check",), ("check", "--json"), ("fmt", "--diff"), ("fmt",), ("list",), ("list", "--native"), ("ladder",), ("sfc",),
        ("ladder", "--svg", "out.svg"), ("sfc", "--svg", "out.svg"), ("export", "-o", "out.xml"),
        ("run", "--scans", "3", "--ladder", "0..2", "--sfc", "0..2", "--chart", "D5"), ("step",),
        ("diff", "use.st"), ("prove", "--no-trap", "--scans", "3", "--budget", "500ms"),
        ("run", "--scans", "3", "--trace", "out.fbtrace", "--depth", "statements", "--html", "out.html",
         "--journal", "out.journal"),
    )),
    "codesys": ("text.st", (
        ("check", "--dialect", "codesys2"), ("check", "--dialect", "codesys"), ("fmt", "--diff"), ("export", "-o", "out.xml"),
        ("run", "--dialect", "codesys", "--heap", "1000", "--scans", "3"), ("run", "--dialect", "codesys2", "--scans", "3"),
        ("list", "--native", "--dialect", "codesys"),
        ("prove", "--dialect", "codesys", "--no-trap", "--scans", "3", "--budget", "500ms"),
    )),
    "export2": ("text.exp", (
        ("check",), ("check", "--json"), ("import", "-o", "out", "--force"), ("run", "--scans", "3"), ("fmt", "--diff"),
        ("ladder",), ("export", "-o", "out.xml"), ("diff", "use.st"),
    )),
    "library2": ("own.lib", (("import", "-o", "out", "--force"), ("check",), ("list",), ("run", "--scans", "3"))),
    "system": ("Plant.tsproj", (("check",), ("run", "--scans", "3"))),
    "campaign": ("campaign.toml", (("campaign", "--jobs", "1", "--runs", "1", "--for", "50ms", "--fresh", "--out", "out"),)),
    "xml": ("text.xml", (("import", "-o", "out", "--force"), ("import", "-o", "out", "--force", "--json"), ("check",))),
    "project": ("fbvm.toml", (  # a good one may ask for hours, and gets them
        ("check",), ("check", "--json"), ("run", "--for", "1s"), ("run", "--for", "1s", "--json"), ("step",),
    )),
    "library": ("own/library.toml", (("check", "use.st", "--library", "own", "--"),)),
    "journal": ("run.journal", (("replay",), ("replay", "--show", "Main.n", "--json"))),
    "recording": ("run.fbtrace", (
        ("chart",), ("table", "", "Main.n"), ("why", "Main.n"), ("convert", "", "out.html"), ("convert", "", "out.pcapng"),
        ("replay",), ("replay", "--show", "Main.n", "--json"),
    )),
    "trace": ("run.fbtrace", (
        ("chart",), ("table", "", "Main.n"), ("why", "Main.n"), ("convert", "", "out.html"), ("convert", "", "out.svg"),
        ("convert", "", "out.csv"), ("convert", "", "out.vcd"), ("convert", "", "out.pcapng"),
    )),
    "csv": ("run.csv", (("convert", "", "back.fbtrace"),)),
    "object": ("POUs/FB_Counter.TcPOU", (
        ("check",), ("check", "--json"), ("list",), ("fmt", "--diff"), ("export", "-o", "out.xml"), ("run", "--scans", "3"),
        ("run", "Plant.plcproj", "--scans", "3", "--"),
    )),
    "plcproj": ("Plant.plcproj", (("check",), ("check", "--json"), ("run", "--scans", "3"), ("diff", "use.st"))),
    "cx": ("text.cxt", (
        ("import", "-o", "out", "--force"), ("import", "-o", "out", "--force", "--json"), ("diff", "", "good.cxt"),
        ("export", "counter.st", "-o", "out.cxt", "--into"),
    )),
    "cxp": ("text.cxp", (
        ("import", "-o", "out", "--force"), ("check",), ("list",), ("diff", "", "good.cxt"), ("run", "--scans", "3"),
        ("export", "counter.st", "-o", "out.cxp", "--into"),
    )),
    "drawing": ("text.svg", ((DRAWING,),)),
    "property": ("property.txt", (
        ("prove", "counter.st", "--scans", "5", "--budget", "500ms", "--never", TEXT, "--"),
        ("prove", "counter.st", "--scans", "5", "--budget", "500ms", "--assume", TEXT, "--no-trap", "--"),
        ("prove", "counter.st", "--scans", "5", "--budget", "500ms", "--no-trap", "--free", TEXT, "--"),
        ("run", "counter.st", "--scans", "5", "--until", TEXT, "--"),
    )),
    "image": ("image.json", (("serve", "--bind", "nobody", "--image"),)),
}  # fmt: skip
"""By kind of file: its name, and the verbs that read it; "" stands for the name, which is the last argument without one."""


@cache
def seeds() -> dict[str, list[bytes]]:
    """Good files of each kind."""
    examples = [ROOT / "examples" / f"{name}.st" for name in ("demo", "ladder", "sfc", "client")]
    sources = [*examples, *sorted((ROOT / "examples/classics").glob("*.st")), *sorted((ROOT / "fblib/iec").rglob("*.st")),
               *sorted((ROOT / "tests/golden").rglob("*.st"))]
    found = {"source": [path.read_bytes() for path in sources] + [text.encode() for text in (COUNTER, LIST, OBJECTS)],
             "xml": [path.read_bytes() for path in sorted((ROOT / "tests/plcopen/documents").glob("*.xml"))],
             "project": [text.encode() for text in (PROJECT, broken_seeds.PICTURES)],
             "library": [LIBRARY.encode()], "property": [PROPERTY], "cx": [GOOD_CX],
             "cxp": [compress(GOOD_CX)], "drawing": [(ROOT / "examples/conveyor/conveyor.svg").read_bytes()],
             "object": [text.encode() for name, text in twincat_files.FILES.items() if "POUs" in name]
                       + broken_seeds.drawn_objects(),
             "codesys": [text.encode() for text in (broken_seeds.HEAP, broken_seeds.FILES)], "export2": broken_seeds.exports(),
             "library2": [codesys2_files.LIBRARY], "system": [broken_seeds.SYSTEM.encode()],
             "campaign": [broken_seeds.CAMPAIGN.encode()],
             "plcproj": [twincat_files.PROJECT.encode()]}  # fmt: skip
    with tempfile.TemporaryDirectory() as folder, chdir(folder):
        Path("counter.st").write_text(COUNTER, encoding="utf-8")
        for path in (*examples[1:3], Path("counter.st")):
            verb("export", str(path), "-o", f"{path.stem}.xml")
            found["xml"].append(Path(f"{path.stem}.xml").read_bytes())
        verb("run", "counter.st", "--scans", "5", "--trace", "a.fbtrace", "--depth", "statements", "--set", "D7=3@20ms")
        verb("run", str(examples[0]), "--map", "192.168.250.1:502=peer", "--scans", "60", "--trace", "b.fbtrace", "--verify")
        verb("convert", "a.fbtrace", "a.csv")
        Path("heap.st").write_text(broken_seeds.HEAP, encoding="utf-8")
        verb("run", "heap.st", "--dialect", "codesys", "--scans", "5", "--trace", "c.fbtrace", "--depth", "statements")
        found["recording"] = [Path(name).read_bytes() for name in ("a.fbtrace", "b.fbtrace", "c.fbtrace")]
        demo = examples[0].read_text(encoding="utf-8")
        for name, text, scans in (("a", COUNTER, 5), ("b", demo, 60)):
            write_old_journal(f"{name}.journal", text, f"{name}.st", scans)
            write_old_trace(f"{name}.trace", text, f"{name}.st", scans, Depth.STATEMENTS)
        found["journal"] = [Path(name).read_bytes() for name in ("a.journal", "b.journal")]
        found["trace"] = [Path(name).read_bytes() for name in ("a.trace", "b.trace")]
        found["csv"] = [Path("a.csv").read_bytes()]
    found["image"] = [json.dumps({"spaces": {"CIO": [1, 2, 3], "D": [65535, 0, 7]}}).encode()]
    return found


def verb(*arguments: str, stdin: str = "step\nstep\nback\nprint D5\n") -> tuple[int, str]:
    """The exit status and the output of `fbvm` with these arguments.  Raises what the verb lets through."""
    if arguments[0] == DRAWING:
        try:
            return 0, clean_drawing(Path(arguments[1]).read_bytes())[0]
        except DrawingError as error:
            return 3, str(error)
    result = CliRunner().invoke(main, arguments, input=stdin, catch_exceptions=False)
    return result.exit_code, result.output


# --- damage -----------------------------------------------------------------------------------------------------------


def _damaged(random: Random, data: bytes, other: bytes) -> bytes:
    """The bytes with a few pieces left out, doubled, moved, put in from another file or from WORDS."""
    for _ in range(random.choice((1, 1, 1, 2, 3, 6))):
        start = random.randrange(len(data) + 1)
        end = min(len(data), start + random.choice((0, 1, 1, 2, 5, 20, 100, 1000)))
        piece = data[start:end]
        there = random.randrange(len(other) + 1)
        middle = random.choice((
            b"", piece * 2, other[there : there + random.choice((1, 10, 100, 1000))], random.randbytes(random.choice((1, 2))),
            random.choice(WORDS).encode(), random.choice(WORDS).encode(), b" " + random.choice(WORDS).encode() + b" ",
        ))  # fmt: skip
        data = data[:start] + middle + data[end:]
        if random.random() < 0.02:
            data = data[: random.randrange(len(data) + 1)]
    return data


def _unpacked(data: bytes) -> list[tuple[tuple[int, int, int], bytes]]:
    """The chunks of a trace: kind, first scan and number of scans, and the payload."""
    found, at = [], 8
    while at < len(data):
        kind, size, _, first, scans = struct.unpack_from("<BIIQI", data, at)
        found.append(((kind, first, scans), zlib.decompress(data[at + 21 : at + 21 + size])))
        at += 21 + size
    return found


def _packed(chunks: list[tuple[tuple[int, int, int], bytes]]) -> bytes:
    text = b"FBVMTRC1"
    for (kind, first, scans), payload in chunks:
        packed = zlib.compress(payload, 1)
        text += struct.pack("<BIIQI", kind, len(packed), zlib.crc32(packed), first, scans) + packed
    return text


def _damaged_trace(random: Random, data: bytes, other: bytes) -> bytes:
    """A trace with damage inside of a chunk, which the checksum does not show, or anywhere."""
    if random.random() < 0.3:
        return _damaged(random, data, other)
    chunks = _unpacked(data)
    at = random.randrange(len(chunks))
    chunks[at] = chunks[at][0], _damaged(random, chunks[at][1], random.choice(_unpacked(other))[1])
    return _packed(chunks)


def _damaged_recording(random: Random, data: bytes, other: bytes) -> bytes:
    """A recording with damage inside of a block, which the checksum does not show, or anywhere."""
    if random.random() < 0.3:
        return _damaged(random, data, other)
    blocks, others = _blocks(data), _blocks(other)
    at = random.randrange(len(blocks))
    blocks[at] = blocks[at][0], _damaged(random, blocks[at][1], random.choice(others)[1])
    file = BytesIO()
    file.write(container.MAGIC)
    for head, payload in blocks:
        container.write_block(file, head.kind, payload, head.plc, head.first, head.scans)
    return file.getvalue()


def _damaged_project(random: Random, data: bytes, other: bytes) -> bytes:
    """A compressed project with damage in what is compressed, or anywhere."""
    if random.random() < 0.3:
        return _damaged(random, data, other)
    return compress(_damaged(random, decompress(data), decompress(other)))


def _blocks(data: bytes) -> list[tuple[container.BlockHead, bytes]]:
    file = BytesIO(data)
    file.seek(len(container.MAGIC))
    return [(head, container.read_block(file, head)) for head in list(container.heads(file))]


DAMAGE: dict[str, Callable[[Random, bytes, bytes], bytes]] = {
    "trace": _damaged_trace, "recording": _damaged_recording, "cxp": _damaged_project,
}  # fmt: skip


def broken(random: Random) -> tuple[str, bytes]:
    """A damaged file: its kind and its bytes."""
    kind = random.choice(("source", "source", "source", *KINDS))
    damage = DAMAGE.get(kind, _damaged)
    return kind, damage(random, random.choice(seeds()[kind]), random.choice(seeds()[kind]))


# --- the verbs --------------------------------------------------------------------------------------------------------


def furnish() -> None:
    """Puts into the current folder what files of the kinds name."""
    Path("own").mkdir(exist_ok=True)
    Path("counter.st").write_text(COUNTER, encoding="utf-8")
    Path("use.st").write_text("PROGRAM Main VAR t : Twice; END_VAR t(IN := 1); END_PROGRAM\n", encoding="utf-8")
    Path("own/Twice.st").write_text("FUNCTION_BLOCK Twice VAR_INPUT x : INT; END_VAR\nEND_FUNCTION_BLOCK\n", encoding="utf-8")
    Path("good.cxt").write_bytes(GOOD_CX)
    Path("tank.svg").write_bytes((ROOT / "examples/tank/tank.svg").read_bytes())
    twincat_files.write_project(Path())
    Path("own/lists.st").write_text("VAR_GLOBAL own_list : INT; END_VAR\n", encoding="utf-8")


def complaint(kind: str, data: bytes) -> str | None:
    """What a verb does wrong with a file in the current folder: a traceback, a wrong status or too much time; None if all
    verbs behave."""
    name, verbs = KINDS[kind]
    for given in verbs:
        Path(name).write_bytes(data)
        arguments = [argument or name for argument in given] if "" in given else [*given, name]
        if given[-1] == "--":
            text = data.decode(errors="replace").replace("\0", "")
            arguments = [text if argument == TEXT else argument for argument in given[:-1]]
        began_s = time.process_time()
        try:
            status, output = verb(*arguments)
        except Exception:
            return f"fbvm {' '.join(arguments)}\n{traceback.format_exc(limit=-6)[-3000:]}"
        took_s = time.process_time() - began_s
        if status not in STATUSES or (status and not output.strip()):
            return f"fbvm {' '.join(arguments)}: status {status}, output {output[-300:]!r}"
        if took_s > LIMIT_S:
            return f"fbvm {' '.join(arguments)}: {took_s:.1f} s"
    return None


def search(first: int, count: int, keep: Path) -> int:
    """Tries files of many seeds, prints complaints and keeps the files; returns the number of complaints."""
    said: dict[str, int] = {}
    with tempfile.TemporaryDirectory() as folder, chdir(folder):
        os.environ["FBVM_CACHE"] = folder
        furnish()
        seeds()
        for number in range(first, first + count):
            faulthandler.dump_traceback_later(HANGS_S, exit=True)
            kind, data = broken(Random(number))
            if wrong := complaint(kind, data):
                last = wrong.strip().splitlines()[-2 if "Error" in wrong else -1]
                said[last] = said.get(last, 0) + 1
                if said[last] == 1:
                    print(f"--- seed {number}, {kind}\n{wrong}", flush=True)
                    keep.mkdir(exist_ok=True)
                    (keep / f"{number}.{kind}").write_bytes(data)
            shutil.rmtree("out", ignore_errors=True)
    faulthandler.cancel_dump_traceback_later()
    return sum(said.values())


if __name__ == "__main__":
    wanted = [int(text) for text in sys.argv[1:]] or [1000]
    found = search(wanted[1] if len(wanted) > 1 else 0, wanted[0], Path(tempfile.gettempdir()) / "broken_input")
    print(f"{wanted[0]} files, {found} complaints")
    sys.exit(bool(found))
