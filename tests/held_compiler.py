"""A compiler that waits, for tests of what happens in the middle of a compilation."""

import os

from cellmech.fem import compiler

SCRIPT = """#!/bin/sh
case "$PWD" in {caches}) until [ -e '{gate}' ]; do sleep 0.05; done;; esac
PATH='{path}' exec {compiler} "$@"
"""
CUSTOM = "import cellmech.fem.compiler as c\nc.SYSTEM = ({!r}, *c.SYSTEM)\n"


def held_compiler(folder, caches="*", path=""):
    """What to set PYTHONPATH to, and the file without which nothing is compiled into caches whose path is like this.

    What the environment says of compilers does not count, so Python is told as it starts.
    """
    gate, script = folder / "gate", folder / "held" / compiler.name()
    script.parent.mkdir()
    text = SCRIPT.format(caches=caches, gate=gate, path=compiler.search_path(), compiler=compiler.name())
    script.write_text(text)
    script.chmod(0o755)
    (folder / "site").mkdir()
    (folder / "site" / "sitecustomize.py").write_text(CUSTOM.format(str(script.parent)))
    return os.pathsep.join([str(folder / "site"), path]), gate
