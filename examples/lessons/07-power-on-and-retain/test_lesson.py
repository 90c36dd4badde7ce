from fbvm.testing.lesson import predicted


def after_power_on(fb, file):
    main = fb(f"{file}::Main").scan(Start=True)
    return main.run(scans=9, Start=False).power_on().run(scans=5)


def test_prediction(fb):
    total = predicted(__file__, "total")
    batch = predicted(__file__, "batch")
    motor = predicted(__file__, "motor")
    main = after_power_on(fb, "given.st")
    assert total == main.Total
    assert batch == main.Batch
    assert motor == main.Motor


def test_program(fb):
    main = after_power_on(fb, "program.st")
    assert not main.Motor, "after power-on Motor is ON by itself; it is to wait for Start"
    assert main.Total == 10, f"Total was 10 when power went; after power-on it is {main.Total}"
    main.scan(Start=True).run(scans=4, Start=False)
    assert main.Motor, "Start was pressed after power-on, and Motor is OFF"
    assert main.Total == 15, f"ten parts before power-on and five after it; Total is {main.Total}, not 15"
    assert main.Batch == 5, f"five parts since power-on; Batch is {main.Batch}"
    assert not main.scan(Stop=True).Motor, "Stop is pressed, and Motor is ON at the end of the scan"
