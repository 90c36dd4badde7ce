from fbvm.testing.lesson import predicted


def test_prediction(fb):
    parts = predicted(__file__, "parts")
    arrived = predicted(__file__, "arrived")
    main = fb("given.st::Main").run(scans=3)
    main.run(scans=10, Sensor=True).run(scans=3, Automatic=True)
    assert parts == main.Parts
    assert arrived is False


def test_a_part_that_was_there_before(fb):
    main = fb("program.st::Main").run(scans=3)
    main.run(scans=10, Sensor=True).run(scans=3, Automatic=True)
    assert main.Parts == 0, f"a part that lay there before Automatic is no arrival; Parts is {main.Parts}, not 0"


def test_parts_that_arrive(fb):
    main = fb("program.st::Main").run(scans=3, Automatic=True)
    for _ in range(4):
        main.run(scans=2, Sensor=True).run(scans=2, Sensor=False)
    assert main.Parts == 4, f"four parts have arrived; Parts is {main.Parts}"


def test_a_part_after_one_that_passed_in_manual(fb):
    main = fb("program.st::Main").run(scans=2, Automatic=True).run(scans=2, Sensor=True)
    main.run(scans=2, Automatic=False).run(scans=2, Sensor=False)
    main.run(scans=2, Automatic=True).run(scans=2, Sensor=True)
    assert main.Parts == 2, f"one part arrived before manual, and one after it; Parts is {main.Parts}, not 2"
