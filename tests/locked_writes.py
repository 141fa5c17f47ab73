"""Looking whether a module writes into a case's folder while it keeps other processes out."""

import pytest

from cellmech.results.archive import alone_in


def locked_writes(module, monkeypatch):
    """The names of the files that the module's `write_whole` writes from now on; each must be under the lock."""
    write, met = module.write_whole, []

    def look_and_write(path, text):
        with pytest.raises(BlockingIOError), alone_in(path.parent):
            pass
        met.append(path.name)
        write(path, text)

    monkeypatch.setattr(module, "write_whole", look_and_write)
    return met
