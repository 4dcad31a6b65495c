import numpy as np
import pytest

import steradian


@pytest.fixture()
def box() -> steradian.Scene:
    """A lit ball on a floor, small enough to render many times."""
    corners = np.array([[-3, 0, -3], [3, 0, -3], [3, 0, 3], [-3, 0, 3]], dtype=np.float32)
    return steradian.build(
        {
            "camera": {"fov": 40, "look_at": [(0, 1, 5), (0, 0.5, 0)]},
            "film": {"size": (40, 30)},
            "sampler": {"type": "zsobol", "pixelsamples": 8},
            "integrator": {"type": "path", "maxdepth": 4},
            "materials": {
                "grey": {"type": "diffuse", "reflectance": [0.5, 0.5, 0.5]},
                "red": {"type": "diffuse", "reflectance": [0.8, 0.1, 0.1]},
            },
            "lights": [{"type": "infinite", "L": [0.4, 0.45, 0.5]}],
            "shapes": [
                {"vertices": corners, "faces": [[0, 2, 1], [0, 3, 2]], "material": "grey"},
                {"type": "sphere", "radius": 0.5, "material": "red", "translate": (0, 0.5, 0)},
                {"type": "sphere", "radius": 0.2, "emission": 8.0, "translate": (1, 2, 0)},
            ],
        }
    )
