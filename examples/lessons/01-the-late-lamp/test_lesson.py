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
    assert main.scans - 1 == 3, f"the button is ON from scan 3 on; Lamp is ON at the end of scan {main.scans - 1}, not of scan 3"
    assert not main.scan(Button=False).Lamp, "the button is OFF in the next scan, and Lamp is still ON at its end"
