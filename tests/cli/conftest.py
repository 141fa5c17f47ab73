"""Running the command line in this process, on a fake solver."""

import pytest
from cli import fake_case
from cli.programs import Outcome

from cellmech.runs.study import main


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """An empty folder to work in."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def fake(folder, capsys):
    """Run the command line in this process on the fake solver; `solved` names the cases it solved."""

    class Fake:
        solved = ()

        def __call__(self, *arguments):
            fake_case.solved.clear()
            status = main(arguments, lambda: fake_case)
            self.solved = tuple(fake_case.solved)
            return Outcome(status, *capsys.readouterr())

    return Fake()
