"""Collada files made ready for the viewer: textures inside, and all parts with the same vertex attributes."""

from __future__ import annotations

import base64
import contextlib
import io
import logging
import mimetypes
import re
from functools import cache
from pathlib import Path
from typing import NamedTuple

from PIL import Image

from fesd_robot.ranges import MAX_IMAGE_BYTES, too_large

logger = logging.getLogger(__name__)

PRIMITIVE = re.compile(r"<(triangles|polylist|polygons|trifans|tristrips)\b([^>]*)>(.*?)</\1>", re.DOTALL)
VERTICES = re.compile(r"<vertices\b[^>]*\bid\s*=\s*[\"']([^\"']+)[\"'][^>]*>(.*?)</vertices>", re.DOTALL)
INPUT = re.compile(r"<input\b[^>]*?\bsemantic\s*=\s*[\"'](\w+)[\"'][^>]*>")
SOURCE = re.compile(r"\bsource\s*=\s*[\"']#([^\"']+)[\"']")
IMAGE = re.compile(r"<init_from>\s*([^<]*\.\w+)\s*</init_from>")
UNIT = re.compile(r"<unit\b[^>]*\bmeter\s*=\s*[\"']([^\"']+)[\"']")
UNIT_WITHIN = 100_000
"""Characters within which a file names its unit: the asset element comes first."""

TEXTURE_PIXELS = 1024
"""Longest side of an image in a page."""

NO_UV = (
    '<source id="no-uv"><float_array id="no-uv-array" count="2">0 0</float_array><technique_common>'
    '<accessor source="#no-uv-array" count="1" stride="2"/></technique_common></source>'
)
NO_UV_INPUT = '<input semantic="TEXCOORD" source="#no-uv" offset="0" set="0"/>'
BLANK_IMAGE = "data:image/gif;base64,R0lGODlhAQABAIAAAP///wAAACH5BAAAAAAALAAAAAABAAEAAAICRAEAOw=="


_NO_IMAGE = (OSError, EOFError, SyntaxError, ValueError, Image.DecompressionBombError)
"""What opening an image that is none, or claims to be huge, may raise; it goes to the page as it is."""


class Collada(NamedTuple):
    """One Collada file.

    Args:
        text: the document.
        resources: name of each image in it -> the image as a data URL.
    """

    text: str
    resources: dict[str, str]


def read_collada(path: Path) -> Collada:
    """Read a Collada file with all that it refers to.

    The viewer merges the parts of a file into one mesh and gives up if one part has texture coordinates, normals or
    colours and another has not. Parts without texture coordinates get unused ones; normals and colours that are not
    everywhere are dropped (the viewer computes normals where there are none).
    """
    text = path.read_text(encoding="utf-8", errors="replace")
    return Collada(_uniform(text), _textures(path, text))


def collada_unit(path: Path) -> float:
    """Return the length of a Collada file's unit, m."""
    with path.open(encoding="utf-8", errors="replace") as file:
        unit = UNIT.search(file.read(UNIT_WITHIN))
    return float(unit.group(1)) if unit else 1.0


def _uniform(text: str) -> str:
    """Return the document with the same vertex attributes in every part."""
    shared = {match.group(1): set(INPUT.findall(match.group(2))) for match in VERTICES.finditer(text)}
    parts = [_semantics(match.group(3), shared) for match in PRIMITIVE.finditer(text) if "<p>" in match.group(3)]
    if not parts or all(part == parts[0] for part in parts):
        return text
    keep = set.intersection(*parts) | {"VERTEX", "POSITION", "TEXCOORD"}
    textured = any("TEXCOORD" in part for part in parts)

    def rename(match: re.Match[str]) -> str:
        semantic = match.group(1)
        return match.group(0) if semantic in keep else match.group(0).replace(semantic, "UNUSED", 1)

    def complete(match: re.Match[str]) -> str:
        kind, attributes, body = match.groups()
        missing = textured and "TEXCOORD" not in _semantics(body, shared)
        return f"<{kind}{attributes}>{NO_UV_INPUT if missing else ''}{INPUT.sub(rename, body)}</{kind}>"

    text = VERTICES.sub(lambda match: INPUT.sub(rename, match.group(0)), PRIMITIVE.sub(complete, text))
    return re.sub(r"<vertices\b", lambda match: NO_UV + match.group(0), text) if textured else text


def _semantics(body: str, shared: dict[str, set[str]]) -> set[str]:
    """Return the vertex attributes of one part, its own and those it shares through its vertices."""
    semantics: set[str] = set()
    for match in INPUT.finditer(body):
        source = SOURCE.search(match.group(0))
        semantics |= shared.get(source.group(1), set()) if match.group(1) == "VERTEX" and source else {match.group(1)}
    return semantics


def _textures(path: Path, text: str) -> dict[str, str]:
    """Return the images that the document names as data URLs; a missing one is white."""
    resources = {}
    for name in IMAGE.findall(text):
        image = (path.parent / name.removeprefix("file://")).resolve()
        fault = too_large(image, MAX_IMAGE_BYTES) if image.is_file() else "is missing"
        if not fault:
            resources[name] = _data_url(image)
        else:
            logger.warning("%s: texture %s is drawn white: %s", path.name, name, fault)
            resources[name] = BLANK_IMAGE
    return resources


@cache
def _data_url(image: Path) -> str:
    """Return an image as a data URL, made smaller if it has more pixels than one sees on a robot."""
    content, kind = image.read_bytes(), mimetypes.guess_type(image.name)[0] or "image/png"
    with contextlib.suppress(*_NO_IMAGE), Image.open(io.BytesIO(content)) as picture:
        form = picture.format
        if max(picture.size) > TEXTURE_PIXELS:
            picture.thumbnail((TEXTURE_PIXELS, TEXTURE_PIXELS))
            smaller = io.BytesIO()
            picture.save(smaller, form)
            content = min(content, smaller.getvalue(), key=len)
    return f"data:{kind};base64,{base64.b64encode(content).decode('ascii')}"
