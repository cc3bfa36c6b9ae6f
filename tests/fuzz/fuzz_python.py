"""Gives bytes made by Atheris to one of the Python readers of test_readers.py.

Each file must be read, or refused by an error of the target. From the repository, after
`.venv/bin/pip install atheris`:

    PYTHONPATH=python_export:build/python .venv/bin/python tests/fuzz/fuzz_python.py TARGET \
        -max_total_time=60

Options are those of libFuzzer. build-fuzz/python/TARGET keeps the inputs that fail, and in corpus/
all others that are new, so that the next run goes on from them.
"""

import contextlib
import sys
from pathlib import Path

import atheris

with atheris.instrument_imports(include=["solidtex_export"]):
    from test_readers import TARGETS

FOLDERS = Path(__file__).resolve().parents[2] / "build-fuzz" / "python"


def main() -> None:
    name = sys.argv.pop(1) if len(sys.argv) > 1 else ""
    if name not in TARGETS:
        raise SystemExit(f"found target {name!r}, expected one of {', '.join(TARGETS)}")
    target, folder = TARGETS[name], FOLDERS / name
    corpus = folder / "corpus"
    corpus.mkdir(parents=True, exist_ok=True)
    (corpus / "valid").write_bytes(target.valid(folder))
    file = folder / f"input{target.suffix}"

    def read(data: bytes) -> None:
        file.write_bytes(data)
        with contextlib.suppress(*target.errors):
            target.read(file)

    atheris.Setup([*sys.argv, f"-artifact_prefix={folder}/", str(corpus)], read)
    atheris.Fuzz()


if __name__ == "__main__":
    main()
