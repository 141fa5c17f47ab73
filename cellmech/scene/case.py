"""One scene of a study, under a name."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from cellmech.scene.scene import Scene


@dataclass(frozen=True)
class Case:
    """One scene of a study.

    Args:
        name: unique in the study, and safe as the name of a folder.
        scene: the complete input.
        swept: dotted key -> value of what sets this case apart, as written in the file.
    """

    name: str
    scene: Scene
    swept: dict[str, Any] = field(default_factory=dict)
