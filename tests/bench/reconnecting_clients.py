"""Eight clients that come and go: python reconnecting_clients.py PORT SEED.

Each connects, asks, and leaves by FIN, by RST or in the middle of a request, as the seed says, until a line comes on the standard
input.  Then all eight have to be served at the same moment.  Prints one JSON object: what was counted.
"""

from __future__ import annotations

import json
import random
import socket
import struct
import sys
import threading
import time
from collections import Counter

CLIENTS, PATIENCE_S, QUIET_S, LAST_S = 8, 0.5, 4.0, 20.0
REQUEST = bytes.fromhex("0000 0006 01 03 03E8 0001")
RIGHT = bytes.fromhex("0000 0005 01 03 02 004D")
RST_ON_CLOSE = struct.pack("ii", 1, 0)
quiet = threading.Event()
counts: Counter[str] = Counter()


def ask(sock: socket.socket, transaction: int) -> bool:
    """One exchange; True if the reply is whole.  Counts a reply that is wrong, as far as it has come."""
    sock.sendall(transaction.to_bytes(2, "big") + REQUEST)
    wanted, reply = transaction.to_bytes(2, "big") + RIGHT, b""
    while len(reply) < len(wanted):
        data = sock.recv(len(wanted) - len(reply))
        if not data:
            return False
        reply += data
    counts["right" if reply == wanted else "wrong"] += 1
    return reply == wanted


def come_and_go(port: int, dice: random.Random) -> None:
    while not quiet.is_set():
        try:
            with socket.create_connection(("127.0.0.1", port), PATIENCE_S) as sock:
                counts["connected"] += 1
                for number in range(dice.randint(0, 5)):
                    if not ask(sock, dice.randrange(65536) if number else 0):
                        break
                if dice.random() < 0.3:
                    sock.sendall(REQUEST[: dice.randint(1, 9)])
                if dice.random() < 0.5:
                    sock.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, RST_ON_CLOSE)
        except OSError as error:
            counts[type(error).__name__] += 1
            time.sleep(0.01)


def all_at_once(port: int) -> int:
    """How many of eight clients are served while all of them hold their connection."""
    held: list[socket.socket] = []
    end_s = time.monotonic() + LAST_S
    while len(held) < CLIENTS and time.monotonic() < end_s:
        try:
            sock = socket.create_connection(("127.0.0.1", port), 2)
            if ask(sock, len(held)):
                held.append(sock)
            else:
                sock.close()
        except OSError:
            time.sleep(0.05)
    served = 0
    for number, sock in enumerate(held):
        try:
            served += ask(sock, 100 + number)
        except OSError as error:
            counts[f"at the end: {type(error).__name__}"] += 1
    for sock in held:
        sock.close()
    return served


def main(port: int, seed: int) -> None:
    threads = [threading.Thread(target=come_and_go, args=(port, random.Random(seed + number))) for number in range(CLIENTS)]
    for thread in threads:
        thread.start()
    sys.stdin.readline()
    quiet.set()
    for thread in threads:
        thread.join()
    time.sleep(QUIET_S)
    print(json.dumps(counts | {"served at once": all_at_once(port)}))


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]))
