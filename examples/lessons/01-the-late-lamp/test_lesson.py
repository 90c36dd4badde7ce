from fbvm.testing.lesson import predicted


def pressed(fb, file):
    main = fb(f"{file}::Main").run(scans=3)
    return main.until("Lamp", max="100ms", Button=True)


def test_prediction(fb):
    lamp_on_in_scan = predicted(__file__, "lamp_on_in_scan")
    main = pressed(fb, "given.st")
    assert lamp_on_in_scan == main.scans - 1


def test_program(fb):
    main = pressed(fb, "program.st")
    assert main.scans - 1 == 3 and main.Lamp
    assert not main.scan(Button=False).Lamp
