"""The rough coat of solidtex-render as a material of Mitsuba 3, from Mitsuba's own pieces.

Written after what docs/scene-format.md says of the material "coated" at a constant roughness, not
after the renderer's code. Samples are chosen by cosine alone. Mitsuba's own `roughplastic` has
separable masking, ours is correlated in height: Smith's joint function is
1 / (1/G1(in) + 1/G1(out) - 1), with G1 as Mitsuba has it.
"""

from __future__ import annotations

import numpy as np

TABLE = 256  # cosines of the coat's albedo
GRID = 96  # facets a side for one of them


def register(mi, dr) -> None:
    """Makes the type "roughcoat" of the variant that is set."""

    class RoughCoat(mi.BSDF):
        def __init__(self, props: mi.Properties) -> None:
            mi.BSDF.__init__(self, props)
            self.alpha = float(props["roughness"]) ** 2
            self.ior = float(props["ior"])
            self.color = mi.Color3f([float(props[c]) for c in ("red", "green", "blue")])
            self.facets = mi.MicrofacetDistribution(mi.MicrofacetType.GGX, self.alpha)
            albedo = albedo_table(self.alpha, self.ior)
            cosines = np.linspace(0, 1, TABLE)
            self.mean = float(np.trapezoid(2 * cosines * albedo, cosines))
            self.albedo = mi.Float(albedo.astype(np.float32))
            flags = mi.BSDFFlags.DiffuseReflection | mi.BSDFFlags.FrontSide
            self.m_components = [flags]
            self.m_flags = flags

        def reflected(self, cosine: mi.Float) -> mi.Float:
            place = dr.clip(cosine, 0, 1) * (TABLE - 1)
            index = mi.UInt32(dr.minimum(place, TABLE - 2))
            low = dr.gather(mi.Float, self.albedo, index)
            return low + (place - index) * (dr.gather(mi.Float, self.albedo, index + 1) - low)

        def value(self, wi: mi.Vector3f, wo: mi.Vector3f) -> mi.Color3f:
            cos_i, cos_o = mi.Frame3f.cos_theta(wi), mi.Frame3f.cos_theta(wo)
            h = dr.normalize(wi + wo)
            masking = 1 / self.facets.smith_g1(wi, h) + 1 / self.facets.smith_g1(wo, h) - 1
            fresnel = mi.fresnel(dr.dot(wi, h), self.ior)[0]
            coat = fresnel * self.facets.eval(h) / (masking * 4 * cos_i)
            inner = 1 - (1 - self.mean) / self.ior**2
            body = self.color * (1 - inner) / (1 - self.color * inner)
            through = (1 - self.reflected(cos_i)) * (1 - self.reflected(cos_o))
            value = body * (through * cos_o / (dr.pi * (1 - self.mean))) + coat
            return dr.select((cos_i > 0) & (cos_o > 0), value, 0)

        def sample(self, ctx, si, sample1, sample2, active=True):
            wo = mi.warp.square_to_cosine_hemisphere(sample2)
            bs = mi.BSDFSample3f()
            bs.wo, bs.eta, bs.sampled_component = wo, 1.0, 0
            bs.sampled_type = mi.UInt32(+mi.BSDFFlags.DiffuseReflection)
            bs.pdf = mi.warp.square_to_cosine_hemisphere_pdf(wo)
            found = active & (bs.pdf > 0) & (mi.Frame3f.cos_theta(si.wi) > 0)
            return bs, dr.select(found, self.value(si.wi, wo) / bs.pdf, 0)

        def eval(self, ctx, si, wo, active=True):
            return dr.select(active, self.value(si.wi, wo), 0)

        def pdf(self, ctx, si, wo, active=True):
            lit = active & (mi.Frame3f.cos_theta(si.wi) > 0)
            return dr.select(lit, mi.warp.square_to_cosine_hemisphere_pdf(wo), 0)

        def eval_pdf(self, ctx, si, wo, active=True):
            return self.eval(ctx, si, wo, active), self.pdf(ctx, si, wo, active)

        def to_string(self) -> str:
            return f"RoughCoat[alpha={self.alpha}]"

    mi.register_bsdf("roughcoat", RoughCoat)


def albedo_table(alpha: float, ior: float) -> np.ndarray:
    """What the coat reflects of light from each cosine.

    The mean over facets, chosen by their distribution times cosine, of
    Fresnel x masking x (in . facet) / ((in . normal) (facet . normal)).
    """
    u = (np.arange(GRID) + 0.5) / GRID
    tangent = alpha * np.sqrt(u / (1 - u))
    angle = 2 * np.pi * u
    slope_x, slope_y = (tangent[:, None] * f(angle) for f in (np.cos, np.sin))
    hz = np.broadcast_to(1 / np.sqrt(1 + tangent**2)[:, None], slope_x.shape)
    hx, hy = slope_x * hz, slope_y * hz
    return np.array([albedo_at(c, alpha, ior, hx, hy, hz) for c in np.linspace(0, 1, TABLE)])


def albedo_at(cosine: float, alpha: float, ior: float, hx, hy, hz) -> float:
    z = max(cosine, 1e-3)
    x = np.sqrt(1 - z * z)
    dot = x * hx + z * hz
    out = np.stack([2 * dot * hx - x, 2 * dot * hy, 2 * dot * hz - z])
    seen = (dot > 0) & (out[2] > 0)
    masking = 1 + smith_lambda(x * x, z, alpha)
    masking = masking + smith_lambda(out[0] ** 2 + out[1] ** 2, np.where(seen, out[2], 1), alpha)
    weight = fresnel(np.where(seen, dot, 1), ior) * dot / (masking * z * hz)
    return float(np.where(seen, weight, 0).mean())


def smith_lambda(sine2, cosine, alpha: float):
    return (np.sqrt(1 + alpha**2 * sine2 / cosine**2) - 1) / 2


def fresnel(cosine: np.ndarray, ior: float) -> np.ndarray:
    inner = np.sqrt(1 - (1 - cosine**2) / ior**2)
    s = (cosine - ior * inner) / (cosine + ior * inner)
    p = (ior * cosine - inner) / (ior * cosine + inner)
    return (s * s + p * p) / 2
