"""A host whose locale has a decimal comma, or letters of its own, changes no bit and no file."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

QUERIES = """
import hashlib, locale, sys
name, space, result = sys.argv[1:]
locale.setlocale(locale.LC_ALL, name)
import numpy as np
import solidtex
points = np.random.default_rng(1).uniform(-20, 20, (50, 3)).astype(np.float32)
digest = hashlib.sha256()
for model in ("granite-grey", "granite-speckled"):
    digest.update(solidtex.Texture(model, seed=3).eval_points(points).tobytes())
opened = solidtex.Space(space)
material = opened.blend([opened.photograph(0), opened.photograph(1)], [0.25, 0.75])
opened.write_model(material, result)
digest.update(open(result, "rb").read())
print(locale.localeconv()["decimal_point"], digest.hexdigest())
"""


@pytest.mark.skipif(not shutil.which("localedef"), reason="localedef is not installed")
def test_locales_change_nothing(tmp_path: Path) -> None:
    found = {}
    for name in ("de_DE", "tr_TR", "C"):
        if name != "C":
            made = subprocess.run(
                ["localedef", "-i", name, "-f", "UTF-8", tmp_path / f"{name}.UTF-8"], check=False
            )
            if made.returncode > 1:  # 1: warnings
                pytest.skip("the package locales is not installed")
        full = name if name == "C" else f"{name}.UTF-8"
        command = [sys.executable, "-c", QUERIES, full, "stones", tmp_path / "a.solidtex"]
        environment = os.environ | {"LOCPATH": str(tmp_path), "LC_ALL": full}
        done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        found[name] = done.stdout.split()
    assert found["de_DE"][0] == found["tr_TR"][0] == ","
    assert found["de_DE"][1] == found["tr_TR"][1] == found["C"][1]
