"""Completion scripts for shells, generated from the options of a parser."""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from typing import Any

SHELLS = ("bash", "zsh", "fish")
HAS_MEANING = str.maketrans("", "", "'\"[]:`$\\")


class Completion(argparse.Action):
    """Print the script of a shell and exit."""

    def __call__(
        self,
        parser: argparse.ArgumentParser,
        _namespace: argparse.Namespace,
        values: str | Sequence[Any] | None,
        _option: str | None = None,
    ) -> None:
        print(script(parser, str(values)))
        parser.exit()


def script(p: argparse.ArgumentParser, shell: str) -> str:
    if shell == "bash":
        names = " ".join(f"--{name}" for name, _, _ in _options(p))
        return f"complete -o default -o bashdefault -W '{names}' {p.prog}"
    if shell == "zsh":
        lines = [f"#compdef {p.prog}\n_arguments '*:file:_files'"]
        for name, description, action in _options(p):
            values = f"({' '.join(map(str, action.choices))})" if action.choices else "_files"
            value = "" if action.nargs == 0 else f":value:{values}"
            lines.append(f"'--{name}[{description}]{value}'")
        return " \\\n  ".join(lines)
    return "\n".join(
        f"complete -c {p.prog} -l {name} -d '{description}'"
        + ("" if action.nargs == 0 else " -r")
        + (f" -f -a '{' '.join(map(str, action.choices))}'" if action.choices else "")
        for name, description, action in _options(p)
    )


def _options(p: argparse.ArgumentParser) -> Iterator[tuple[str, str, argparse.Action]]:
    """Long names, descriptions on one line, and actions."""
    formatter = argparse.HelpFormatter(p.prog)
    for action in p._actions:
        if action.help == argparse.SUPPRESS:
            continue
        text = formatter._expand_help(action) if action.help else ""
        for name in action.option_strings:
            if name.startswith("--"):
                yield name[2:], " ".join(text.translate(HAS_MEANING).split()), action
