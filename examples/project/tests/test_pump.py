"""The pump's block, in virtual time: one scan is 10 ms."""


def test_the_pump_runs_after_50_ms(fb):
    pump = fb("src/pump.st::Pump", cycle="10ms")
    pump.run("50ms", Start=True)
    assert not pump.Running
    pump.scan()
    assert pump.Running
    assert pump.Starts == 1


def test_a_short_press_starts_nothing(fb):
    pump = fb("src/pump.st::Pump", cycle="10ms")
    pump.run("40ms", Start=True)
    pump.run("1s", Start=False)
    assert pump.Starts == 0
