"""Shared parts of the commands: --version, examples, exit codes 0, 1 (failed) and 2 (usage)."""

from __future__ import annotations

import argparse
import difflib
import json
import os
import re
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, redirect_stderr, redirect_stdout, suppress
from pathlib import Path
from typing import Any, NoReturn, TextIO

from solidtex_export import __version__
from solidtex_export.commands.completion import SHELLS, Completion
from solidtex_export.export.file_format.checks import ModelFileError
from solidtex_export.export.lattice_state import StateError
from solidtex_export.export.verification import engine
from solidtex_export.export.verification.model_output import OutputError
from solidtex_export.images.channels import Reading
from solidtex_export.images.exemplar import Exemplar
from solidtex_export.images.file_kinds import ExemplarError
from solidtex_export.images.value_range import Range, parse_range
from solidtex_export.settings import SettingsError, read_toml

FAILURES = (ModelFileError, OutputError, StateError, OSError)


NUMBERS = {"int": "a whole number", "float": "a number"}


class Parser(argparse.ArgumentParser):
    """Argument parser whose errors are one line: what was found, and what was expected."""

    _arguments: Sequence[str] = ()
    _errors: TextIO | None = None
    """Standard error as it was before --quiet dropped remarks."""

    def error(self, message: str) -> NoReturn:
        lacks_some = message.startswith("the following arguments are required")
        if lacks_some and (unknown := self._unknown_options()):
            message = f"unrecognized arguments: {' '.join(unknown)}; {message}"
        errors = self._errors or sys.stderr
        print(f"{self.prog}: {_in_words(message)}{self._suggestion(message)}", file=errors)
        print(f"See {self.prog} --help for all options.", file=errors)
        raise SystemExit(2)

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """Put the options of --config FILE before those of the command line, which go first."""
        self._errors = sys.stderr
        args = list(sys.argv[1:] if args is None else args)
        first = argparse.ArgumentParser(add_help=False, allow_abbrev=False)
        first.add_argument("--config", type=Path)
        first.exit_on_error = False
        try:
            config = first.parse_known_args(args)[0].config
        except argparse.ArgumentError:
            config = None  # reported below
        if config is not None:
            args = [*self._options_of(config), *args]
        args = self._with_values(args)
        self._arguments = args
        return super().parse_known_args(args, namespace)

    def _with_values(self, args: list[str]) -> list[str]:
        """Join options with values such as -.wgsl, -1um and -1,5.

        argparse takes those for options of their own.
        """
        args = list(args)
        for place in range(len(args) - 2, -1, -1):
            action = self._option_string_actions.get(args[place])
            if action and action.nargs is None and re.match(r"-[.\d]", args[place + 1]):
                joint = "=" if args[place].startswith("--") else ""
                args[place : place + 2] = [f"{args[place]}{joint}{args[place + 1]}"]
        return args

    def _unknown_options(self) -> list[str]:
        """Unknown options of a command line that lacks arguments, which argparse reports first."""
        for action in self._actions:
            action.required = False
        unknown = super().parse_known_args(self._arguments)[1]
        return [argument for argument in unknown if argument.startswith("-")]

    def _suggestion(self, message: str) -> str:
        """What to say of unknown options: those with almost their names."""
        unknown, _, _ = message.partition(";")
        if not unknown.startswith("unrecognized arguments:"):
            return ""
        names = [word.partition("=")[0] for word in unknown.split() if word.startswith("--")]
        near = [difflib.get_close_matches(name, self._option_string_actions) for name in names]
        found = [matches[0] for matches in near if matches]
        return f"; did you mean {' and '.join(found)}?" if found else ""

    def _options_of(self, config: Path) -> list[str]:
        """Arguments of a TOML file: option = value, true for a flag, a list to repeat an option;
        `arguments` is the list of those without an option.
        """
        try:
            table = read_toml(config)
        except SettingsError as error:
            self.error(f"--config: {error}")
        options: list[str] = []
        for name, value in table.items():
            values = [str(v) for v in (value if isinstance(value, list) else [value])]
            option = f"-{name}" if len(name) == 1 else f"--{name}"
            if name == "arguments":
                options += values
            elif option not in self._option_string_actions:
                self.error(f"--config: {config}: found an unknown option {name}, see --help")
            elif isinstance(value, bool):
                options += [option] * value
            else:
                options += [part for v in values for part in (option, v)]
        return options


def _in_words(message: str) -> str:
    """Rewrite messages of argparse as this package writes its own."""
    message = re.sub(r"^argument (\S+?)(/\S+)?: ", r"\1: ", message)
    if number := re.fullmatch(r"(\S+): invalid (int|float) value: '(.*)'", message):
        option, kind, found = number.groups()
        return f"{option}: found {found}, expected {NUMBERS[kind]}"
    if choice := re.fullmatch(r"(\S+): invalid choice: '?(.*?)'? \(choose from (.*)\)", message):
        option, found, allowed = choice.groups()
        return f"{option}: found {found}, expected one of {allowed.replace(chr(39), '')}"
    return message


def parser(
    program: str, description: str, examples: str, has_json: bool = True
) -> argparse.ArgumentParser:
    """Argument parser with --version, and with examples below its help.

    has_json: whether --json prints what the command returns; some have a --json FILE of their own.
    """
    p = Parser(
        prog=program,
        description=description,
        epilog="examples:\n" + examples,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    p.add_argument("--version", action="version", version=f"%(prog)s {__version__}")
    p.add_argument("--config", metavar="FILE", type=Path,
                   help="read options from a TOML file; the command line goes first")  # fmt: skip
    p.add_argument("-q", "--quiet", action="store_true", help="print results and errors only")
    if has_json:
        p.add_argument("--json", action="store_true",
                       help="print the results as JSON to standard output")  # fmt: skip
    p.add_argument("--completion", action=Completion, choices=SHELLS,
                   help="print a completion script for this shell and exit")  # fmt: skip
    return p


def add_model_arguments(p: argparse.ArgumentParser) -> None:
    """Add the options of a command that writes a model."""
    add_output_arguments(p, "MODEL", ".solidtex")
    p.add_argument("--name", help="name of the material (default: that of MODEL)")
    p.add_argument("--license", help="licence of the model, an SPDX expression")


def add_model_argument(p: argparse.ArgumentParser, name: str = "model", **options: Any) -> None:
    """Add the model, or the models, that a command reads."""
    p.add_argument(name, metavar="SOLIDTEX", type=Path,
                   help="a .solidtex file, or the name of a shipped model", **options)  # fmt: skip


def add_output_arguments(p: argparse.ArgumentParser, name: str, suffix: str) -> None:
    """Add the options of a command that writes one file; -o - writes it to standard output."""
    p.add_argument("-o", dest="output", metavar=name, type=Path, required=True,
                   help=f"the {suffix} file to write, or - for standard output")  # fmt: skip
    p.set_defaults(piped_suffix=suffix)
    p.add_argument("--force", action="store_true", help=f"replace {name} if it exists")


def add_reading_arguments(p: argparse.ArgumentParser) -> None:
    """Add the options of a command that reads photographs: conversion of pixels to channels."""
    p.add_argument("--range", dest="ranges", metavar="[NAME=]RANGE", action="append", default=[],
                   type=named_range,
                   help="scale the values LOW,HIGH of the photograph, or of the map NAME, to"
                   " 0 ... 1; full: the whole range of the file's type, floats unchanged; auto:"
                   " the range of the used bits; labels: the values of a labeled image as evenly"
                   " spaced grays (default: full, with a warning or an error if the image is then"
                   " nearly black or white)")  # fmt: skip
    p.add_argument("--layer", metavar="NAME",
                   help="layer or part of an EXR file with the albedo (default: the only one with"
                   " color)")  # fmt: skip


def named_range(text: str) -> tuple[str, Range]:
    name, _, limits = text.rpartition("=")
    try:
        return name, parse_range(limits)
    except ExemplarError as error:
        raise argparse.ArgumentTypeError(str(error)) from error


def reading_of(args: argparse.Namespace) -> Reading:
    return Reading(dict(args.ranges), args.layer)


def print_notes(exemplars: Sequence[Exemplar]) -> None:
    """Print notes on what reading photographs changed or found unusual."""
    for note in dict.fromkeys(note for e in exemplars for note in e.notes):
        print(note, file=sys.stderr)


@contextmanager
def optional_packages(program: str, extra: str) -> Iterator[None]:
    """Report imports that lack an extra of the package, with the command that installs it."""
    try:
        yield
    except ModuleNotFoundError as error:
        raise OutputError(
            f"{program}: found no Python package {error.name!r}, expected it"
            f" (in a clone: pip install './python_export[{extra}]')"
        ) from error


@contextmanager
def without_remarks(quiet: bool) -> Iterator[None]:
    """Drop remarks, which are printed to standard error, if `quiet`. Errors are printed outside."""
    with ExitStack() as stack:
        if quiet:
            stack.enter_context(redirect_stderr(stack.enter_context(open(os.devnull, "w"))))
        yield


def say(text: str) -> None:
    """Print a remark: anything that is no result goes to standard error."""
    print(text, file=sys.stderr, flush=True)


Document = dict[str, Any]
"""Results of a command for --json."""


def print_document(program: str, document: Document) -> None:
    print(json.dumps({"program": program, "version": __version__} | document, indent=2))


def is_pipe(args: argparse.Namespace) -> bool:
    """Whether the file goes to standard output: `-o -`, or `-o -.wgsl`, which names its suffix."""
    output = str(getattr(args, "output", ""))
    return hasattr(args, "piped_suffix") and re.fullmatch(r"-(\.[\w-]+)?", output) is not None


def output_name(args: argparse.Namespace) -> str:
    """The output for messages: with -o - not the temporary file."""
    return "-" if args.is_piped else str(args.output)


@contextmanager
def _naming_standard_output() -> Iterator[None]:
    """Write standard output, and name it in errors of the system, which leave it unnamed."""
    try:
        yield
        sys.stdout.flush()
    except OSError as error:
        with suppress(OSError), open(os.devnull, "w") as nowhere:
            os.dup2(nowhere.fileno(), sys.stdout.fileno())  # Python writes the rest at its end
        raise OutputError(f"standard output: cannot write: {error.strerror or error}") from error


@contextmanager
def _piped(args: argparse.Namespace) -> Iterator[None]:
    """With `-o -`, let the command write a temporary file, and copy it to standard output."""
    args.is_piped = is_pipe(args)
    if not args.is_piped:
        yield
        return
    suffix = str(args.output)[1:] or args.piped_suffix
    sources = (getattr(args, name, None) for name in ("result", "checkpoint", "model"))
    stem = next((Path(source).stem for source in sources if source), "output")
    with tempfile.TemporaryDirectory() as folder:
        args.output = Path(folder, f"{stem}{suffix}")
        with redirect_stdout(sys.stderr):
            yield
        with _naming_standard_output():
            sys.stdout.buffer.write(args.output.read_bytes())


def run(
    p: argparse.ArgumentParser,
    arguments: list[str] | None,
    work: Callable[[argparse.Namespace], Document | None],
    failures: tuple[type[Exception], ...] = FAILURES,
) -> int:
    """Run work(args); an exception with a message for the user gives exit code 1.

    Results are on standard output: the text that work prints, with --json what it returns instead.
    """
    args = p.parse_args(arguments)
    as_json = getattr(args, "json", None) is True
    if as_json and is_pipe(args):
        p.error(
            f"-o: found {args.output} with --json, expected one of them: both are for standard"
            " output"
        )
    try:
        with without_remarks(args.quiet), _piped(args), ExitStack() as stack:
            if as_json:
                stack.enter_context(redirect_stdout(sys.stderr))
            document = work(args)
        with _naming_standard_output():
            if as_json:
                print_document(p.prog, document or {})
    except (*failures, *engine.errors()) as error:
        print(f"{p.prog}: {reason(error)}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print(f"{p.prog}: interrupted, nothing was written", file=sys.stderr)
        return 130
    return 0


def reason(error: Exception) -> str:
    """Return the message, of an error of the system without its number."""
    if isinstance(error, OSError) and error.filename and error.strerror:
        return f"{error.filename}: {error.strerror}"
    return str(error)


def files(*paths: Path) -> Document:
    """Results of a command that writes files."""
    return {"files": [str(path) for path in paths]}
