from fbvm import ModbusPeer, Peer
from fbvm.testing.lesson import predicted


def plc_with_unit(fb, network, file):
    network.place(Peer("192.168.250.1", 502), ModbusPeer())
    return fb(f"{file}::Main", etn21="192.168.250.21", network=network).run(scans=3)


def test_prediction(fb, network):
    requests = predicted(__file__, "requests")
    main = plc_with_unit(fb, network, "given.st").run(scans=10, Start=True)
    assert main.Is_Open
    assert requests == main.Requests


def test_program(fb, network):
    main = plc_with_unit(fb, network, "program.st").run(scans=10, Start=True)
    assert main.Is_Open, "10 scans after Start the connection is not open"
    assert main.Requests == 1, f"the program has asked {main.Requests} times to open one connection, not once"


def test_a_unit_that_takes_long(fb, network):
    main = plc_with_unit(fb, network, "program.st").scan(Start=True)
    for _ in range(20):                     # a unit that is still busy: switch ON, not yet open
        main.scan({"CIO 1519.02": True, "CIO 1509.15": False})
        assert main.Requests == 1, f"in scan {main.scans - 1} the unit is busy yet; it was asked {main.Requests} times"
