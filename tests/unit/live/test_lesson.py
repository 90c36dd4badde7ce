"""A lesson beside its PLC: the prediction before the check, tries, and the solution."""

from __future__ import annotations

import pytest
from browsers import Page

from fbvm.live.lesson import TRIES, LiveLesson
from fbvm.live.messages import MessageError


@pytest.fixture
def taught() -> Page:
    page, answers = Page(), {"lamp": ""}

    def predict(values: dict[str, str]) -> str:
        answers.update(values)
        return "" if answers["lamp"] == "4" else "this is not what the program does"

    page.bench.lesson = LiveLesson("Lamp", "# Lamp", lambda: [("lamp", "Which scan?", answers["lamp"])], predict,
                                   lambda: ["stop stops the motor"], lambda: "lamp = 4")  # fmt: skip
    return page


def test_a_page_is_told_its_lesson(taught: Page) -> None:
    assert taught.done("hello", version=1)["lesson"] == {
        "title": "Lamp", "text": "# Lamp", "questions": [["lamp", "Which scan?", ""]], "predicted": False, "tries_left": TRIES}


def test_the_program_is_checked_when_the_prediction_is_right(taught: Page) -> None:
    assert "predict first" in taught.ask("check")["error"]
    assert taught.done("predict", names=["lamp"], values=[" "]) == {
        "mistake": "lamp is still empty; predict first", "tries_left": TRIES}, "empty is not wrong, and no try"
    assert taught.done("predict", names=["lamp"], values=["3"]) == {
        "mistake": "this is not what the program does", "tries_left": TRIES - 1}
    assert taught.done("predict", names=["lamp"], values=["4"])["mistake"] == ""
    assert taught.done("check") == {"mistakes": ["stop stops the motor"], "tries_left": TRIES - 2}


def test_answers_to_what_was_not_asked_are_refused(taught: Page) -> None:
    assert taught.ask("predict", names=["moon"], values=["3"])["error"] == "a prediction has one value for each of lamp"
    assert "error" in taught.ask("predict", names=["lamp"], values=[])


def test_a_page_without_a_lesson_says_so() -> None:
    page = Page()
    assert page.done("hello", version=1)["lesson"] is None
    assert "fbvm learn --live" in page.ask("solution")["error"]


def test_tries_are_counted_down_to_none_and_what_is_wrong_later_has_to_be_predicted_again() -> None:
    wrong, mistakes = ["wrong"], list[str]()
    made = LiveLesson("T", "# T", lambda: [("a", "?", ""), ("b", "?", "1")], lambda values: wrong[0] + values.get("b", ""),
                      lambda: mistakes, lambda: "s")  # fmt: skip
    for left in (TRIES - 1, TRIES - 2, 0, 0):
        assert made.take_prediction(["a", "b"], ["x", "!"]) == {"mistake": "wrong!", "tries_left": left}
    assert made.take_prediction(["b", "a"], ["x", " "]) == {"mistake": "a is still empty; predict first", "tries_left": 0}
    assert made.about() == {"title": "T", "text": "# T", "questions": [["a", "?", ""], ["b", "?", "1"]], "predicted": False,
                            "tries_left": 0} and made.tries == 4  # fmt: skip
    made.tries, wrong[0] = 0, ""
    assert made.take_prediction(["a"], ["4"]) == {"mistake": "", "tries_left": TRIES} and made.about()["predicted"] is True
    for said, left in (([], TRIES), (["one", "two"], TRIES - 1), (["one"], TRIES - 2)):
        mistakes[:] = said
        assert made.take_check() == {"mistakes": said, "tries_left": left}
    wrong[0] = "no"
    assert made.take_prediction(["a"], ["3"]) == {"mistake": "no", "tries_left": 0} and not made.is_predicted
    for names, values in ((["c"], ["1"]), (["a"], ["1", "2"]), (["a", "c"], ["1", "2"])):
        with pytest.raises(MessageError, match="a prediction has one value for each of a, b"):
            made.take_prediction(names, values)
    with pytest.raises(MessageError, match="predict first"):
        made.take_check()
