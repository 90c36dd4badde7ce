"""Images of the corpus as bytes and back: nothing of them is lost."""

from __future__ import annotations

from dataclasses import replace

import pytest
from lang_corpus import programs

from fbvm.code.compiler import compile_text
from fbvm.code.store.encoding import decode, encode

EACH = 6
"""Every sixth program is taken: all would take long."""


@pytest.mark.slow
def test_programs_come_back_as_they_were() -> None:
    compared = 0
    for program in list(programs())[::EACH]:
        image = compile_text(program.text, program.name).image
        if image is not None:
            back = decode(encode(image))
            assert replace(back, bodies=()) == replace(image, bodies=()), program
            for one, other in zip(back.bodies, image.bodies, strict=True):  # by their text: NaN is not equal to NaN
                assert repr(one.code) == repr(other.code), program
            assert encode(back) == encode(image), program
            compared += 1
    assert compared > 50
