import pytest

from fbvm.testing.lesson import predicted


def pressed(main, *scans):
    for number, length in enumerate(scans):
        main.run(scans=length, Button=number % 2 == 0)
    return main


def test_prediction(fb):
    count = predicted(__file__, "count")
    main = pressed(fb("given.st::Main"), 5, 3, 2)
    assert count == main.Count


@pytest.mark.parametrize("scans, presses", [((5, 3, 2), 2), ((1, 1, 1, 1, 1), 3), ((20,), 1)])
def test_program(fb, scans, presses):
    main = pressed(fb("program.st::Main"), *scans)
    assert main.Count == presses, f"the button was pressed {presses} times, for more than one scan each; Count is {main.Count}"
