"""Result folder of a training: config.json, checkpoint.pt, log.csv, exemplars, preview.png."""

from __future__ import annotations

import csv
import fcntl
import io
import json
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Protocol

import torch

from solidtex_export.images.display import Display
from solidtex_export.images.exemplar import Exemplar, save_channels, save_image
from solidtex_export.state_file import reason
from solidtex_export.whole_file import naming, replacing

# What the command line gives of a configuration, in the order in which messages name it: of two
# values that differ the second may follow from the first, and all others follow from these.
GIVEN = (
    "exemplars",
    "size",
    "resolution",
    "crop",
    "directions",
    "seed",
    "minutes",
    "clock",
    "steps",
    "preset",
)
# What decides nothing. The newest that was told is kept.
RECORDED = ("license", "source", "reasons")


class ResultError(ValueError):
    """A result folder that cannot be used; the message names it."""


class Documented(Protocol):
    """A configuration that can be saved as a document."""

    def document(self) -> dict[str, Any]: ...


class ResultFolder:
    """Result folder. Every file is replaced atomically."""

    def __init__(self, path: Path, program: str = "solidtex-train") -> None:
        self.path = path
        self.program = program
        self.checkpoint = path / "checkpoint.pt"
        self.preview = path / "preview.png"
        self._config = path / "config.json"
        self._log = path / "log.csv"

    @property
    def begun(self) -> dict[str, Any] | None:
        """The configuration of a training that has saved a checkpoint, None without one.

        It is empty where `open` would refuse the folder.
        """
        if not self.checkpoint.exists():
            return None
        try:
            found = json.loads(self._config.read_text())
        except (OSError, ValueError):
            return {}
        return found if isinstance(found, dict) else {}

    def open(self, config: Documented, exemplars: list[Exemplar]) -> None:
        """Create the folder, or check that it holds the same training."""
        if self.path.exists() and not self.path.is_dir():
            raise ResultError(f"{self.path}: found a file, expected a folder or nothing")
        if self._config.exists():
            with self.held():
                self._check(config)
        else:
            self._begin(config)
        for i, exemplar in enumerate(exemplars):
            self._save_exemplar(exemplar, self.path / f"exemplar-{i}")

    def _begin(self, config: Documented) -> None:
        """Create the folder. Temporary files of a killed process may be there."""
        if self.path.exists() and not all(f.name.startswith(".") for f in self.path.iterdir()):
            raise ResultError(
                f"{self.path}: found a folder without config.json that is not empty, expected a"
                f" result of {self.program} or a new folder"
            )
        self.path.mkdir(parents=True, exist_ok=True)
        self._write_config(config.document())

    def _write_config(self, document: dict[str, Any]) -> None:
        text = json.dumps(document, indent=2) + "\n"
        self._replace(self._config, lambda temporary: temporary.write_text(text))

    def _save_exemplar(self, exemplar: Exemplar, stem: Path) -> None:
        """Save the first group of channels as PNG, and all channels as EXR if there are more.

        Files that are there stay.
        """
        images = Display([exemplar]).images(exemplar.image)
        png, exr = stem.with_suffix(".png"), stem.with_suffix(".exr")
        if not png.exists():
            self._replace(png, lambda temporary: save_image(images[0], temporary))
        if len(images) > 1 and not exr.exists():
            self._replace(exr, lambda temporary: save_channels(exemplar, temporary))

    def _check(self, config: Documented) -> None:
        try:
            found = json.loads(self._config.read_text())
        except (OSError, ValueError) as error:
            raise ResultError(f"{self._config}: found no readable JSON ({error})") from error
        if not isinstance(found, dict):
            raise ResultError(f"{self._config}: found no JSON object, expected a configuration")
        wanted = json.loads(json.dumps(config.document()))
        if found.get("version") != wanted.get("version"):
            raise ResultError(
                f"{self._config}: version: found {json.dumps(found.get('version'))}, expected"
                f" {json.dumps(wanted.get('version'))}: another version of solidtex began this"
                " training, and only that version can resume it; export it as it is, or choose"
                " another -o"
            )
        is_preset_given = not all(map(_has_chosen_preset, (found, wanted)))
        records = {k: wanted[k] or found.get(k) for k in RECORDED if k in wanted}
        changed = found | records != found
        found |= records
        wanted |= records
        if isinstance(found.get("space"), dict) and "space" in wanted:
            encoded = ("code", "colors")  # of the photograph; their last bits depend on the machine
            found["space"] |= {k: wanted["space"][k] for k in encoded}
        longer = _lengthened(found, wanted) if "recipe" in wanted else None  # of solidtex-train
        if longer:
            print(f"{self.path}: continues a training of {longer}", file=sys.stderr)
        elif not self.checkpoint.exists():  # nothing was trained: a corrected command begins again
            changed = True
            for image in self.path.glob("exemplar-*"):
                image.unlink()
        elif difference := given_difference(found, wanted, is_preset_given) or first_difference(
            found, wanted
        ):
            raise ResultError(
                f"{self._config}: {difference}; to resume, repeat the same command, else choose"
                " another -o"
            )
        if longer or changed:
            self._write_config(wanted)

    @contextmanager
    def held(self) -> Iterator[None]:
        """Refuse a training while another one writes into this folder."""
        folder = os.open(self.path, os.O_RDONLY)
        try:
            self._lock(folder)
            yield
        finally:
            os.close(folder)

    def _lock(self, folder: int) -> None:
        try:
            fcntl.flock(folder, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            raise ResultError(
                f"{self.path}: found another {self.program} that writes into this folder now,"
                " expected none: wait for its end or stop it, else choose another -o"
            ) from error
        except OSError:  # a file system without locks
            pass

    def resume(self, restore: Callable[[dict[str, Any]], None]) -> None:
        """Pass the checkpoint, if there is one, to `restore`."""
        if not self.checkpoint.exists():
            return
        try:
            state = torch.load(self.checkpoint, map_location="cpu", weights_only=True)
        except Exception as error:  # torch raises many kinds for a damaged file
            raise ResultError(
                f"{self.checkpoint}: found no readable checkpoint ({reason(error)}), expected one"
                f" of {self.program}; delete it to start over"
            ) from error
        try:
            restore(state)
        except (KeyError, TypeError, ValueError, RuntimeError) as error:
            raise ResultError(
                f"{self.checkpoint}: found a checkpoint that does not fit config.json ({error});"
                " delete it to start over"
            ) from error

    def save_checkpoint(self, state: dict[str, Any]) -> None:
        data = io.BytesIO()  # torch reports a full disk as RuntimeError, without a reason
        torch.save(state, data)
        self._replace(self.checkpoint, lambda temporary: temporary.write_bytes(data.getbuffer()))

    def save_preview(self, sheet: torch.Tensor) -> None:
        self._replace(self.preview, lambda temporary: save_image(sheet, temporary))

    def log(self, row: dict[str, float]) -> None:
        new = not self._log.exists()
        with naming(self._log), self._log.open("a", newline="") as file:
            writer = csv.DictWriter(file, row.keys())
            if new:
                writer.writeheader()
            writer.writerow(row)

    def trim_log(self, step: int) -> None:
        """Drop rows later than `step`, which a resumed training writes again."""
        if not self._log.exists():
            return
        header, *rows = self._log.read_text().splitlines(keepends=True)
        kept = [row for row in rows if int(row.partition(",")[0]) <= step]
        text = "".join([header, *kept])
        self._replace(self._log, lambda temporary: temporary.write_text(text))

    @staticmethod
    def _replace(target: Path, write: Callable[[Path], object]) -> None:
        with replacing(target) as temporary:
            write(temporary)


def _has_chosen_preset(config: dict[str, Any]) -> bool:
    """Whether measurements or a space chose the preset (`Choice.sentence`)."""
    return any(", so --preset " in reason for reason in config.get("reasons") or ())


def _lengthened(found: dict[str, Any], wanted: dict[str, Any]) -> str | None:
    """Return the old length, "60 steps" say, if `wanted` differs by a larger one only."""
    for key in ("steps", "minutes"):
        before, now = found.get(key), wanted.get(key)
        if before is None or now is None or not before < now:
            continue
        if found | {key: now} == wanted:
            return counted(before, key)
    return None


def counted(number: float, unit: str) -> str:
    """Return "1 minute" or "2 minutes"; `unit` is a plural."""
    return f"{number:g} {unit.removesuffix('s') if number == 1 else unit}"


def given_difference(
    found: dict[str, Any], wanted: dict[str, Any], is_preset_given: bool = False
) -> str | None:
    """The first photograph or option that differs. A space, and a preset that is given, decide on
    defaults of others.
    """
    if source := photograph_difference(found, wanted) or space_difference(found, wanted):
        return source
    keys = sorted(GIVEN, key=lambda key: key != "preset") if is_preset_given else GIVEN
    names = {key: key if key == "exemplars" else f"--{key}" for key in keys}
    differences = (first_difference(found.get(k), wanted.get(k), n) for k, n in names.items())
    return next(filter(None, differences), None)


def photograph_difference(found: dict[str, Any], wanted: dict[str, Any]) -> str | None:
    """The photographs of both trainings, if they are not the same files."""
    try:
        old, new = ([(r["file"], r["sha256"]) for r in c["exemplars"]] for c in (found, wanted))
    except (KeyError, TypeError):
        return None
    if old == new:
        return None
    names = [", ".join(file for file, _ in files) for files in (old, new)]
    if names[0] == names[1]:
        names[0] = f"another file named {names[0]}"
    return f"exemplars: found a training on {names[0]}, expected one on {names[1]}"


def space_difference(found: dict[str, Any], wanted: dict[str, Any]) -> str | None:
    """The spaces, or learned starts, of both trainings, if they are not the same."""
    spaces = [config.get("space") for config in (found, wanted)]
    old, new = (space if isinstance(space, dict) else {} for space in spaces)
    if [old.get(k) for k in ("name", "sha256")] == [new.get(k) for k in ("name", "sha256")]:
        return None
    option = "--space" if old.get("code") or new.get("code") else "--start"
    names = [record.get("name", "none") for record in (old, new)]
    if names[0] == names[1]:
        names[0] = f"another file named {names[0]}"
    return f"{option}: found {names[0]}, expected {names[1]}"


def first_difference(found: object, wanted: object, key: str = "") -> str | None:
    """Path of keys to the first value that differs between two JSON documents."""
    if found == wanted:
        return None
    if isinstance(found, dict) and isinstance(wanted, dict):
        keys = sorted(found.keys() | wanted.keys())
        pairs = [(k, found.get(k), wanted.get(k)) for k in keys]
    elif isinstance(found, list) and isinstance(wanted, list) and len(found) == len(wanted):
        pairs = list(zip(map(str, range(len(found))), found, wanted, strict=True))
    else:
        return f"{key}: found {json.dumps(found)}, expected {json.dumps(wanted)}"
    differences = (first_difference(a, b, f"{key}.{k}" if key else k) for k, a, b in pairs)
    return next(filter(None, differences))
