"""Command lines of `cellmech.study`, one after the other in this process; `tools/fuzz.py` asks and judges.

A line on standard input is a folder and arguments as JSON; one on standard output is status, output and messages.
"""

import json
import os
import resource
import sys
import tempfile
import traceback

from cellmech.runs.study import main


def captured(arguments: list[str]) -> tuple[int | None, str, str]:
    """Status, standard output and error output, those of libraries included; status None for an exception."""
    kept, files = (os.dup(1), os.dup(2)), (tempfile.TemporaryFile(), tempfile.TemporaryFile())
    try:
        os.dup2(files[0].fileno(), 1)
        os.dup2(files[1].fileno(), 2)
        status: int | None = None
        try:
            status = main(arguments)
        except BaseException:
            traceback.print_exc()
        sys.stdout.flush()
        sys.stderr.flush()
    finally:
        os.dup2(kept[0], 1)
        os.dup2(kept[1], 2)
        for number in kept:
            os.close(number)
    texts = []
    for file in files:
        file.seek(0)
        texts.append(file.read().decode("utf-8", errors="backslashreplace"))
        file.close()
    return status, texts[0], texts[1]


def serve() -> None:
    """Answer until the input ends."""
    memory = int(sys.argv[1])
    resource.setrlimit(resource.RLIMIT_AS, (memory, memory))
    for line in sys.stdin:
        folder, arguments = json.loads(line)
        os.chdir(folder)
        status, out, err = captured(arguments)
        print(json.dumps({"status": status, "out": out, "err": err}), flush=True)


if __name__ == "__main__":
    serve()
