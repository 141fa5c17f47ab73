"""Pictures for a page that stands alone: PNG files and films as text inside it."""

from __future__ import annotations

import base64
import io
from dataclasses import dataclass
from pathlib import Path

from PIL import Image

from cellmech.errors import InputError

WIDEST = 2000  # pixels: enough for a sharp page on paper


@dataclass(frozen=True)
class Picture:
    """An embedded picture: a data URI, and its size in pixels."""

    uri: str
    width: int
    height: int


def embed(path: Path) -> Picture | None:
    """A PNG file as a picture, made smaller if it is huge, or a GIF as it is; None if there is no such file.

    Raises:
        InputError: for a file that is no picture.
    """
    if not path.is_file():
        return None
    try:
        with Image.open(path) as image:
            content, size, kind = path.read_bytes(), image.size, "gif" if image.format == "GIF" else "png"
            if kind == "png" and image.width > WIDEST:
                size = (WIDEST, round(image.height * WIDEST / image.width))
                stream = io.BytesIO()
                small = image.convert("RGB").resize(size, Image.Resampling.LANCZOS)
                small.quantize(256, dither=Image.Dither.NONE).save(stream, "PNG", optimize=True)  # a third of the bytes
                content = stream.getvalue()
    except (OSError, ValueError) as error:
        raise InputError(str(path), "", f"is no PNG or GIF picture ({error})", None, "Draw it again.") from None
    return Picture(f"data:image/{kind};base64,{base64.b64encode(content).decode()}", *size)
