"""Results as JSON that shows damage: a seal on result.json, and in it the hashes of the files beside it."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

SEAL = "content_hash"  # key of result.json: SHA-256 of the rest


def plain(data: Any, key: str = "") -> Any:
    """The data as Python's own types, tuples and arrays as lists.

    Raises:
        ValueError: for NaN or infinity, naming its dotted key.
        TypeError: for what JSON cannot hold, likewise.
    """
    if hasattr(data, "tolist"):  # of NumPy
        data = data.tolist()
    if isinstance(data, Mapping):
        return {str(name): plain(value, f"{key}.{name}" if key else str(name)) for name, value in data.items()}
    if isinstance(data, list | tuple):
        return [plain(value, f"{key}.{i}") for i, value in enumerate(data)]
    if isinstance(data, float) and not math.isfinite(data):
        raise ValueError(f"{key} must be finite, got {data!r}")
    if not isinstance(data, str | bool | int | float | None):
        raise TypeError(f"{key}: a {type(data).__name__} does not fit into JSON")
    return data


def json_text(data: Mapping[str, Any]) -> str:
    """The data as JSON; raises as `plain`."""
    return json.dumps(plain(data), indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def sealed(result: Mapping[str, Any]) -> str:
    """The text of result.json, with the hash of its content; raises as `plain`."""
    content = {key: value for key, value in result.items() if key != SEAL}
    return json_text({**content, SEAL: hashlib.sha256(json_text(content).encode()).hexdigest()})


def is_whole(result: Mapping[str, Any]) -> bool:
    """True if the content of a result.json is what was written."""
    try:
        return bool(json.loads(sealed(result))[SEAL] == result.get(SEAL))
    except ValueError:  # a number that has become NaN
        return False


def file_hashes(paths: Iterable[Path]) -> dict[str, str]:
    """SHA-256 of files of one folder by name."""
    return {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in paths}


def damage(folder: Path, files: Mapping[str, str]) -> str:
    """The first of these files that is not there or not what was written, and what it is; "" if none.

    Args:
        folder: of the case.
        files: its `file_hashes` when result.json was written.
    """
    for name, known in files.items():
        try:
            if file_hashes([folder / name])[name] != known:
                return f"{name} is damaged"
        except OSError as error:
            return f"{name} cannot be read ({error.strerror})"
    return ""
