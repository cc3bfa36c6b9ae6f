"""solidtex: solid textures learned from one photograph, evaluated anywhere in 3D space.

    import numpy as np
    import solidtex

    granite = solidtex.Texture("granite-grey", seed=7)
    colors = granite.eval_points(np.float32([[0.5, 0.5, 0.5], [10, -3.25, 7]]))
    voxels = granite.eval_box((0, 0, 0), (64, 64, 64))

Coordinates are texels: one texel is one pixel of the exemplar. Voxel (i, j, k) covers [i, i + 1) x
[j, j + 1) x [k, k + 1). A value depends only on the file, the seed, the precision and the position.
"""

from solidtex._engine import target, version
from solidtex.errors import (
    Cancelled,
    Error,
    FileError,
    InternalError,
    InvalidArgument,
    ModelError,
    OutOfMemory,
    Unavailable,
)
from solidtex.space import Material, Space
from solidtex.texture import Statistics, Texture, load, models

__all__ = [
    "Cancelled",
    "Error",
    "FileError",
    "InternalError",
    "InvalidArgument",
    "Material",
    "ModelError",
    "OutOfMemory",
    "Space",
    "Statistics",
    "Texture",
    "Unavailable",
    "load",
    "models",
    "target",
    "version",
]

__version__ = version()
