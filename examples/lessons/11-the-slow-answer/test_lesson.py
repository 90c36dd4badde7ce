import pytest

from fbvm import ModbusPeer, Peer
from fbvm.net.faults import Fault
from fbvm.testing import ns
from fbvm.testing.lesson import predicted

SERVER = Peer("192.168.250.1", 502)


def plc(fb, network, file, latency):
    peer = ModbusPeer()
    peer.server.holding_registers[7] = 42
    network.place(SERVER, peer)
    main = fb(f"{file}::Main", etn21="192.168.250.21", network=network)
    main.until("Connection.ENO", max="5s")
    network.faults.append(Fault(latency_ns=ns(latency) // 2))      # half of it for each way
    return main


def test_prediction(fb, network):
    level = predicted(__file__, "level")
    main = plc(fb, network, "given.st", "300ms").until("Valid", max="5s")
    assert level == main.Level


@pytest.mark.parametrize("latency", ["0ms", "40ms", "90ms", "300ms", "2s"])
def test_program(fb, network, latency):
    main = plc(fb, network, "program.st", latency).until("Valid", max="10s")
    assert main.Level == 42, f"the answer comes after {latency}: Valid is ON, and Level is {main.Level}, not 42"


def test_without_an_answer(fb, network):
    main = plc(fb, network, "program.st", "0ms")
    network.faults[:] = [Fault(silent=True)]
    main.run("3s")
    assert not main.Valid, "nobody has answered for 3 s, and Valid is ON"
