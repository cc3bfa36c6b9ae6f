"""Writes the hostile model files that every reader must refuse, each with a clear error.

    python tests/hostile/make_hostile.py FOLDER

Each file is a small valid model with one thing wrong. `expected` are words that the error message
must contain, besides the file's name: the field or tensor that is wrong.
"""

import json
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from base_files import (
    Document,
    Draft,
    Header,
    Tensors,
    chain_draft,
    field_draft,
    pack,
    sampler_draft,
)
from spoil_bytes import spoiled_bytes
from spoil_document import spoiled_documents
from spoil_tensors import spoiled_headers, spoiled_tensors

DRAFTS: dict[str, Callable[[], Draft]] = {"field": field_draft, "sampler": sampler_draft}
TOO_LARGE = (8 + (16 << 20) + (512 << 20)) + 1


@dataclass(frozen=True)
class HostileFile:
    name: str
    data: bytes
    expected: tuple[str, ...]
    size: int | None = None  # the file is extended to this size, without taking space

    def write(self, folder: Path) -> Path:
        path = folder / f"{self.name}.solidtex"
        with path.open("wb") as file:
            file.write(self.data)
            if self.size is not None:
                file.truncate(self.size)
        return path


def hostile_files() -> Iterator[HostileFile]:
    for name, family, change_document, expected in spoiled_documents():
        yield HostileFile(name, _with_document(family, change_document), expected)
    for name, family, change_tensors, expected in spoiled_tensors():
        yield HostileFile(name, _with_tensors(family, change_tensors), expected)
    for name, family, change_header, expected in spoiled_headers():
        yield HostileFile(name, _with_header(family, change_header), expected)
    for name, family, change_bytes, expected in spoiled_bytes():
        yield HostileFile(name, change_bytes(DRAFTS[family]().encode()), expected)
    for name, *sizes in (("voxel_gigantic", 210, 1, 3), ("voxel_endless", 11, 3, 15)):
        yield HostileFile(name, chain_draft(*sizes).encode(), ("nodes[", "for one voxel"))
    yield HostileFile("file_too_large", field_draft().encode(), ("file size",), TOO_LARGE)


def _with_document(family: str, change: Callable[[Document], None]) -> bytes:
    draft = DRAFTS[family]()
    change(draft.document)
    return draft.encode()


def _with_tensors(family: str, change: Callable[[Tensors], None]) -> bytes:
    draft = DRAFTS[family]()
    change(draft.tensors)
    return draft.encode()


def _with_header(family: str, change: Callable[[Header], None]) -> bytes:
    header, data = DRAFTS[family]().header_and_data()
    change(header)
    return pack(json.dumps(header).encode(), data)


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("usage: make_hostile.py FOLDER")
    output = Path(sys.argv[1])
    output.mkdir(parents=True, exist_ok=True)
    count = sum(1 for file in hostile_files() if file.write(output))
    print(f"{count} hostile files in {output}")
