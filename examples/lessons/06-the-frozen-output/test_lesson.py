from fbvm.testing.lesson import predicted


def test_prediction(fb):
    output = predicted(__file__, "output")
    main = fb("given.st::Main").run(scans=3, Enable=True, Wanted=50)
    main.run(scans=3, Enable=False, Wanted=0)
    assert output == main.Output


def test_program(fb):
    main = fb("program.st::Main").run(scans=2, Enable=True, Wanted=50)
    for enable, wanted, output in ((True, 50, 500), (False, 50, 0), (False, 20, 0), (True, 20, 200), (False, 20, 0)):
        main.scan(Enable=enable, Wanted=wanted)
        assert main.Output == output, f"with Enable {enable} and Wanted {wanted} Output is {main.Output}, not {output}"
