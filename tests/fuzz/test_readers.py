"""The Python readers on real files with damage: a clear error of our own, or a result.

Any other exception, a second of looping or gigabytes of memory fails. Each target reads 40 damaged
files; SOLIDTEX_LONG_TESTS makes that 4 000, SOLIDTEX_READER_CASES any number.
"""

import io
import os
import resource
import signal
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
import torch
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from PIL import Image

from solidtex_export.export import random_models, training_result
from solidtex_export.export.file_format import model_file
from solidtex_export.export.lattice_state import StateError
from solidtex_export.images.exemplar import load_exemplar
from solidtex_export.images.file_kinds import ExemplarError
from solidtex_export.images.labels import load_labels
from solidtex_export.images.photographs import write_exr
from solidtex_export.settings import SettingsError
from solidtex_export.spaces.opening import open_space
from solidtex_export.spaces.random_space import Sizes, random_space
from solidtex_export.spaces.settings import load_space_recipe
from solidtex_export.spaces.space_reader import SpaceError
from solidtex_export.training.presets import load_recipe

PRESETS = Path(random_models.__file__).parents[1] / "presets"
CASES = int(
    os.environ.get("SOLIDTEX_READER_CASES", 4000 if os.environ.get("SOLIDTEX_LONG_TESTS") else 40)
)
MEMORY = 4 << 30
SECONDS = 20
FAILED = Path(__file__).parent / "python_corpus"
"""Files that once failed: TARGET_ANYTHING."""


@dataclass
class Target:
    read: Callable[[Path], object]
    errors: tuple[type[Exception], ...]
    suffix: str
    valid: Callable[[Path], bytes]


def image(kind: str, mode: str = "RGB") -> Callable[[Path], bytes]:
    def make(_: Path) -> bytes:
        pixels = np.random.default_rng(1).integers(0, 3, (40, 44, 3), np.uint8) * 100
        data = io.BytesIO()
        Image.fromarray(pixels[..., 0] if mode == "L" else pixels).save(data, kind)
        return data.getvalue()

    return make


def exr(folder: Path) -> bytes:
    write_exr(folder / "a.exr", ["R", "G", "B"], np.random.default_rng(1).random((40, 44, 3)))
    return (folder / "a.exr").read_bytes()


def model(folder: Path) -> bytes:
    model_file.write(folder / "a.solidtex", random_models.lattice_model(3, 2, 3))
    return (folder / "a.solidtex").read_bytes()


def checkpoint(_: Path) -> bytes:
    data = io.BytesIO()
    state = {"generator": random_models.sampler(4, 3, 6).state_dict(), "step": 3, "seconds": 1.5}
    torch.save(state, data)
    return data.getvalue()


def photograph(path: Path) -> object:
    return load_exemplar(path, 64, 16)


PHOTOGRAPH = (photograph, (ExemplarError,))
TARGETS = {
    "model": Target(model_file.read, (model_file.ModelFileError,), ".solidtex", model),
    "space": Target(
        open_space,
        (SpaceError, SettingsError),
        ".solidtex-space",
        lambda _: random_space(Sizes(family="sampler", name="a"), seed=3).encode(),
    ),
    "checkpoint": Target(training_result.read_checkpoint, (StateError,), ".pt", checkpoint),
    "recipe": Target(
        lambda path: load_recipe(str(path)),
        (SettingsError,),
        ".toml",
        lambda _: (PRESETS / "lattice.toml").read_bytes(),
    ),
    "space-recipe": Target(
        lambda path: load_space_recipe(str(path)),
        (SettingsError,),
        ".toml",
        lambda _: (PRESETS / "spaces" / "lattice.toml").read_bytes(),
    ),
    "labels": Target(
        lambda path: load_labels([path], 64, 16, None, []),
        (ExemplarError,),
        ".tif",
        image("TIFF", "L"),
    ),
    "tiff": Target(*PHOTOGRAPH, ".tif", image("TIFF")),
    "png": Target(*PHOTOGRAPH, ".png", image("PNG")),
    "jpeg": Target(*PHOTOGRAPH, ".jpg", image("JPEG")),
    "exr": Target(*PHOTOGRAPH, ".exr", exr),
}

NUMBERS = [0, 1, 0x7F, 0x80, 0xFF, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF, 1 << 63, (1 << 64) - 1]


@st.composite
def edits(draw: st.DrawFn) -> list[tuple]:
    place = st.floats(0, 1, exclude_max=True)
    kinds = st.one_of(
        st.tuples(st.just("flip"), place, st.integers(0, 7)),
        st.tuples(st.just("set"), place, st.binary(min_size=1, max_size=8)),
        st.tuples(
            st.just("number"), place, st.sampled_from(NUMBERS), st.sampled_from([1, 2, 4, 8])
        ),
        st.tuples(st.just("cut"), place, place),
        st.tuples(st.just("double"), place, place),
        st.tuples(st.just("end"), place),
    )
    return draw(st.lists(kinds, min_size=1, max_size=5))


def damaged(data: bytes, changes: list[tuple]) -> bytes:
    spoiled = bytearray(data)
    for kind, place, *values in changes:
        at = int(place * len(spoiled))
        if kind == "flip" and spoiled:
            spoiled[at] ^= 1 << values[0]
        elif kind == "set":
            spoiled[at : at + len(values[0])] = values[0]
        elif kind == "number":
            number, size = values
            low = (number & ((1 << 8 * size) - 1)).to_bytes(size, "little")
            spoiled[at : at + size] = low
        elif kind == "cut":
            del spoiled[at : at + int(values[0] * 64) + 1]
        elif kind == "double":
            spoiled[at:at] = spoiled[at : at + int(values[0] * 64) + 1]
        elif kind == "end":
            del spoiled[at:]
    return bytes(spoiled)


@pytest.fixture
def bounded() -> Iterator[None]:
    """Limits of memory for a test, and of seconds for one file."""

    def late(*_: object) -> None:
        raise TimeoutError(f"no answer after {SECONDS} s")

    before = resource.getrlimit(resource.RLIMIT_AS)
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    resource.setrlimit(resource.RLIMIT_AS, (pages * resource.getpagesize() + MEMORY, before[1]))
    old = signal.signal(signal.SIGALRM, late)
    yield
    signal.alarm(0)
    signal.signal(signal.SIGALRM, old)
    resource.setrlimit(resource.RLIMIT_AS, before)


def read(target: Target, path: Path) -> None:
    signal.alarm(SECONDS)
    try:
        target.read(path)
    except target.errors as error:
        assert path.name in str(error), error
    finally:
        signal.alarm(0)


@pytest.mark.parametrize("name", TARGETS)
def test_damaged_files(name: str, tmp_path: Path, bounded: None) -> None:
    target = TARGETS[name]
    data = target.valid(tmp_path)
    path = tmp_path / f"damaged{target.suffix}"
    path.write_bytes(data)
    target.read(path)

    @settings(max_examples=CASES, deadline=None, derandomize=CASES == 40, database=None,
              suppress_health_check=list(HealthCheck))  # fmt: skip
    @given(edits())
    def read_damaged(changes: list[tuple]) -> None:
        path.write_bytes(damaged(data, changes))
        read(target, path)

    read_damaged()


@pytest.mark.parametrize("file", sorted(FAILED.glob("*")), ids=lambda file: file.name)
def test_files_that_once_failed(file: Path, bounded: None) -> None:
    read(TARGETS[file.name.rpartition("_")[0]], file)
