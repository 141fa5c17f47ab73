"""A compiler that waits, for tests of what happens in the middle of a compilation."""

import os
import sysconfig

SCRIPT = """#!/bin/sh
case "$XDG_CACHE_HOME" in {caches}) until [ -e '{gate}' ]; do sleep 0.05; done;; esac
exec {compiler} "$@"
"""


def held_compiler(folder, caches="*"):
    """What to set CC to, and the file without which it compiles nothing into caches whose path is like this."""
    gate, script = folder / "gate", folder / "held_compiler"
    compiler = os.environ.get("CC") or sysconfig.get_config_var("CC")
    script.write_text(SCRIPT.format(caches=caches, gate=gate, compiler=compiler))
    script.chmod(0o755)
    return str(script), gate
