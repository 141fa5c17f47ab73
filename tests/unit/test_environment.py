"""The environment that set-up makes: pip may not replace what DOLFINx was built with."""

import sys
from configparser import RawConfigParser
from importlib import metadata
from pathlib import Path
from urllib.parse import unquote, urlparse

from cellmech.surroundings import refuse_other_numpy


def test_pip_of_this_environment_holds_debians_versions():
    config = RawConfigParser()
    assert config.read(Path(sys.prefix) / "pip.conf")
    held = Path(unquote(urlparse(config["install"]["constraint"]).path)).read_text().split()
    assert {f"{name}=={metadata.version(name)}" for name in ("numpy", "scipy", "matplotlib")} < set(held)
    assert "matplotlib-inline<0.2" in held


def test_own_numpy_is_no_other():
    refuse_other_numpy()
