import numpy as np
import pytest

from steradian import sampling


@pytest.mark.parametrize("name", ["uniform_sphere", "uniform_hemisphere", "cosine_hemisphere"])
def test_warps_and_their_inverses(name: str) -> None:
    u = sampling.points("sobol", 1024, 2)
    w = getattr(sampling, f"square_to_{name}")(u)
    assert w.shape == (1024, 3) and np.allclose(np.linalg.norm(w, axis=1), 1.0, atol=1e-5)
    assert np.allclose(getattr(sampling, f"{name}_to_square")(w), u, atol=2e-3)
    # The integral of one over the domain, by importance sampling with the density.
    pdf = getattr(sampling, f"square_to_{name}_pdf")(w)
    domain = 4 * np.pi if "hemi" not in name else 2 * np.pi
    if name != "cosine_hemisphere":
        assert np.allclose(1.0 / pdf, domain, rtol=1e-4)
    else:
        assert np.mean(w[:, 2] / pdf) == pytest.approx(np.pi, rel=1e-4)


def test_sequences() -> None:
    for kind in ("independent", "stratified", "halton", "sobol", "paddedsobol", "zsobol", "pmj02bn"):
        p = sampling.points(kind, 64, 5, seed=3)
        assert p.shape == (64, 5) and (p >= 0).all() and (p < 1).all()
        assert np.array_equal(p, sampling.points(kind, 64, 5, seed=3))
    # 16 points of a (0, 4, 2)-net: one in each square of 4 x 4.
    cells = np.floor(sampling.sobol(16, 2) * 4).astype(int)
    assert len({tuple(c) for c in cells}) == 16
    assert np.allclose(sampling.halton(5, 1)[:, 0], [0, 0.5, 0.25, 0.75, 0.125])
    random = np.random.default_rng(0).random((256, 2), dtype=np.float32)
    assert sampling.star_discrepancy(sampling.sobol(256, 2)) < sampling.star_discrepancy(random) / 2
    with pytest.raises(ValueError, match="zsobol"):
        sampling.points("soboll", 4)


def test_distributions() -> None:
    d = sampling.Piecewise1D(np.array([1, 0, 3], dtype=np.float32), 0.0, 3.0)
    x, pdf = d.sample(np.linspace(0, 0.999, 1000, dtype=np.float32))
    assert d.integral == pytest.approx(4.0) and np.allclose(d.pdf(x), pdf)
    counts = np.histogram(x, bins=3, range=(0, 3))[0]
    assert counts.tolist() == pytest.approx([250, 0, 750], abs=2)
    grid = sampling.Piecewise2D(np.array([[1, 2], [3, 2]], dtype=np.float32))
    p, pdf = grid.sample(sampling.points("sobol", 4096, 2))
    assert np.mean(1.0 / pdf) == pytest.approx(1.0, rel=1e-2) and np.allclose(grid.pdf(p), pdf)
    with pytest.raises(ValueError, match="not negative"):
        sampling.Piecewise1D(np.array([-1.0], dtype=np.float32))
