"""Building and running the container image: with Docker or Podman, or on a Debian machine without either."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
IMAGE = "cellmech"
BASE = "docker.io/library/debian:trixie-slim"


class Engine:
    """Docker or Podman.

    Args:
        program: its name.
    """

    def __init__(self, program: str) -> None:
        self.program = program

    def build(self) -> None:
        """Build the image from the Dockerfile."""
        subprocess.run([self.program, "build", "--tag", IMAGE, "."], cwd=ROOT, check=True)

    def run(self, *command: str, results: Path | None = None, user: str = "") -> subprocess.CompletedProcess[str]:
        """Run a command, or what the image runs by itself, in a new container; its output is kept.

        Args:
            command: and its arguments; none for the image's own.
            results: folder that is /results inside.
            user: UID:GID; none for the image's own.
        """
        options = [f"--user={user}"] * bool(user) + [f"--volume={results}:/results"] * (results is not None)
        return _output([self.program, "run", "--rm", *options, IMAGE, *command])

    def size(self) -> int:
        """Of the image [bytes]."""
        return int(self._look("image", "inspect", "--format", "{{.Size}}", IMAGE))

    def _look(self, *arguments: str) -> str:
        return subprocess.run([self.program, *arguments], check=True, capture_output=True, text=True).stdout.strip()


class Buildah(Engine):
    """Buildah in a chroot, as root, for a machine whose kernel or rights do not do for an engine.

    The base is made by debootstrap, once, under the name by which the Dockerfile takes it. A mirror is told to it as
    MIRROR, and to pip in /etc/pip.conf, which builds see together with this machine's certificates.

    Args:
        work: folder for the base and for copies of this machine's settings.
    """

    def __init__(self, work: Path) -> None:
        super().__init__("buildah")
        os.environ.update(BUILDAH_ISOLATION="chroot")
        self.work, self.host = work, work / "host"
        if missing := [name for name in ("buildah", "debootstrap") if shutil.which(name) is None]:
            sys.exit(f"container-check: install {' and '.join(missing)} (apt-get install), or Docker or Podman")
        if os.geteuid():
            sys.exit("container-check: without Docker or Podman this needs root")

    def build(self) -> None:
        """Build the image from the unchanged Dockerfile, on a base that is made if it is missing."""
        if subprocess.run(["buildah", "inspect", "--type=image", BASE], capture_output=True).returncode:
            self._make_base()
        command = ["buildah", "bud", "--layers", "--pull-never", *self._settings(), "--tag", IMAGE, "."]
        subprocess.run(command, cwd=ROOT, check=True)

    def run(self, *command: str, results: Path | None = None, user: str = "") -> subprocess.CompletedProcess[str]:
        """As with an engine; Buildah itself does not know what the image runs by itself."""
        options = [f"--user={user}"] * bool(user) + [f"--volume={results}:/results:rw"] * (results is not None)
        command = command or tuple(json.loads(self._look("inspect", "--type=image", IMAGE))["OCIv1"]["config"]["Cmd"])
        container = self._look("from", "--pull-never", IMAGE)
        try:
            return _output(["buildah", "run", *self._settings(), *options, container, "--", *command])
        finally:
            self._look("rm", container)

    def size(self) -> int:
        """Of the image [bytes]: of the files in it."""
        container = self._look("from", "--pull-never", IMAGE)
        try:
            return 1024 * int(_output(["du", "-skx", self._look("mount", container)]).stdout.split()[0])
        finally:
            self._look("rm", container)

    def _make_base(self) -> None:
        """Debian 13 as small as the official image, but for what that leaves out of packages."""
        tree = self.work / "trixie"
        shutil.rmtree(tree, ignore_errors=True)
        tree.parent.mkdir(parents=True, exist_ok=True)
        mirror = os.environ.get("MIRROR") or "http://deb.debian.org/debian"
        subprocess.run(["debootstrap", "--variant=minbase", "trixie", tree, mirror], check=True)
        for left in ("var/cache/apt/archives", "var/lib/apt/lists"):
            shutil.rmtree(tree / left)
        container = self._look("from", "scratch")
        self._look("add", "--quiet", container, str(tree), "/")
        self._look("config", "--cmd", "bash", container)
        self._look("commit", "--quiet", "--format=docker", "--rm", container, BASE)
        shutil.rmtree(tree)

    def _settings(self) -> list[str]:
        """Mounts that bring pip's settings and this machine's certificates into a container, not into the image."""
        pip, certificates = Path("/etc/pip.conf"), Path("/etc/ssl/certs/ca-certificates.crt")
        if not (pip.exists() and certificates.exists()):
            return []
        self.host.mkdir(parents=True, exist_ok=True)
        shutil.copy(certificates, self.host / "certificates.crt")
        text = pip.read_text().replace(str(certificates), "/run/host/certificates.crt")
        (self.host / "pip.conf").write_text(text)
        return [f"--volume={self.host}:/run/host:ro", f"--volume={self.host}/pip.conf:/etc/pip.conf:ro"]


def engine_at_hand(work: Path) -> Engine:
    """Docker or Podman if one answers, else Buildah."""
    for program in ("docker", "podman"):
        if shutil.which(program) and not subprocess.run([program, "info"], capture_output=True).returncode:
            return Engine(program)
    return Buildah(work)


def _output(command: Sequence[str]) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        command,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # a shell's background job ignores Ctrl-C
    )
