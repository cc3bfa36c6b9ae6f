"""The npm package under Node: exact has the bits of the desktop engine, fast is within 1/1024."""

import functools
import http.server
import json
import os
import re
import shutil
import subprocess
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from solidtex import Texture

REPOSITORY = Path(__file__).resolve().parents[2]
BUILD = Path(os.environ.get("SOLIDTEX_BUILD", REPOSITORY / "build"))
PACKAGE = BUILD / "wasm" / "package"
MODELS = REPOSITORY / "models"
FAST_BOUND = 1 / 1024
LATTICE, SAMPLER = MODELS / "marble.solidtex", MODELS / "granite-speckled.solidtex"
NODE = shutil.which("node")
TSC = shutil.which("tsc")
CHROMIUM = shutil.which("chromium-headless-shell") or shutil.which("chromium")

if not (PACKAGE / "index.mjs").exists():
    pytest.skip("the target solidtex_wasm is not built", allow_module_level=True)

# Places: near the origin, negative, and close to the limit of 2^30.
BOXES = [([0, 0, 0], [5, 3, 7]), ([-9, 1000003, -64], [4, 4, 33]),
         ([2**30 - 6, -(2**30), 2**24], [2, 3, 5])]  # fmt: skip
ORIGINS = [(0.0, 0.0, 0.0), (-1e5 + 0.375, 12.0, 2.0**29), (2.0**30, -(2.0**30), 0.1)]


def run(jobs: list[dict[str, Any]], folder: Path) -> list[str]:
    """The lines that evaluate.mjs prints."""
    file = folder / "jobs.json"
    file.write_text(json.dumps(jobs))
    command = [str(NODE), str(REPOSITORY / "tests/wasm/evaluate.mjs"), str(PACKAGE / "index.mjs"),
               str(file)]  # fmt: skip
    done = subprocess.run(command, check=False, capture_output=True, text=True, timeout=500)
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


def points() -> np.ndarray:
    """More than a block of points, and some that are evaluated one by one; in few bricks."""
    generator = np.random.default_rng(5)
    return generator.uniform(-6, 6, (131, 3)).astype(np.float32)


def queries() -> list[dict[str, Any]]:
    given = [float(x) for x in points().ravel()]
    return [
        *({"box": box} for box in BOXES),
        *({"points": given, "options": {"origin": origin}} for origin in ORIGINS),
        # The point itself: wider footprints would first measure the material, which takes long.
        {"points": given, "options": {"radii": [0.0] * len(points())}},
    ]


def expected(model: Path, seed: int) -> list[np.ndarray]:
    with Texture(model, seed) as texture:
        return [
            *(texture.eval_box(*box).ravel() for box in BOXES),
            *(texture.eval_points(points(), origin).ravel() for origin in ORIGINS),
            texture.eval_points(points()).ravel(),
        ]


@pytest.mark.parametrize("model", [LATTICE, SAMPLER], ids=["lattice", "sampler"])
@pytest.mark.parametrize("precision", ["exact", "fast"])
def test_values(model: Path, precision: str, tmp_path: Path) -> None:
    seed = 2**53 - 1
    options = {"precision": precision, "seed": seed}
    facts, *lines = run([{"model": str(model), "options": options, "queries": queries()}], tmp_path)
    with Texture(model) as texture:
        family = "sampler" if model == SAMPLER else "lattice"
        assert json.loads(facts) == [texture.name, family, list(texture.channels), "srgb"]
    for line, wanted in zip(lines, expected(model, seed), strict=True):
        found = np.frombuffer(bytes.fromhex(line), "<f4")
        if precision == "exact":
            np.testing.assert_array_equal(found.view(np.uint32), wanted.view(np.uint32))
        else:
            assert found.shape == wanted.shape
            print(f"largest difference {np.abs(found - wanted).max():.2g}")
            assert np.abs(found - wanted).max() <= FAST_BOUND


@pytest.mark.parametrize("model", [LATTICE, SAMPLER], ids=["lattice", "sampler"])
def test_workers_share_a_query(model: Path, tmp_path: Path) -> None:
    """More workers than voxels or points in some queries; every axis is the longest of a box."""
    few = {"box": [[3, 3, 3], [1, 2, 1]]}, {"points": [0.5] * 3}, {"points": []}
    boxes = {"box": [[-2, 0, 9], [9, 2, 3]]}, {"box": [[7, -7, 0], [2, 5, 4]]}
    job = {"model": str(model), "options": {"precision": "fast", "seed": 3},
           "queries": [*queries(), *few, *boxes]}  # fmt: skip
    lines = run([job, {**job, "workers": 3}], tmp_path)
    assert lines[: len(lines) // 2] == lines[len(lines) // 2 :]
    assert len(set(lines)) > len(lines) // 2 - 3


def test_fast_is_another_module(tmp_path: Path) -> None:
    """Fast rounds products: were it the exact module, test_values could not tell."""
    jobs = [
        {"model": str(LATTICE), "options": {"precision": p}, "queries": [{"box": BOXES[0]}]}
        for p in ("exact", "fast")
    ]
    lines = run(jobs, tmp_path)
    assert lines[1] != lines[3]


@pytest.mark.parametrize(
    ("query", "message"),
    [
        ({"points": [0, "NaN", 0]}, "1: point 0: y is nan (origin 0 + point nan), expected a"),
        ({"points": [0] * 9 + [0, "NaN", 0]}, "1: point 3: y is nan (origin 0 + point nan), expec"),
        ({"points": [0, 0]}, "1: points: found 2 numbers, expected x, y, z of every point"),
        ({"points": 7}, "1: points: found 7, expected an array of x, y, z of every point"),
        ({"points": [0] * 3, "options": {"radii": [-1]}}, "1: radius of point 0 is -1, expected 0"),
        ({"points": [0] * 3, "options": {"origin": [0]}}, "1: origin: found [0], expected three"),
        ({"points": [0] * 3, "options": {"origin": list(range(9))}}, "1: origin: found [0,1,2,3,4"),
        ({"points": [0] * 3, "options": {"orgin": [5] * 3}}, "1: options: found orgin, expected"),
        ({"points": [0] * 3, "options": {"axes": [0] * 9}}, "1: options: found axes, expected"),
        ({"points": [0] * 3, "options": {"radii": 0}}, "1: radii: found 0, expected an array"),
        (
            {"points": [0] * 3, "options": None},
            "1: options: found null, expected an object with origin or radii",
        ),
        ({"points": [0] * 3, "options": 7}, "1: options: found 7, expected an object with origin"),
        ({"box": [[0, 0, 0], [4096, 4096, 64]]}, "4: a box of 4096 x 4096 x 64 voxels needs 1288"),
        ({"box": [[2**30, 0, 0], [2**17, 1, 1]]}, "1: box along x has origin 1073741824 and size"),
        ({"box": [[0, 0, 0], [1, -1, 1]]}, "1: box size along y is -1, expected 0 or more"),
        ({"box": [[0.5, 0, 0], [1, 1, 1]]}, "1: origin: found [0.5,0,0], expected three whole"),
    ],
)
@pytest.mark.parametrize("workers", [{}, {"workers": 2}], ids=["here", "in workers"])
def test_refused_queries(
    query: dict[str, Any], message: str, workers: dict[str, int], tmp_path: Path
) -> None:
    """The texture stays usable."""
    if workers and "4096 x 4096" in message:
        message = "4: a box of 2048 x 4096 x 64 voxels needs 6442450944 bytes"
    wanted = {"box": BOXES[0]}
    job = {"model": str(SAMPLER), "queries": [query, wanted], "options": {"precision": "fast"},
           **workers}  # fmt: skip
    _, refusal, values = run([job], tmp_path)
    assert refusal.startswith("SolidtexError " + message)
    assert len(values) == 2 * 4 * 3 * 5 * 3 * 7


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"bytes": 1000}, "3: model in memory: header length: found "),
        ({"bytes": 0}, "3: model in memory: header length: found an empty file of 0 bytes"),
        (
            {"options": {"presicion": "fast"}},
            "1: options: found presicion, expected precision, seed, period,",
        ),
        (
            {"options": {"precision": "half"}},
            '1: precision: found "half", expected "exact" or',
        ),
        ({"options": None}, "1: options: found null, expected an object with precision"),
        ({"options": 5}, "1: options: found 5, expected an object with precision"),
        ({"options": {"seed": "7"}}, '1: seed: found "7", expected a whole number'),
        (
            {"options": {"seed": 2**60}},
            "1: seed: found 1152921504606847000, expected a whole number from 0 to"
            " 18446744073709551615, above 2^53 - 1 as a bigint",
        ),
        ({"options": {"module": {}}}, "1: module.create: found undefined, expected a function"),
        ({"options": {"module": {"make": 1}}}, "1: module: found make, expected create or wasm"),
        ({"options": {"baseUrl": "nowhere"}}, '1: baseUrl: found "nowhere", expected a file: URL'),
        (
            {"options": {"baseUrl": "file:///nowhere"}},
            "2: file:///nowhere/solidtex-exact: cannot load: MODULE_NOT_FOUND",
        ),
        (
            {"options": {"baseUrl": "nowhere"}, "workers": 2},
            '1: baseUrl: found "nowhere", expected a file: URL',
        ),
        (
            {"options": {"presicion": "fast"}, "workers": 2},
            "1: options: found presicion, expected precision, seed, period, cacheLimitBytes,"
            " baseUrl or workers",
        ),
        ({"options": {"seed": -1}}, "1: seed: found -1, expected a whole number from 0 to 1844674"),
        ({"options": {"period": 64}}, '1: parameter "period" is 64, expected 0 for a model of the'),
        ({"model": "none.solidtex"}, "2: none.solidtex: cannot read: ENOENT"),
        ({"model": "file:///none.solidtex"}, "2: file:///none.solidtex: cannot read: ENOENT"),
        (
            {"model": "http://127.0.0.1:65535/a"},
            "2: http://127.0.0.1:65535/a: cannot read: ECONNREFUSED",
        ),
        ({"model": "http://127.0.0.1:1/a"}, "2: http://127.0.0.1:1/a: cannot read: bad port"),
        ({"model": 5}, "1: model: found 5, expected bytes, a URL or a path"),
        ({"model": 5, "workers": 2}, "1: model: found 5, expected bytes, a URL or a path"),
        ({"workers": 0}, "1: workers: found 0, expected a whole number from 1 to 256"),
        ({"workers": -1}, "1: workers: found -1, expected a whole number from 1 to 256"),
        ({"workers": 2, "bytes": 1000}, "3: model in memory: header length: found "),
    ],
)
def test_refused_models(changes: dict[str, Any], message: str, tmp_path: Path) -> None:
    [refusal] = run([{"model": str(SAMPLER), **changes}], tmp_path)
    assert refusal.startswith("SolidtexError " + message)


def test_cut_tensors_are_named(tmp_path: Path) -> None:
    job = {"model": str(SAMPLER), "bytes": SAMPLER.stat().st_size - 4}
    [refusal] = run([job], tmp_path)
    assert re.match(r"SolidtexError 3: model in memory: tensor .*: found .*, expected", refusal)


def test_snippet_of_the_page(tmp_path: Path) -> None:
    """The first program of docs/hosts/web.md, beside an installation from `npm pack`."""
    npm = shutil.which("npm")
    assert npm
    packed = subprocess.run([npm, "pack", str(PACKAGE), "--silent"], cwd=tmp_path, text=True,
                            check=True, capture_output=True)  # fmt: skip
    archive = packed.stdout.split()[-1]
    shutil.unpack_archive(tmp_path / archive, tmp_path / "unpacked", "gztar")
    (tmp_path / "node_modules").mkdir()
    (tmp_path / "unpacked/package").rename(tmp_path / "node_modules/solidtex")
    page = (REPOSITORY / "docs/hosts/web.md").read_text()
    program = re.search(r"```js\n(.*?)```", page, re.DOTALL)
    assert program
    (tmp_path / "show.mjs").write_text(program[1])
    shutil.copy(MODELS / "granite-grey.solidtex", tmp_path)
    shown = subprocess.run([str(NODE), "show.mjs"], cwd=tmp_path, text=True, check=True,
                           capture_output=True)  # fmt: skip
    output = re.search(r"```text\n(.*?)```", page, re.DOTALL)
    assert output
    assert shown.stdout == output[1]


@pytest.fixture
def site(tmp_path: Path) -> Iterator[str]:
    """The address of a server with the package, a model and an empty page."""
    (tmp_path / "package").symlink_to(PACKAGE)
    shutil.copy(SAMPLER, tmp_path)
    (tmp_path / "index.html").write_text("<!doctype html>")
    handler = functools.partial(http.server.SimpleHTTPRequestHandler, directory=tmp_path)
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}"
        server.shutdown()


@pytest.mark.skipif(not CHROMIUM, reason="Chromium is not installed")
def test_a_page_evaluates_in_workers(site: str) -> None:
    playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    script = f"""async () => {{
        const {{ loadInWorkers }} = await import("/package/index.mjs");
        const texture = await loadInWorkers("/{SAMPLER.name}", {{ workers: 2 }});
        const values = await texture.evalBox([1, 2, 3], [5, 4, 3]);
        texture.close();
        const lost = await loadInWorkers("/{SAMPLER.name}", {{ baseUrl: "{site}/none/" }})
            .catch((error) => error.message);
        return [Array.from(values), lost];
    }}"""
    with playwright.sync_playwright() as p:
        browser = p.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        page = browser.new_page()
        page.goto(site)
        found, lost = page.evaluate(script)
        browser.close()
    with Texture(SAMPLER) as texture:
        wanted = texture.eval_box((1, 2, 3), (5, 4, 3)).ravel()
    np.testing.assert_array_equal(np.array(found, np.float32), wanted)
    assert lost == "a worker failed: cannot load it"


@pytest.mark.skipif(not TSC, reason="tsc is not installed")
def test_types(tmp_path: Path) -> None:
    (tmp_path / "node_modules").mkdir()
    (tmp_path / "node_modules/solidtex").symlink_to(PACKAGE)
    shutil.copy(REPOSITORY / "tests/wasm/types.mts", tmp_path)
    options = ["--noEmit", "--strict", "--module", "nodenext", "--target", "es2022"]
    subprocess.run([str(TSC), *options, "types.mts"], cwd=tmp_path, check=True)
