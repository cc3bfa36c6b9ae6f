"""The programs of solidtex: where they are, and how one runs beside Blender."""

from __future__ import annotations

import contextlib
import fcntl
import os
import pty
import re
import shutil
import signal
import subprocess
import termios
from collections.abc import Sequence
from pathlib import Path

import bpy

USUAL = ("~/.local/bin", "/usr/local/bin", "/usr/bin")
CANCEL_SECONDS = 10.0
WAIT_SECONDS = 0.1
# What solidtex-bake prints to a terminal: "Baking marble  12 %  0:10 left".
PROGRESS = re.compile(r"(\d+) %")


class ProgramError(RuntimeError):
    """A message for the user."""


def preferences() -> bpy.types.AddonPreferences:
    return bpy.context.preferences.addons[__package__].preferences


def folders() -> list[Path]:
    """Where programs are looked for, best first."""
    chosen = preferences().programs
    path = os.environ.get("PATH", "").split(os.pathsep)
    names = [bpy.path.abspath(chosen)] if chosen else [*path, *USUAL]
    return list(dict.fromkeys(Path(name).expanduser() for name in names if name))


def find(name: str) -> Path:
    """The program `name`, or an error that says what to do."""
    found = shutil.which(name, path=os.pathsep.join(map(str, folders())))
    if found is None:
        where = ", ".join(map(str, folders()))
        raise ProgramError(
            f"Found no program {name} in {where}. Install solidtex, or set the folder of its "
            "programs in Edit > Preferences > Add-ons > Solidtex"
        )
    return Path(found)


def _hang_up_with_terminal() -> None:
    """Let this process belong to the terminal on its standard output: when Blender ends, even by
    force, the terminal closes, and the system tells the process (SIGHUP) to end as by Ctrl-C.
    """
    fcntl.ioctl(1, termios.TIOCSCTTY, 0)


class Job:
    """A program that runs beside Blender, and not longer."""

    def __init__(self, command: Sequence[str | Path]) -> None:
        # A program reports its progress to a terminal.
        self._terminal, end = pty.openpty()
        os.set_blocking(self._terminal, False)
        self._talk = ""
        self.progress = 0.0
        self.name = Path(command[0]).name
        try:
            self._process = subprocess.Popen(
                [str(word) for word in command],
                stdin=subprocess.DEVNULL, stdout=end, stderr=end, start_new_session=True,
                preexec_fn=_hang_up_with_terminal,
            )  # fmt: skip
        except OSError as error:
            os.close(self._terminal)
            raise ProgramError(f"{command[0]}: {error.strerror}, expected a program") from error
        finally:
            os.close(end)

    def is_running(self) -> bool:
        """Whether the program still runs; raises ProgramError when it has failed."""
        code = self._process.poll()
        self._read()
        if code is None:
            return True
        self._close()
        if code != 0:
            raise ProgramError(self._last_words() or f"{self.name} ended with the code {code}")
        return False

    def wait(self) -> None:
        """Wait a moment, or until the program ends. Its terminal must be read in between."""
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(WAIT_SECONDS)

    def cancel(self) -> None:
        """End the program as Ctrl-C does: it leaves no file behind."""
        if self._process.poll() is None:
            self._process.send_signal(signal.SIGINT)
            try:
                self._process.wait(CANCEL_SECONDS)
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait()
        self._close()

    def _close(self) -> None:
        if self._terminal >= 0:
            os.close(self._terminal)
            self._terminal = -1

    def _read(self) -> None:
        if self._terminal < 0:
            return
        try:
            while part := os.read(self._terminal, 65536):
                self._talk += part.decode(errors="replace")
        except OSError:
            pass  # nothing more for now, or the program has ended
        if found := PROGRESS.findall(self._talk):
            self.progress = int(found[-1]) / 100

    def _last_words(self) -> str:
        """Lines of the program's own errors."""
        lines = re.split(r"[\r\n]+", self._talk.replace("\033[K", ""))
        said = [line for line in lines if line.startswith(f"{self.name}: ")]
        return "\n".join(said)
