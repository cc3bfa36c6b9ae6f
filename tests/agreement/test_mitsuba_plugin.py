"""The Mitsuba 3 texture "solidtex": values of the library, image of solidtex-render."""

from pathlib import Path

import numpy as np
import pytest
from image_test import compare
from scene_pairs import Pair, Surface, mitsuba_scene, write_files
from test_agreement import LEVEL, our_renders

mi = pytest.importorskip("mitsuba", reason="the Python package mitsuba is not installed")
solidtex = pytest.importorskip("solidtex", reason="the Python module solidtex was not built")
dr = pytest.importorskip("drjit")
pytest.importorskip("solidtex.mitsuba")

VARIANTS = {"scalar_rgb": 8, "llvm_ad_rgb": 32}  # and samples a pixel: scalar ones are slow
RENDERS = 8
MODEL, MAPS, TEXELS = "granite-beige", "paint-rusted", 8.0
MOVED = (0.0, 1.0, 0.0)  # where scene_pairs puts the ball


@pytest.fixture(params=VARIANTS)
def variant(request: pytest.FixtureRequest) -> str:
    mi.set_variant(request.param)
    return request.param


def stone(**options: object) -> dict:
    return {"type": "solidtex", "model": MODEL, "texels_per_unit": TEXELS, **options}


def surfaces(**options: object) -> Pair:
    """A ball with a coat, which uses the mean, on a matt floor."""
    solid = {"solid": MODEL, "texels_per_unit": TEXELS}
    moved = mi.ScalarTransform4f().translate(MOVED)
    ball = Surface(
        {"type": "coated", "color": solid, "roughness": 0.03, "ior": 1.5},
        {
            "type": "plastic",
            "int_ior": 1.5,
            "ext_ior": 1.0,
            "nonlinear": True,
            "diffuse_reflectance": stone(to_world=moved, **options),
        },
    )
    floor = Surface(
        {"type": "diffuse", "color": solid}, {"type": "diffuse", "reflectance": stone(**options)}
    )
    return Pair(ball, floor, environment=True)


def interactions(points: np.ndarray) -> list:
    """One interaction for all points, or one for each where the variant is scalar."""
    if mi.variant().startswith("scalar"):
        parts = [mi.SurfaceInteraction3f() for _ in points]
        for part, point in zip(parts, points, strict=True):
            part.p = mi.Point3f(*map(float, point))
        return parts
    si = dr.zeros(mi.SurfaceInteraction3f, len(points))
    si.p = mi.Point3f(points.T)
    return [si]


def gathered(values: list) -> np.ndarray:
    """[point, channel] of what one call or several have answered."""
    if mi.variant().startswith("scalar"):
        return np.array(values).reshape(len(values), -1)
    (one,) = values
    return np.atleast_2d(np.array(one)).T


def points() -> np.ndarray:
    return np.random.default_rng(2).uniform(-3, 3, (30, 3)).astype(np.float32)


def light(values: np.ndarray) -> np.ndarray:
    decoded = np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)
    return np.clip(decoded, 0, 0.999)


def test_values_are_those_of_the_library(variant: str) -> None:
    turned = mi.ScalarTransform4f().translate((1, 2, 3)).rotate((0, 1, 0), 90)
    scale = np.array([4.0, 5.0, 6.0])
    texture = mi.load_dict(stone(texels_per_unit=scale.tolist(), to_world=turned, seed=4))
    near = points()
    x, y, z = (near - (1, 2, 3)).T
    places = scale * np.stack([-z, y, x], axis=1)  # turned back by 90 degrees
    expected = light(solidtex.Texture(MODEL, 4).eval_points(places))
    assert expected.std() > 0.01
    asked = interactions(near)
    for answer in (texture.eval, texture.eval_3):
        found = gathered([answer(si, True) for si in asked])
        assert np.abs(found - expected).max() < 1e-4
    gray = gathered([texture.eval_1(si, True) for si in asked])[:, 0]
    assert np.abs(gray - expected @ (0.212671, 0.715160, 0.072169)).max() < 1e-4
    assert texture.is_spatially_varying() and MODEL in str(texture)


def test_a_channel_is_a_plain_number(variant: str) -> None:
    texture = mi.load_dict(stone(model=MAPS, channel="roughness"))
    library = solidtex.Texture(MAPS)
    expected = library.eval_points(TEXELS * points())[:, library.channels.index("roughness")]
    found = gathered([texture.eval_1(si, True) for si in interactions(points())])[:, 0]
    assert np.abs(found - expected).max() < 1e-5 and expected.std() > 0.01


def test_the_mean_is_that_of_many_points(variant: str) -> None:
    texture = mi.load_dict(stone())
    many = np.random.default_rng(3).uniform(-40, 40, (4000, 3))
    values = light(solidtex.Texture(MODEL).eval_points(many)).mean(axis=0)
    expected = float(values @ (0.212671, 0.715160, 0.072169))
    assert float(np.array(texture.mean()).item()) == pytest.approx(expected, abs=0.02)


def test_lanes_that_are_off_are_not_looked_up() -> None:
    mi.set_variant("llvm_ad_rgb")
    texture = mi.load_dict(stone())
    near = points()
    near[3] = np.nan  # as where a ray has hit nothing
    (si,) = interactions(near)
    active = mi.Bool(np.arange(len(near)) % 2 == 0)
    found = np.array(texture.eval(si, active)).T
    assert not found[1::2].any() and found[::2].min() > 0
    assert not np.array(texture.eval(si, True)).T[3].any()


def test_many_points_are_one_query(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    mi.set_variant("llvm_ad_rgb")
    counts = []
    evaluate = solidtex.Texture.eval_points

    def counting(self: object, places: np.ndarray) -> np.ndarray:
        counts.append(len(places))
        return evaluate(self, places)

    texture = mi.load_dict(stone())
    monkeypatch.setattr(solidtex.Texture, "eval_points", counting)
    (si,) = interactions(points())
    texture.eval(si, True)
    assert counts == [len(points())]


def test_refusals(variant: str) -> None:
    for options, message in (
        ({"model": "marzipan"}, "no model is named"),
        ({"channel": "roughness"}, "channel: found no 'roughness' in granite-beige"),
        ({"precision": "half"}, "precision: found 'half'"),
        ({"seed": -1}, "seed: found -1"),
        ({"seed": 1.5}, "seed: found 1.5, expected a whole number"),
        ({"seed": True}, "seed: found True, expected a whole number"),
        ({"cache_limit": 0.5}, "cache_limit: found 0.5, expected a whole number"),
        ({"cache_limit": -1}, "cache_limit: found -1"),
        ({"texels_per_unit": -8.0}, "texels_per_unit: found -8.0, expected one positive number"),
        ({"texels_per_unit": [1.0, 0.0, 1.0]}, "texels_per_unit: found .*, expected one positive"),
        ({"texels_per_unit": "8"}, "texels_per_unit: found 8, expected one positive number"),
        ({"model": 3}, "model: found 3, expected a path or the name of a model"),
        ({"texels": 3}, "texels"),
    ):
        with pytest.raises(Exception, match=message):
            mi.load_dict(stone(**options))
    with pytest.raises(Exception, match="solidtex: model: found nothing, expected a path or the"):
        mi.load_dict({"type": "solidtex"})
    mi.set_variant("scalar_spectral")
    with pytest.raises(Exception, match="found the variant scalar_spectral"):
        mi.load_dict(stone())


def test_symbolic_loops_are_refused_by_name() -> None:
    mi.set_variant("llvm_ad_rgb")
    texture = mi.load_dict(stone())
    (si,) = interactions(points())
    start = (mi.UInt32(0), mi.Color3f(0))
    with (
        dr.scoped_set_flag(dr.JitFlag.SymbolicLoops, True),
        pytest.raises(RuntimeError) as caught,
    ):
        dr.while_loop(start, lambda i, _: i < 2, lambda i, _: (i + 1, texture.eval(si, True)))
    assert "found a symbolic loop or call" in str(caught.value.__cause__)


@pytest.fixture(scope="module")
def ours(tmp_path_factory: pytest.TempPathFactory) -> np.ndarray:
    mi.set_variant("scalar_rgb")
    return our_renders(tmp_path_factory.mktemp("ours"), surfaces())


def test_the_image_is_that_of_solidtex_render(
    variant: str, ours: np.ndarray, tmp_path: Path
) -> None:
    mi.set_variant(variant)
    write_files(tmp_path, surfaces())

    def theirs(**options: object) -> np.ndarray:
        scene = mitsuba_scene(mi, tmp_path, surfaces(**options))
        samples = VARIANTS[variant]
        renders = [mi.render(scene, seed=seed, spp=samples) for seed in range(RENDERS)]
        return np.stack([np.array(render) for render in renders])

    verdict = compare(ours, theirs())
    print(f"\n{variant}: {verdict}")
    assert verdict.p_value > LEVEL
    # The same test sees another piece of the same stone.
    assert compare(ours, theirs(seed=1)).p_value < LEVEL
