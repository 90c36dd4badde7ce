import pytest

from fbvm.testing.lesson import predicted


def seen(main, *scans):
    """What the terminal was at the end of each scan."""
    found = []
    for number, length in enumerate(scans):
        for _ in range(length):
            found.append(main.scan(Button=number % 2 == 1)["CIO 100.00"])
    return found


def test_prediction(fb):
    scans_on = predicted(__file__, "scans_on")
    asked = predicted(__file__, "asked")
    main = fb("given.st::Main")
    terminal = seen(main, 2, 3, 2, 1, 2, 4)
    assert scans_on == sum(terminal)
    assert asked == main.Asked


@pytest.mark.parametrize("scans", [(2, 3, 2, 1, 2, 4), (1, 1, 1, 1, 1), (3, 9)])
def test_program(fb, scans):
    main = fb("program.st::Main")
    terminal = seen(main, *scans)
    presses = len(scans) // 2
    assert main.Asked == presses, f"of {presses} presses the program saw {main.Asked}"
    assert sum(terminal) == presses, f"in {presses} presses the terminal is ON for {sum(terminal)} scans, not one for each"
