from fbvm.testing.lesson import predicted


def test_prediction(fb):
    output = predicted(__file__, "output")
    main = fb("given.st::Main").run(scans=3, Enable=True, Wanted=50)
    main.run(scans=3, Enable=False, Wanted=0)
    assert output == main.Output


def test_program(fb):
    main = fb("program.st::Main").run(scans=3, Enable=True, Wanted=50)
    assert main.Output == 500
    assert main.scan(Enable=False).Output == 0
    assert main.scan(Wanted=20).Output == 0
    assert main.scan(Enable=True).Output == 200
    assert main.scan(Enable=False).Output == 0
