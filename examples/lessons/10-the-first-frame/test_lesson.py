from fbvm import ModbusPeer, Peer
from fbvm.testing.lesson import predicted
from fbvm.wire import modbus


def asked(fb, network):
    """The program, and the first question that left its unit."""
    peer, questions = ModbusPeer(), []
    for number in range(300):
        peer.server.holding_registers[number] = 1000 + number
    network.place(Peer("192.168.250.1", 502), peer)
    main = fb("program.st::Main", etn21="192.168.250.21", network=network)
    before = network.tap

    def tap(now_ns, unit, happening):
        before(now_ns, unit, happening)
        if happening.data and happening.out:
            questions.append(happening.data)

    network.tap = tap
    main.until("Done", max="5s")
    return main, questions[0]


def test_prediction():
    frame = predicted(__file__, "frame")
    adu = modbus.parse_adu(bytes.fromhex(str(frame)))
    assert isinstance(adu, modbus.Adu), f"this is no frame: {adu}"
    assert (adu.transaction, adu.unit) == (1, 1)
    assert str(modbus.decode_request(adu.pdu)) == "03 read holding registers, address 258, quantity 3"


def test_program(fb, network):
    main, question = asked(fb, network)
    said = str(modbus.decode_request(question[7:]))
    assert said == "03 read holding registers, address 258, quantity 3", f"the first frame asks: {said}"
    assert main["D300..D302"] == [1258, 1259, 1260], f"D300 to D302 hold {main['D300..D302']}, not 1258, 1259, 1260"
