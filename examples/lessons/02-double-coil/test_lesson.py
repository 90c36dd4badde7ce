from itertools import product

from fbvm.testing.lesson import predicted


def test_prediction(fb, trace):
    between = predicted(__file__, "between")
    at_the_end = predicted(__file__, "at_the_end")
    main = fb("given.st::Main")
    run = trace(main)
    main.scan(Automatic=True, Sensor=True)
    inside = [line.split()[-1] for line in run.table("Lamp").splitlines() if ".st:" in line]
    assert between == (inside[0] == ">TRUE")
    assert at_the_end == main.Lamp


def test_program(fb):
    main = fb("program.st::Main")
    for automatic, sensor, manual, button in product((False, True), repeat=4):
        main.scan(Automatic=automatic, Sensor=sensor, Manual=manual, Button=button)
        lit = automatic and sensor or manual and button
        assert main.Lamp == lit, (f"with Automatic {automatic}, Sensor {sensor}, Manual {manual}, Button {button} "
                                  f"Lamp is {main.Lamp}, not {lit}")
