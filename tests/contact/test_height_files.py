"""Height maps from images and tables that are damaged, huge or none: one sentence, before they are read."""

from __future__ import annotations

import os
import struct
import time
import tracemalloc
import zlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from fesd_robot.contact.ground.heights import read_heights, read_image
from fesd_robot.errors import GroundError
from fesd_robot.ranges import MAX_IMAGE_BYTES, MAX_TABLE_BYTES


def _chunk(kind: bytes, content: bytes) -> bytes:
    return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))


def png(width: int, height: int, bits: int = 8) -> bytes:
    """Return a small file whose header says that it is a grey image of this size."""
    header = struct.pack(">IIBBBBB", width, height, bits, 0, 0, 0, 0)
    return (
        b"\x89PNG\r\n\x1a\n"
        + _chunk(b"IHDR", header)
        + _chunk(b"IDAT", zlib.compress(bytes(1000)))
        + _chunk(b"IEND", b"")
    )


@pytest.fixture
def good(tmp_path: Path) -> bytes:
    """A grey image of 8 x 8 pixels."""
    Image.fromarray(np.arange(64, dtype=np.uint8).reshape(8, 8)).save(tmp_path / "good.png")
    return (tmp_path / "good.png").read_bytes()


@pytest.mark.parametrize(("width", "height"), [(60000, 60000), (10000, 10000), (2**31 - 1, 2), (1, 8), (101, 100)])
def test_the_header_says_how_many_pixels(tmp_path: Path, width: int, height: int) -> None:
    """Too many, or too few, are refused without reading one, with what was found and expected."""
    (tmp_path / "hills.png").write_bytes(png(width, height))
    tracemalloc.start()
    with pytest.raises(GroundError, match=rf"hills.png has {width} x {height} pixels, expected .* at most 10000"):
        read_image(tmp_path / "hills.png", (1.0, 1.0), 1.0, None)
    assert tracemalloc.get_traced_memory()[1] < 20e6
    tracemalloc.stop()


DAMAGES: dict[str, Callable[[bytes], bytes]] = {
    "empty": lambda _: b"",
    "signature alone": lambda good: good[:8],
    "cut header": lambda good: good[:20],
    "cut pixels": lambda good: good[:-30],
    "one byte of the pixels": lambda good: good[:-25] + bytes([good[-25] ^ 0xFF]) + good[-24:],
    "one byte of the header": lambda good: good[:26] + b"\x09" + good[27:],
    "noise": lambda _: bytes(range(256)) * 4,
    "text": lambda _: b"x,z\n0,0\n",
    "no kind of chunk": lambda good: good[:37] + bytes(4) + good[41:],
}


@pytest.mark.parametrize("damage", DAMAGES.values(), ids=DAMAGES)
def test_a_damaged_image_is_a_sentence(tmp_path: Path, good: bytes, damage: Callable[[bytes], bytes]) -> None:
    """It names the file and what was expected."""
    (tmp_path / "bad.png").write_bytes(damage(good))
    with pytest.raises(GroundError, match=r"bad.png cannot be read as an image, expected a grey PNG file"):
        read_image(tmp_path / "bad.png", (1.0, 1.0), 1.0, None)


def test_an_image_of_another_format_is_refused(tmp_path: Path) -> None:
    """Only PNG is read, whatever the file is called."""
    Image.fromarray(np.zeros((8, 8), dtype=np.uint8)).save(tmp_path / "other.png", "JPEG")
    with pytest.raises(GroundError, match="expected a grey PNG file"):
        read_image(tmp_path / "other.png", (1.0, 1.0), 1.0, None)


@pytest.mark.parametrize("name", ["heights.csv", "heights.png"])
def test_a_huge_file_is_refused_before_it_is_read(tmp_path: Path, name: str) -> None:
    """Its size says so."""
    file, most = tmp_path / name, MAX_IMAGE_BYTES if name.endswith("png") else MAX_TABLE_BYTES
    with file.open("wb") as stream:
        stream.truncate(10 * most)
    begin = time.perf_counter()
    with pytest.raises(GroundError, match=rf"found 200 MB, expected at most {most / 1e6:g} MB"):
        _read(file)
    assert time.perf_counter() - begin < 1.0


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes with names")
@pytest.mark.parametrize("name", ["heights.csv", "heights.png"])
def test_a_pipe_is_no_file(tmp_path: Path, name: str) -> None:
    """Nobody waits for what it may say."""
    os.mkfifo(tmp_path / name)
    with pytest.raises(GroundError, match="found no regular file, expected one"):
        _read(tmp_path / name)


def _read(file: Path) -> object:
    return read_image(file, (1.0, 1.0), 1.0, None) if file.suffix == ".png" else read_heights(file)
