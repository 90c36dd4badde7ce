import pytest

from fbvm.testing import ns
from fbvm.testing.lesson import predicted


def waited_ns(main, before):
    main.run(scans=before)
    start_ns = main.elapsed_ns
    main.until("Lamp", max="3m", Start=True)
    return main.plc.now_ns - start_ns


def test_prediction(fb):
    seconds = predicted(__file__, "seconds")
    main = fb("given.st::Main")
    waited = waited_ns(main, 3) / ns("1s")
    assert main.Lamp and seconds == round(waited)


@pytest.mark.parametrize("before", range(1, 21, 3))
def test_program(fb, before):
    main = fb("program.st::Main")
    waited = waited_ns(main, before)
    assert ns("1.5s") <= waited < ns("1.7s"), f"Start in scan {before}: Lamp is ON after {waited / ns('1s'):g} s, not after 1.5 s"
    assert main.Wait_2.Q, "Lamp is ON, and Wait_2.Q is not: the timer has to give it"
