from fbvm.testing.lesson import predicted


def after(main, *inputs):
    for start, stop in inputs:
        main.scan(Start=start, Stop=stop)
    return main.Motor


def test_prediction(fb):
    motor = predicted(__file__, "motor")
    contact = predicted(__file__, "contact")
    main = fb("given.st::Main")
    assert motor == after(main, (True, False), *[(False, False)] * 2, *[(False, True)] * 3)
    holds = after(fb("given.st::Main"), *[(False, True)] * 6)
    assert str(contact).upper() == ("START" if holds else "MOTOR")


def test_a_pulse_of_start_starts_the_motor_and_it_goes_on(fb):
    main = fb("program.st::Main")
    assert after(main, (True, False), *[(False, False)] * 3), "Start was ON in scan 0; at the end of scan 3 Motor is OFF"


def test_stop_stops_the_motor(fb):
    main = fb("program.st::Main")
    assert not after(main, (True, False), (False, True)), "Stop is ON in scan 1, and Motor is ON at its end"
    assert not after(main, (False, False)), "Stop is let go in scan 2, and Motor is ON by itself"


def test_stop_wins_while_start_is_pressed(fb):
    main = fb("program.st::Main")
    assert not after(main, (True, False), (True, True)), "Start and Stop are ON in scan 1, and Motor is ON at its end"
