"""Entry points of the programs: they load a command, which takes seconds, and run it.

Ctrl-C while a command loads ends in one line, and --version loads nothing.
"""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib import import_module
from types import FrameType

from solidtex_export import __version__

INTERRUPTED = 130

Main = Callable[[list[str] | None], int]


def _program(name: str, module: str) -> Main:
    def main(arguments: list[str] | None = None) -> int:
        if (sys.argv[1:] if arguments is None else arguments) == ["--version"]:
            print(f"{name} {__version__}")
            return 0
        with _interruptible(name):
            command: Main = import_module(f"solidtex_export.commands.{module}").main
        try:
            return command(arguments)
        except KeyboardInterrupt:
            _say_interrupted(name)
            return INTERRUPTED

    return main


@contextmanager
def _interruptible(name: str) -> Iterator[None]:
    """End the process at Ctrl-C. Packages that are half imported may drop an exception."""

    def end(_signal: int, _frame: FrameType | None) -> None:
        _say_interrupted(name)
        os._exit(INTERRUPTED)

    if signal.getsignal(signal.SIGINT) is not signal.default_int_handler:  # ignored, with nohup say
        yield
        return
    signal.signal(signal.SIGINT, end)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def _say_interrupted(name: str) -> None:
    print(f"{name}: interrupted", file=sys.stderr, flush=True)


train = _program("solidtex-train", "train")
train_space = _program("solidtex-train-space", "train_space")
export = _program("solidtex-export", "export")
export_space = _program("solidtex-export-space", "export_space")
evaluate = _program("solidtex-eval", "evaluate")
measure = _program("solidtex-measure", "measure")
fidelity = _program("solidtex-fidelity", "fidelity")
export_onnx = _program("solidtex-export-onnx", "export_onnx")
export_shader = _program("solidtex-export-shader", "export_shader")
view = _program("solidtex-view", "view")
solids = _program("solidtex-solids", "solids")
pretrain_descriptor = _program("solidtex-pretrain-descriptor", "pretrain_descriptor")
import_solidtexturenets = _program("solidtex-import-solidtexturenets", "import_solidtexturenets")
