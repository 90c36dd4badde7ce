"""Messages that are none: each request is answered, the others are named in a line, and the server goes on."""

from __future__ import annotations

import json
import subprocess
import sys
from typing import Any

import pytest

pytestmark = pytest.mark.slow

ASKED: dict[str, Any] = {"jsonrpc": "2.0", "id": 7, "method": "textDocument/hover", "params": {"position": 5}}
CASES: list[tuple[bytes, str]] = [
    (b"5", "a message is an object with the key jsonrpc"), (b"null", "a message is an object with the key jsonrpc"),
    (b"[null]", "a message is an object with the key jsonrpc"), (b"{", "Expecting property name"),
    (b'{"a":"\xff"}', "'utf-8' codec"),
    (b"[" * 100_000, "maximum recursion depth exceeded"), (b'{"jsonrpc":"2.0","method":5}', "Internal Error"),
    (b'{"jsonrpc":"2.0","id":NaN,"method":"shutdown"}', "the id of a message is an integer or a text"),
    (b'{"jsonrpc":"2.0","id":%s,"method":"shutdown"}' % (b"9" * 10_000), "Exceeds the limit"),
    (json.dumps(ASKED).encode(), "textDocument/hover: Invalid Params"),
]


def framed(body: bytes) -> bytes:
    return b"Content-Length: %d\r\n\r\n%s" % (len(body), body)


def request(number: int, method: str, params: object) -> bytes:
    return framed(json.dumps({"jsonrpc": "2.0", "id": number, "method": method, "params": params}).encode())


def test_a_message_that_is_none_is_named_in_a_line_and_the_server_goes_on() -> None:
    begun = request(1, "initialize", {"capabilities": {}, "processId": None, "rootUri": None})
    wrong = b"".join(framed(body) for body, _ in CASES)
    done = subprocess.run([sys.executable, "-m", "fbvm", "lsp"], input=begun + wrong + request(2, "shutdown", None),
                          capture_output=True, timeout=60)  # fmt: skip
    for line, (_, said) in zip(done.stderr.decode().splitlines(), CASES, strict=True):
        assert line.startswith("a message of the editor is not understood: ") and said in line
    answers = [json.loads(part.partition("\r\n\r\n")[2]) for part in done.stdout.decode().split("Content-Length: ")[1:]]
    assert [(answer["id"], answer.get("error", {}).get("code")) for answer in answers if "id" in answer] == [
        (1, None), (7, -32602), (2, None)]
    assert len([answer for answer in answers if answer.get("method") == "window/showMessage"]) == len(CASES) - 1


def test_a_request_behind_a_shutdown_is_answered_with_an_error() -> None:
    begun = request(1, "initialize", {"capabilities": {}, "processId": None, "rootUri": None})
    end = b"".join([request(2, "shutdown", None), request(3, "shutdown", None), request(4, "textDocument/hover", {
        "textDocument": {"uri": "file:///a.st"}, "position": {"line": 0, "character": 0}}),
        framed(b'{"jsonrpc":"2.0","method":"exit"}')])
    done = subprocess.run([sys.executable, "-m", "fbvm", "lsp"], input=begun + end, capture_output=True, timeout=60)
    answers = [json.loads(part.partition("\r\n\r\n")[2]) for part in done.stdout.decode().split("Content-Length: ")[1:]]
    assert [(answer["id"], answer.get("error", {}).get("code")) for answer in answers if "id" in answer] == [
        (1, None), (2, None), (3, -32600), (4, -32600)]
    assert (done.returncode, done.stderr) == (0, b"")
