"""Object code of shipped blocks: linked into a program it is what lowering with that program gives, and keeps nothing of it."""

from __future__ import annotations

import gc
import random
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest
from depth import times

from fbvm.base.data import data_folder
from fbvm.base.dialects import DIALECTS
from fbvm.check.symbols.facts import Facts, Pou, Variable
from fbvm.check.symbols.symbol_table import SymbolTable
from fbvm.code.compiler import Compilation, compile_text
from fbvm.code.store import object_code
from fbvm.code.store.encoding import encode

EXAMPLES = Path(__file__).parents[3] / "examples"
SHIPPED = sorted({path.stem: path for path in data_folder("fblib").rglob("*.st")
                  if "FUNCTION_BLOCK" in path.read_text(encoding="utf-8")})


@pytest.fixture(autouse=True)
def nothing_is_known(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each test begins as a process does."""
    monkeypatch.setattr(object_code, "_libraries", {})


def kept(dialect: str = "standard") -> object_code.ObjectLibrary:
    return object_code.library_for(DIALECTS[dialect])


def whole(made: Compilation) -> tuple[bytes, str, list[str]]:
    """All that an image holds, its hash, and what is said about the program."""
    assert made.image is not None, [diagnostic.render() for diagnostic in made.diagnostics]
    return encode(made.image), made.image.fingerprint, [diagnostic.render() for diagnostic in made.diagnostics]


def by_itself(text: str, dialect: str = "standard") -> tuple[bytes, str, list[str]]:
    """What becomes of a program for which nothing is known."""
    known = dict(object_code._libraries)
    object_code._libraries.clear()
    made = compile_text(text, dialect=dialect)
    object_code._libraries.clear()
    object_code._libraries.update(known)
    return whole(made)


def with_blocks(names: list[str], more: str = "", front: str = "") -> str:
    declared = "".join(f"    b{number} : {name};\n" for number, name in enumerate(names))
    return f"{front}PROGRAM Main\nVAR\n    {more}\n{declared}END_VAR\n    ;\nEND_PROGRAM\n"


@cache
def everywhere() -> list[str]:
    """The shipped blocks that there are in every dialect."""
    return [name for name in SHIPPED if compile_text(with_blocks([name])).image]


def mixed(chance: random.Random) -> str:
    """A program with some shipped blocks, among variables and areas that move all that lies behind them."""
    front = chance.choice(["", "VAR_GLOBAL g : ARRAY [1..37] OF LINT; END_VAR\n", "FUNCTION_BLOCK Own\nVAR d : TON; END_VAR\n"
                           "d(IN := TRUE, PT := T#1s);\nEND_FUNCTION_BLOCK\n"])
    more = chance.choice(["", "pad : ARRAY [0..4_999] OF DINT;", "e AT E1_10 : INT; o : CTUD;", "s : STRING[77];"])
    return with_blocks(chance.sample(everywhere(), chance.randint(1, 4)), more, front)


@pytest.mark.slow
def test_programs_of_the_examples_are_the_same_in_any_order() -> None:
    texts = [path.read_text(encoding="utf-8") for path in sorted(EXAMPLES.glob("**/*.st"))]
    texts = [text for text in texts if compile_text(text).image is not None]
    assert len(texts) >= 20
    alone = {text: by_itself(text) for text in texts}
    for seed in range(times(1)):
        random.Random(seed).shuffle(texts)
        for text in texts:
            assert whole(compile_text(text)) == alone[text]
    assert len(kept().code) > 30


@pytest.mark.slow
@pytest.mark.parametrize("dialect", DIALECTS)
def test_every_shipped_block_is_the_same_linked_in_any_company(dialect: str) -> None:
    """All of them in the standard dialect, of each other one every so many, so that the others together have them all."""
    others = list(DIALECTS)[1:]
    assert next(iter(DIALECTS)) == "standard"
    usable = [name for name in SHIPPED if compile_text(with_blocks([name]), dialect=dialect).image]
    for name in usable if dialect == "standard" else usable[others.index(dialect) :: len(others)]:
        text = with_blocks([name], "pad : ARRAY [0..9] OF INT; first : R_TRIG;")
        alone = by_itself(text, dialect)
        assert [whole(compile_text(text, dialect=dialect)) for _ in range(3)] == [alone] * 3, name
    assert len(kept(dialect).code) >= len(usable) * 3 // 4 // (1 if dialect == "standard" else len(others))


def programs(count: int) -> Iterator[str]:
    chance = random.Random(1)
    return (mixed(chance) for _ in range(count))


@pytest.mark.slow
def test_programs_that_mix_blocks_are_the_same_as_alone() -> None:
    for text in programs(times(30)):
        compile_text(text)
    for text in programs(times(30)):
        assert whole(compile_text(text)) == by_itself(text), text
    assert kept().code


def test_libraries_that_only_the_user_has_and_what_stands_before_them_are_asked_first(tmp_path: Path) -> None:
    text = "PROGRAM Main\nVAR d : TON; END_VAR\nd(IN := TRUE, PT := T#1s);\nEND_PROGRAM\n"
    shipped = [whole(compile_text(text)) for _ in range(3)][-1]
    (tmp_path / "TON.st").write_text("FUNCTION_BLOCK TON\nVAR_INPUT IN : BOOL; PT : TIME; END_VAR\nVAR n : INT; END_VAR\n"
                                     "n := n + 1;\nEND_FUNCTION_BLOCK\n", encoding="utf-8")
    own = whole(compile_text(text, libraries=[tmp_path]))
    shadowed = compile_text((tmp_path / "TON.st").read_text(encoding="utf-8") + text).image
    assert own != shipped and shadowed is not None and len(shadowed.bodies) == 2
    assert whole(compile_text(text)) == shipped
    (tmp_path / "TON.st").write_text("FUNCTION_BLOCK TON\nVAR_INPUT IN : BOOL; PT : TIME; END_VAR\nVAR n : DINT; END_VAR\n"
                                     "n := n + 2;\nEND_FUNCTION_BLOCK\n", encoding="utf-8")
    assert whole(compile_text(text, libraries=[tmp_path])) not in (own, shipped)


def test_programs_with_errors_and_warnings_hear_the_same() -> None:
    text = "PROGRAM Main\nVAR d : TON; n, n2 : INT; END_VAR\nd(IN := 5, PT := T#1s, ZZ := 1);\nn := D;\nEND_PROGRAM\n"
    warned = "PROGRAM Main\nVAR d : TON; n, n2 : INT; END_VAR\nd(IN := TRUE, PT := T#1s);\nn := 1;\nEND_PROGRAM\n"
    said = [[d.render() for d in compile_text(text).diagnostics] for _ in range(2)]
    heard = [whole(compile_text(warned)) for _ in range(4)]
    assert [d.render() for d in compile_text(text).diagnostics] == said[0] == said[1] != []
    assert heard == [heard[0]] * 4 and heard[0][2]


@pytest.mark.slow
def test_references_into_a_linked_block_and_a_block_that_programs_complete() -> None:
    refers = ("PROGRAM Main\nVAR d : TON; p : POINTER TO TIME; END_VAR\nd(IN := TRUE, PT := T#1s);\np := ADR(d.ET);\n"
              "IF p^ > T#0s THEN p := 0; END_IF;\nEND_PROGRAM\n")
    completes = ("CONFIGURATION c\nRESOURCE r ON cpu\nTASK t(PRIORITY := 1);\nPROGRAM m WITH t : Main;\nEND_RESOURCE\n"
                 "VAR_CONFIG r.m.x AT %IX0.0 : BOOL; END_VAR\nEND_CONFIGURATION\n"
                 "PROGRAM Main\nVAR x AT %I* : BOOL; d : TON; END_VAR\nd(IN := x, PT := T#1s);\nEND_PROGRAM\n")
    for text in (refers, completes):
        alone = by_itself(text)
        assert [whole(compile_text(text)) for _ in range(4)] == [alone] * 4


@pytest.mark.slow
def test_what_is_kept_leads_to_no_program() -> None:
    for text in (with_blocks(["MBP_MSTR", "TON"]), (EXAMPLES / "client.st").read_text(encoding="utf-8")):
        for _ in range(2):
            compile_text(text)
    seen: set[int] = set()
    left: list[object] = [*kept().code.values(), *kept().dependencies.values()]
    assert len(left) > 10
    while left:
        item = left.pop()
        if id(item) not in seen and not isinstance(item, type) and not callable(item):
            seen.add(id(item))
            assert not isinstance(item, Pou | Variable | SymbolTable | Facts)
            left += gc.get_referents(item)


@pytest.mark.slow
def test_what_is_kept_has_an_end() -> None:
    sizes = []
    for number in range(3):
        for name in ("CTUD", "MTCP_ETN_Fn03"):
            for size in range(3):
                compile_text(with_blocks([name], f"pad{number} : ARRAY [0..{size}] OF INT;"))
        sizes.append((len(kept().code), len(kept().dependencies), len(kept().seen)))
    assert sizes[0] == sizes[1] == sizes[2] and sizes[0][0] > 5


def test_a_library_sees_no_enumeration_of_the_user(tmp_path: Path) -> None:
    for folder, name, text in (("kinds", "Light", "TYPE Light : (Off, Red); END_TYPE\n"),
                               ("blocks", "Lamp", "FUNCTION_BLOCK Lamp\nVAR l : Light; n : INT; END_VAR\n"
                                "IF l = Red THEN n := 1; END_IF;\nn := Light_To(Red);\nEND_FUNCTION_BLOCK\n"),
                               ("blocks", "Light_To", "FUNCTION Light_To : INT\nVAR_INPUT a : Light; END_VAR\n"
                                "IF Red = a THEN Light_To := 1; END_IF;\nEND_FUNCTION\n")):
        (tmp_path / folder).mkdir(exist_ok=True)
        (tmp_path / folder / f"{name}.st").write_text(text, encoding="utf-8")
    text = "TYPE Wine : (White, Red); END_TYPE\nPROGRAM Main\nVAR l : Lamp; w : Wine; END_VAR\nl(); w := White;\nEND_PROGRAM\n"
    made = compile_text(text, libraries=[tmp_path])
    assert made.errors == []
