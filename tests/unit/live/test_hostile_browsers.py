"""What other sites, broken programs and slow browsers send to the server of the live page: they get and break nothing."""

from __future__ import annotations

import json

import pytest
from browsers import HOST, PORT, TOKEN, Page, answered, connected, frame, request, said
from growth import least_kept_bytes
from rows import each_of

from fbvm.live.connection import MOST_REQUEST_BYTES, Connection
from fbvm.live.guard import Guard
from fbvm.live.messages import MOST_MESSAGE_BYTES, MOST_TEXT, message_id

FILE = {"path": "/", "origin": None, "upgrade": False}


def test_the_own_page_gets_its_files_and_its_socket() -> None:
    assert answered(request(**FILE))[0] == 200  # type: ignore[arg-type]
    assert answered(request())[0] == 101


@pytest.mark.parametrize("origin", ["http://evil.example", "null", f"https://{HOST}", f"http://127.0.0.1:{PORT + 1}", "",
                                    f"http://{HOST}.evil.example", f"http://localhost:{PORT}"])  # fmt: skip
def test_a_page_of_another_site_opens_no_socket(origin: str) -> None:
    assert answered(request(origin=origin))[0] == 403


@pytest.mark.parametrize("host", ["evil.example", f"evil.example:{PORT}", "127.0.0.1", f"127.0.0.1:{PORT + 1}", "", None,
                                  f"127.0.0.1:{PORT}.", f"127.0.0.1.evil.example:{PORT}", f"127.0.0.1:{PORT}@evil.example",
                                  f"2130706433:{PORT}"])  # fmt: skip
@pytest.mark.parametrize("path", ["/", f"/live?token={TOKEN}"])
def test_a_name_that_was_made_to_point_here_gets_nothing(host: str | None, path: str) -> None:
    status, answer = answered(request(path, host, f"http://{host}", upgrade=path != "/"))
    assert status == 421
    assert TOKEN.encode() not in answer


@pytest.mark.parametrize("name", ["evil.example", "localhost.evil.example", "127.1.evil"])
def test_with_bind_to_all_a_name_gets_nothing_all_the_same(name: str) -> None:
    assert answered(request(host=f"{name}:{PORT}", origin=f"http://{name}:{PORT}"), "0.0.0.0")[0] == 421
    assert answered(request(host=f"192.168.1.7:{PORT}", origin=f"http://192.168.1.7:{PORT}"), "0.0.0.0")[0] == 101


@pytest.mark.parametrize("query", ["", "?token=", "?token=a-secret-toke", f"?token={TOKEN}x", f"?Token={TOKEN}",
                                   f"?token={TOKEN}&token=x", "?token=%FF%FE", "?token=é"])  # fmt: skip
def test_without_the_token_there_is_no_socket(query: str) -> None:
    assert answered(request(f"/live{query}".encode("ascii", "replace").decode()))[0] == 403


OWN = f"http://{HOST}"
SOCKET = f"/live?token={TOKEN}"
NO_HOST, OTHER_SITE = "this server answers to the address", "another site's page"
NO_TOKEN = "the token is missing or wrong"


@each_of(("bind", "name", "is_own"), (
    *(("127.0.0.1", name, True) for name in ("127.0.0.1", "localhost", "LocalHost", "[::1]")),
    *(("127.0.0.1", name, False) for name in ("", "0.0.0.0", "192.168.1.7", "::1", "localhost.")),
    *(("192.168.1.7", name, True) for name in ("192.168.1.7", "localhost")), ("192.168.1.7", "192.168.1.8", False),
    *(("0.0.0.0", name, True) for name in ("0.0.0.0", "localhost", "1.2.3.4", "255.255.255.255")),
    *(("0.0.0.0", name, False) for name in ("1.2.3", "1.2.3.4.5", "1.2.3.", "1.2.3.256", "256.2.3.4", "1.2.3.0004", "1.2.3.a",
                                            "1.2.3.-4", "1.2.3.²", "1.2.3.٤", "1.2.3. 4"))))  # fmt: skip
def test_a_server_knows_its_own_names_and_if_it_is_open_any_ipv4_address(bind: str, name: str, is_own: bool) -> None:
    refused = Guard(PORT, bind, TOKEN).refusal("/", [f"{name}:{PORT}"], [])
    assert (refused is None) == is_own
    assert Guard(PORT, bind, TOKEN).refusal("/", [f"{name}:{PORT + 1}"], []) is not None


@each_of(("path", "hosts", "origins", "status", "said"), (
    ("/", [HOST], [], None, ""), ("/", [HOST], [OWN], None, ""), ("/", [HOST], [OWN, OWN], None, ""),
    ("/live.js?token=x", [HOST], [], None, ""), ("/", [HOST], ["null"], 403, OTHER_SITE),
    ("/", [HOST], [OWN, "http://evil.example"], 403, OTHER_SITE), ("/", [], [], 421, NO_HOST),
    ("/", [HOST, HOST], [], 421, NO_HOST),
    (SOCKET, [HOST], [OWN], None, ""), (SOCKET, [HOST], [], None, ""), (SOCKET, [HOST], [OWN, OWN], 403, OTHER_SITE),
    (SOCKET, ["localhost"], [OWN], 421, NO_HOST), (SOCKET, [f"localhost:{PORT}"], [OWN], 403, OTHER_SITE),
    ("/live", [HOST], [OWN], 403, NO_TOKEN), (f"{SOCKET}&token={TOKEN}", [HOST], [OWN], 403, NO_TOKEN),
    (f"/live?a=1&token={TOKEN}", [HOST], [OWN], None, "")))
def test_why_a_request_is_refused(path: str, hosts: list[str], origins: list[str], status: int | None, said: str) -> None:
    refused = Guard(PORT, token=TOKEN).refusal(path, hosts, origins)
    assert (refused and refused[0], said in (refused[1] if refused else "")) == (status, True)


def test_a_query_of_more_fields_than_a_page_sends_has_no_token() -> None:
    for more, status in (("&a=1&b=2&c=3", 101), ("&a=1&b=2&c=3&d=4", 403)):
        assert answered(request(f"/live?token={TOKEN}{more}"))[0] == status, more


def test_two_host_headers_are_refused() -> None:
    assert answered(request().replace(b"Upgrade:", b"Host: evil.example\r\nUpgrade:", 1))[0] == 421


@pytest.mark.parametrize("path", ["/../pyproject.toml", "/%2e%2e/secret", "//etc/passwd", "/live.py", "/page/live.html",
                                  "/main.js/..", "http://evil.example/", "//["])  # fmt: skip
def test_no_path_reaches_the_disk(path: str) -> None:
    status, answer = answered(request(path, origin=None, upgrade=False))
    assert (status, b"there is no such file" in answer) == (404, True)


@pytest.mark.parametrize("method", ["POST", "PUT", "DELETE", "OPTIONS"])
def test_forms_and_preflights_are_refused(method: str) -> None:
    assert answered(request("/", origin=None, method=method, upgrade=False))[0] in (0, 405)
    status, answer = answered(request(method=method))
    assert status != 101
    assert b"access-control" not in answer.lower()


def test_every_answer_forbids_scripts_of_others_and_frames_and_lets_nobody_else_read() -> None:
    for data in (request(**FILE), request("/nothing", origin=None, upgrade=False), request(host="evil.example")):  # type: ignore[arg-type]
        answer = answered(data)[1].decode().lower()
        policy = next(line for line in answer.split("\r\n") if line.startswith("content-security-policy"))
        assert "script-src 'self'" in policy and "frame-ancestors 'none'" in policy
        assert "unsafe" not in policy
        assert "access-control" not in answer
        assert "nosniff" in answer


def test_the_page_has_neither_inline_scripts_nor_inline_styles_nor_other_sites() -> None:
    text = answered(request(**FILE))[1].decode().partition("\r\n\r\n")[2]  # type: ignore[arg-type]
    assert " style=" not in text and " onclick" not in text and "<style" not in text
    assert "://" not in text
    assert text.count("<script") == text.count('<script type="module" src="/main.js">') == 1


@each_of("text, number", [
    ('{"id":9007199254740991}', 2**53 - 1), ('{"id":-9007199254740991}', 1 - 2**53), ('{"id":9007199254740992}', None),
    ('{"id":true}', None), ('{"id":1.0}', None), ("[]", None), ("{", None), ("[" * 100_000, None),
])  # fmt: skip
def test_the_id_of_a_message_is_a_whole_number_that_javascript_holds(text: str, number: int | None) -> None:
    assert message_id(text) == number


def test_the_token_is_in_the_address_only_behind_the_number_sign() -> None:
    guard = Guard(PORT)
    assert guard.address() == f"http://{HOST}/#token={guard.token}"
    assert len(guard.token) >= 32 and guard.token != Guard(PORT).token


def test_what_is_no_http_is_ended() -> None:
    modbus = b"\x00\x01\x00\x00\x00\x06\x01\x03\x00\x00\x00\x01\r\n\r\n"
    for junk in (b"\x16\x03\x01\x02\x00\x01" * 20, b"GET\r\n\r\n", modbus, b"\r\n\r\n"):
        made = Connection(Guard(PORT, token=TOKEN))
        assert made.receive(junk) == []
        made.receive(b"")
        assert made.ends and not made.is_open


def test_a_request_without_an_end_is_ended() -> None:
    made = Connection(Guard(PORT, token=TOKEN))
    for _ in range(MOST_REQUEST_BYTES // 4096 + 1):
        made.receive(b"X-A: " + b"a" * 4091)
    assert made.ends


def test_an_oversized_message_ends_its_connection() -> None:
    made = connected()
    assert made.receive(frame(b'{"do":"' + b"a" * MOST_MESSAGE_BYTES + b'"}')) == []
    assert made.ends and not made.is_open
    assert (1009).to_bytes(2, "big") in said(made)


def test_a_message_in_many_pieces_is_bounded_as_a_whole() -> None:
    made = connected()
    piece = b"a" * (MOST_MESSAGE_BYTES // 4)
    texts = made.receive(frame(piece, fin=False))
    for _ in range(8):
        texts += made.receive(frame(piece, opcode=0, fin=False))
    assert texts == [] and made.ends


@pytest.mark.slow
def test_pieces_without_a_character_take_no_memory() -> None:
    made = connected()
    made.receive(frame(b'{"do":', fin=False))
    empty = frame(b"", opcode=0, fin=False) * 1000
    assert made.receive(empty) == []
    assert least_kept_bytes(lambda: [made.receive(empty) for _ in range(10)]) < 20_000, "10,000 pieces"
    assert made.receive(frame(b'"ready"}', opcode=0)) == ['{"do":"ready"}']


def test_pieces_of_a_message_come_together() -> None:
    made = connected()
    assert made.receive(frame(b'{"do":', fin=False)) == []
    data = frame(b'"ready"}', opcode=0)
    assert [made.receive(data[at : at + 1]) for at in range(len(data))][-1] == ['{"do":"ready"}']


@pytest.mark.parametrize("data", [frame(b"{}", opcode=2), frame(b"\xff\xfe"), frame(b"{}", masked=False), frame(b"", opcode=11),
                                  frame(b"a" * 200, opcode=9), b"\xff" * 40])  # fmt: skip
def test_broken_frames_end_the_connection(data: bytes) -> None:
    made = connected()
    assert made.receive(data) == []
    assert made.ends
    assert made.receive(frame(b'{"do":"ready"}')) == []


@pytest.mark.parametrize("text", [
    "", "no json", "[]", "null", "1", '"do"', "{}", '{"do":5}', '{"do":"eval"}', '{"do":"__init__"}', '{"do":"write"}',
    "[" * 5000, '{"do":"write","plc":"pump","name":"Main.Level","value":5}',
    '{"do":"write","plc":["pump"],"name":"a","value":"1"}',
    '{"do":"write","plc":"pump","name":"Main.Level","value":"1","path":"/etc"}', '{"do":"step","scans":true}',
    '{"do":"step","scans":1e99}', '{"do":"step","scans":99999999999999999999999999}', '{"do":"speed","factor":NaN}',
    '{"do":"speed","factor":1e999}',
    '{"do":"speed","factor":-1}', '{"do":"look","plc":"pump","names":[1]}', '{"do":"look","plc":"pump","memory":"../D"}',
    '{"do":"view","plc":"pump","scan":-5}', '{"do":"hello","version":2}', '{"id":{},"do":"ready"}',
    '{"do":"source","plc":"pump","instance":"Main.Level"}', '{"do":"parts","plc":"pump","name":"nothing"}',
    '{"do":"cable","plc":"pump","unit":"x","plugged":false}', '{"do":"fault","kind":"silent","peer":"a:b"}',
    '{"do":"mend","number":7}', '{"do":"write","plc":"pump","name":"Main.Level","value":"99999"}',
    '{"do":"mode","plc":"pump","mode":"BOOT"}', '{"do":"fault","kind":"slow","time":"-5ms"}',
    '{"do":"force","plc":"pump","name":"D1..D5","value":"1"}', r'{"do":"look","plc":"pump","names":["\ud800"]}',
    r'{"do":"\uDFFF"}', r'{"do":"run","\udead":1}',
])  # fmt: skip
def test_a_broken_message_gets_an_error_and_changes_nothing(text: str) -> None:
    page = Page()
    page.scan(3)
    before = bytes(page.plc.memory.map[:])
    reply = json.loads(page.session.answer(text) or "")
    assert set(reply) == {"re", "error"} and reply["error"]
    assert bytes(page.plc.memory.map[:]) == before
    assert page.bench.acts == [] and not page.control.is_paused and page.network.faults == []


def test_every_reply_and_update_can_be_sent() -> None:
    """Also with characters that are no UTF-8, and such a WSTRING."""
    page = Page('PROGRAM Main VAR Half : WSTRING := "a$D800b"; Wide : WSTRING := "$D83D$DE00"; END_VAR END_PROGRAM')
    for name in (r"\ud800", r"\ud83d\ude00"):
        reply = page.session.answer(f'{{"id":1,"do":"look","plc":"pump","names":["{name}"]}}') or page.session.update(0)
        assert reply is not None and reply.encode()
    page.done("hello")
    page.done("look", plc="pump", names=["Main.Half", "Main.Wide"])
    text = page.session.update(10**9)
    assert text is not None and set(json.loads(text.encode())["update"]["values"]) == {"Main.Half", "Main.Wide"}


def test_a_long_text_in_a_message_is_refused() -> None:
    reply = Page().ask("search", plc="pump", text="a" * (MOST_TEXT + 1))
    assert "more than" in reply["error"]


def test_names_comments_and_texts_of_users_travel_as_data() -> None:
    page = Page()
    page.done("hello")
    page.done("look", plc="pump", names=["Main.Said"])
    assert page.update()["values"]["Main.Said"] == "'<img src=x onerror=alert(1)>'"
    lines = page.done("source", plc="pump", instance="Main")["lines"]
    assert any("<script>alert(1)</script>" in line["text"] for line in lines)


def test_drawings_escape_what_users_write() -> None:
    page = Page(LADDER)
    page.done("hello")
    page.done("look", plc="pump", names=[], instance="Main", scan=True)
    page.scan(2)
    (head, svg), *_ = page.update()["inside"]["pictures"]
    assert head == "RUNG 1 <b onclick=alert(1)>rung</b>"  # becomes a text node
    assert svg.startswith("<svg ") and "<b" not in svg


LADDER = """
PROGRAM Main
VAR Start, Lamp : BOOL; END_VAR
LADDER
    RUNG 1 <b onclick=alert(1)>rung</b>
    LD Start
    OUT Lamp
END_LADDER
END_PROGRAM
"""


def test_a_page_that_never_takes_an_update_gets_one_and_no_more() -> None:
    page = Page()
    page.done("hello")
    page.done("look", plc="pump", names=["Main.Level"])
    texts = []
    for number in range(1, 100):
        page.scan()
        texts.append(page.session.update(number * 10**9))
    assert [text is not None for text in texts] == [True] + [False] * 98


def test_only_pages_that_are_named_may_hold_the_page_in_a_frame() -> None:
    made = Connection(Guard(PORT, token=TOKEN, frames=("vscode-webview:", "http://127.0.0.1:*")))
    made.receive(request("/", upgrade=False))
    head = said(made).partition(b"\r\n\r\n")[0]
    assert b"frame-ancestors vscode-webview: http://127.0.0.1:*\r\n" in head and b"X-Frame-Options" not in head
    _, usual = answered(request("/", upgrade=False))
    assert b"frame-ancestors 'none'" in usual and b"X-Frame-Options: DENY" in usual
    for wrong in ("*", "a; script-src *", "http://a b", "'self'", "evil.example", "https:\r\nX: y"):
        with pytest.raises(ValueError, match="no origin"):
            Guard(PORT, frames=(wrong,))


def test_read_only_refuses_every_action_that_changes_anything() -> None:
    page = Page(read_only=True)
    for action in ("write", "force", "release", "run", "pause", "step", "speed", "mode", "start", "cable", "fault", "mend"):
        named = {"plc": "pump", "name": "Main.Level", "value": "1"}
        fields = {"write": named, "force": named, "release": {"plc": "pump"}, "step": {"scans": 1}, "speed": {"factor": 1},
                  "mode": {"plc": "pump", "mode": "RUN"}, "start": {"plc": "pump", "kind": "cold"}, "fault": {"kind": "silent"},
                  "cable": {"plc": "pump", "unit": "ETN21 0", "plugged": False}}.get(action, {})  # fmt: skip
        assert "--read-only" in page.ask(action, **fields).get("error", ""), action
    assert page.bench.acts == []


def test_allow_write_lets_what_is_named_and_what_is_in_it_be_written_and_nothing_else() -> None:
    """Nor what is behind a reference in it."""
    page = Page("""TYPE T : STRUCT a : INT; p : REF_TO INT; END_STRUCT END_TYPE
        PROGRAM Main VAR Level : INT; Held : T; Curve : ARRAY[1..3] OF INT; END_VAR Held.p := REF(Level); END_PROGRAM""",
        writable=["main.curve", "D10", "Main.Held"])  # fmt: skip
    page.scan()
    assert "error" not in page.ask("write", plc="pump", name="Main.Held.a", value="1")
    assert "error" in page.ask("write", plc="pump", name="Main.Held.p^", value="1")
    for name, value in (("Main.Curve[2]", "5"), ("Main.Curve", "1,2,3"), ("D10", "5"), ("d10", "6"), ("D10.5", "1")):
        assert "error" not in page.ask("write", plc="pump", name=name, value=value), name
    for name in ("Main.Level", "Main.Curves", "D100", "D10..D11", "D1", "Main.Reached"):
        assert "error" in page.ask("write", plc="pump", name=name, value="1"), name
    assert "error" in page.ask("start", plc="pump", kind="cold")
    assert "error" in page.ask("release", plc="pump")
