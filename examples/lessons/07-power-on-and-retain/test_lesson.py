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
    assert not main.Motor
    assert main.Total == 10
    main.scan(Start=True).run(scans=4, Start=False)
    assert main.Motor
    assert main.Total == 15
    assert main.Batch == 5
    assert not main.scan(Stop=True).Motor
