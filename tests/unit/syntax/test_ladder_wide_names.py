"""Names in characters that terminals show two columns wide: rails stand in one column, and drawings are read by what one sees."""

from __future__ import annotations

import re

from fbvm import compile_text
from fbvm.base.diagnostics import Source
from fbvm.record.draw.ladder_svg import ladder_svg
from fbvm.record.draw.ladder_text import ladder_surface, ladder_text
from fbvm.syntax.formatter.formatter import formatted
from fbvm.syntax.ladder.drawing.cells import columns, text_of
from fbvm.syntax.ladder.notation import Form, Notation

NAMES = "VAR 가스공급, B, 펌프 : BOOL; 水位, Q : WORD; END_VAR"
STEPS = f"""PROGRAM Main
{NAMES}
LADDER
    RUNG 0
        LD      가스공급
        OR      B
        AND=    水位 #5
        OUT     펌프
        MOV     水位 Q
    SECTION 빈
    SECTION 끝
    RUNG 1
        LD      펌프
        OUT     B
END_LADDER
END_PROGRAM
"""


def rewritten(text: str, form: Form) -> str:
    """A source with its rungs in another notation."""
    made, wrong = formatted(Source("main.st", text), "", Notation(form))
    assert not wrong, [str(found) for found in wrong]
    return made


def code_of(text: str) -> list[list[tuple[str, tuple[str, ...]]]]:
    """Instructions and operands of each rung."""
    compilation = compile_text(text)
    assert compilation.image, [str(found) for found in compilation.diagnostics]
    return [[(mnemonic, operands) for _, _, mnemonic, operands in rung.steps] for rung in compilation.image.rungs]


def test_right_rails_stand_in_one_column() -> None:
    image = compile_text(STEPS).image
    assert image
    rows = ladder_text(image.rungs[0], 60)[1:]
    assert {columns(row) for row in rows if row[:1] in "│├"} == {columns(rows[0])}
    assert any("水位 #5" in row for row in rows)


def test_a_drawing_says_the_same_as_its_instructions_and_they_as_the_drawing() -> None:
    drawing = rewritten(STEPS, Form.DRAWING)
    rows = [line for line in drawing.splitlines() if line.lstrip()[:1] in ("│", "├")]
    assert len(rows) > 8
    assert code_of(drawing) == code_of(STEPS)
    assert rewritten(drawing, Form.DRAWING) == drawing
    assert code_of(rewritten(drawing, Form.MNEMONICS)) == code_of(STEPS)
    assert drawing.count("RUNG") == 2, "a section without rungs gets none"


def test_a_mistake_behind_a_wide_name_is_found_at_its_place() -> None:
    text = rewritten(STEPS, Form.DRAWING)
    assert "가스공급" in next(line for line in text.splitlines() if "水位 #5" in line)
    text = text.replace("水位 #5", "모름 #5", 1)
    [found] = [found for found in compile_text(text).diagnostics if found.code == "S0201"]
    assert found.source.text[found.start : found.end] == "모름"


def test_a_picture_has_the_name_and_its_width() -> None:
    image = compile_text(STEPS).image
    assert image
    svg = ladder_svg([ladder_surface(image.rungs[0], 60)])
    [length] = re.findall(r'textLength="(\d+)"[^>]*>가스공급<', svg)
    [narrow] = re.findall(r'textLength="(\d+)"[^>]*>B<', svg)
    assert int(length) == 8 * int(narrow)
    assert text_of(svg) == svg
