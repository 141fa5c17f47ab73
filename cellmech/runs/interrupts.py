"""Ctrl-C and SIGTERM as an exception that leaves the files in order."""

from __future__ import annotations

import os
import signal
import threading
import time
from types import FrameType, TracebackType
from typing import Any

AGAIN_S = 1.0  # a second signal this much later ends the process at once


class Interrupted(BaseException):
    """SIGINT or SIGTERM; no Exception, so that nothing takes it for a failure of a case."""

    def __init__(self, signum: int) -> None:
        self.signum = signum
        super().__init__(signal.Signals(signum).name)


class Interrupts:
    """While entered, SIGINT and SIGTERM raise `Interrupted`; one that is ignored from outside (nohup, &) stays so."""

    def __enter__(self) -> Interrupts:
        self.seen, self.when = 0, 0.0
        self.before: dict[int, Any] = {}
        if threading.current_thread() is not threading.main_thread():
            return self  # signals come to the main thread, and are its affair
        handlers = {signum: signal.getsignal(signum) for signum in (signal.SIGINT, signal.SIGTERM)}
        self.before = {signum: handler for signum, handler in handlers.items() if handler is not signal.SIG_IGN}
        self.arm()
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        for signum, handler in self.before.items():
            signal.signal(signum, handler)

    def arm(self) -> None:
        """Take the signals; to be called again after libraries that take them for themselves, as Gmsh and PETSc do."""
        for signum in self.before:
            signal.signal(signum, self._handle)
        if self.before:
            signal.signal(signal.SIGPIPE, signal.SIG_IGN)  # as Python has it: a reader that goes away is an OSError

    def check(self) -> None:
        """Raise for a signal whose exception got lost in a callback, where Python drops exceptions."""
        self.arm()
        if self.seen:
            raise Interrupted(self.seen)

    def _handle(self, signum: int, frame: FrameType | None) -> None:
        if not self.seen:
            self.seen, self.when = signum, time.monotonic()
            raise Interrupted(signum)
        if time.monotonic() > self.when + AGAIN_S:
            os._exit(128 + signum)
