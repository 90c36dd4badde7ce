"""The compression of `.cxp` files, against vectors written down by hand and its own other half."""

from __future__ import annotations

import random

import pytest

from fbvm.base.files import SOURCE_BYTES
from fbvm.interchange.cx.compression import LONGEST, CompressionError, _matches, compress, decompress

VECTORS = (("00 06 82 02 FE 01", b"A"), ("01 04 E2 80 7F", b"A"), ("00 06 82 08 D5 83 80 7F", b"ABABABAB"),
           ("01 04 62 D4 7A 04 FC 03", b"ABABABAB"))  # fmt: skip


def test_plain_and_coded_literals_and_copies_that_overlap() -> None:
    for stream, plain in VECTORS:
        assert decompress(bytes.fromhex(stream)) == plain, stream
    for stream, plain in VECTORS[::2]:
        assert compress(plain) == bytes.fromhex(stream)


def test_copies_of_all_lengths_and_literals_of_all_values_come_back() -> None:
    lengths = [*range(1, 13), 15, 16, 23, 24, 39, 40, 71, 72, 135, 136, 263, 264, LONGEST]
    for text in [bytes(range(256)), *(bytes(length + 1) for length in lengths)]:
        assert decompress(compress(text)) == text
    assert [length for _, length, _ in _matches(bytes(2 * LONGEST + 64))] == [0, LONGEST, LONGEST, 63]
    assert [len(compress(b"ABCDEFGH"[:length])) for length in (0, 6, 7, 8)] == [4, 11, 12, 13]  # 9 bits each, and 16


def test_what_stands_4096_bytes_before_is_copied_and_not_what_stands_one_more() -> None:
    between = b"".join(bytes((n >> 7, 128 | n & 127)) for n in range(2050))
    for distance, copies in ((4096, [(3, 4096)]), (4097, [])):
        text = b"xyz" + between[: distance - 3] + b"xyz"
        assert [(length, behind) for _, length, behind in _matches(text) if length] == copies


def test_a_stream_is_as_long_as_it_may_be() -> None:
    assert decompress(compress(b"abcd"), 4) == b"abcd"
    with pytest.raises(CompressionError, match="longer than 3 bytes"):
        decompress(compress(b"abcd"), 3)


@pytest.mark.slow
def test_what_was_compressed_comes_back() -> None:
    seeded = random.Random(7)
    texts = [b"", b"A", b"ab", b"abc" * 700, bytes(10_000), seeded.randbytes(3_000),
             "".join(f"LD {n % 7}.{n % 16:02}\nOUT W{n}.00\n" for n in range(400)).encode()]  # fmt: skip
    for text in texts:
        assert decompress(compress(text)) == text
    assert len(compress(texts[-1])) < len(texts[-1]) // 2


def test_a_stream_that_is_cut_says_so_at_every_byte() -> None:
    stream = compress(b"LD 0.00\nOUT 100.00\n" * 20)
    for length in range(2, len(stream) - 1):
        with pytest.raises(CompressionError, match=r"it is cut|damaged"):
            decompress(stream[:length])


@pytest.mark.slow
def test_damage_is_told_and_a_flood_is_stopped() -> None:
    for stream, words in ((b"\x02\x06", "first two bytes"), (b"\x00\x07", "first two bytes"), (b"", "first two bytes"),
                          (bytes.fromhex("0006") + b"\xff" * 8, "before the beginning")):  # fmt: skip
        with pytest.raises(CompressionError, match=words):
            decompress(stream)
    with pytest.raises(CompressionError, match="longer than 1000 bytes"):
        decompress(compress(bytes(100_000)), 1000)


@pytest.mark.slow
def test_a_small_file_that_opens_to_more_than_a_project_may_have_is_refused() -> None:
    copies = compress(bytes(1 + 9 * LONGEST))
    assert copies[6:12] == copies[9:15]  # a copy of 518 bytes is 3 bytes
    with pytest.raises(CompressionError, match="longer than 67108864 bytes"):
        decompress(copies[:6] + copies[6:9] * (SOURCE_BYTES // LONGEST + 1))


@pytest.mark.slow
def test_any_bytes_are_decompressed_or_refused() -> None:
    seeded, most = random.Random(11), 5_000
    whole = compress("".join(f"LD {n % 7}.{n % 16:02}\nOUT W{n}.00\n" for n in range(20)).encode())
    sizes, refused = [], []
    for number in range(300):
        stream = bytearray(whole)
        if number % 3:
            stream[seeded.randrange(2, len(stream))] ^= 1 << seeded.randrange(8)
        else:
            stream[2:] = seeded.randbytes(60)
        try:
            sizes.append(len(decompress(bytes(stream), most)))
        except CompressionError as error:
            refused.append(str(error))
    assert len(sizes) > 50 and len(refused) > 150 and len(sizes) + len(refused) == 300
    assert max(sizes) <= most + LONGEST
    known = ("it is cut", "is damaged", f"longer than {most} bytes")
    assert [message for message in refused if not any(part in message for part in known)] == []
