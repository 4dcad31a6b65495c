import threading
import time
from pathlib import Path

import numpy as np
import pytest

import steradian


def test_the_bytes_do_not_depend_on_threads_and_other_threads_run(box: steradian.Scene) -> None:
    beats = 0
    stop = threading.Event()

    def beat() -> None:
        nonlocal beats
        while not stop.is_set():
            beats += 1
            time.sleep(0.001)

    thread = threading.Thread(target=beat)
    thread.start()
    one = np.asarray(box.render(threads=1, spp=64))
    stop.set()
    thread.join()
    assert one.shape == (30, 40, 3) and one.dtype == np.float32 and np.isfinite(one).all() and one.mean() > 0.05
    assert beats > 3, "the interpreter is not held while rendering"
    assert np.array_equal(one, np.asarray(box.render(threads=2, spp=64)))
    assert not np.array_equal(one, np.asarray(box.render(threads=2, spp=64, seed=1)))


def test_layers(box: steradian.Scene) -> None:
    image = box.render(aovs=["albedo", "normal", "depth", "emission", "direct", "indirect"], spp=4, color="rgb")
    assert {"", "albedo", "N", "Z", "emission", "direct", "indirect"} <= set(image)
    assert image["albedo"].shape == (30, 40, 3) and image["Z"].shape == (30, 40)
    middle = image["albedo"][17, 20]
    assert np.allclose(middle, [0.8, 0.1, 0.1], atol=0.02), middle
    parts = image["emission"] + image["direct"] + image["indirect"]
    assert np.allclose(parts, np.asarray(image), rtol=1e-5, atol=1e-6)
    with pytest.raises(KeyError, match="albedo"):
        image["albdo"]


def test_the_same_as_the_command_line(box: steradian.Scene, tmp_path: Path) -> None:
    text, files = steradian.describe({"film": {"size": (8, 6)}, "lights": [{"type": "infinite", "L": [1, 2, 3]}]})
    assert not files
    (tmp_path / "s.pbrt").write_text(text)
    assert steradian.run(["render", str(tmp_path / "s.pbrt"), "--spp", "3", "--quiet", "-o", str(tmp_path / "a.exr")]) == 0
    a = steradian.read(tmp_path / "a.exr")
    b = steradian.load(tmp_path / "s.pbrt").render(spp=3)
    assert np.array_equal(np.asarray(a), np.asarray(b))
    assert a.metadata["steradian.sceneHash"] == b.metadata["steradian.sceneHash"]
    assert steradian.run(["render", str(tmp_path / "none.pbrt"), "-o", str(tmp_path / "c.exr"), "--quiet"]) == 2


def test_progressive(box: steradian.Scene) -> None:
    frames = list(steradian.render_progressive(box, spp=32, threads=1))
    assert np.array_equal(np.asarray(frames[-1]), np.asarray(box.render(spp=32)))
    for _ in steradian.render_progressive(box, spp=100_000):
        break  # leaving ends the render, else this test would take for ever


def test_progress_and_errors_of_it(box: steradian.Scene) -> None:
    heard: list[float] = []
    box.render(spp=256, progress=lambda p: heard.append(p["fraction"]))
    assert heard and heard == sorted(heard) and heard[-1] <= 1.0

    def refuse(_: object) -> None:
        raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        box.render(spp=100_000, progress=refuse)


def test_stop_rules(box: steradian.Scene) -> None:
    image = box.render(error=0.2, spp=4096)
    assert image.outcome == "error reached" and image.metadata["steradian.errorBound"] <= 0.2
    assert box.render(time=0.05, spp=1 << 20).outcome == "time limit"


def test_options_that_make_no_sense(box: steradian.Scene) -> None:
    with pytest.raises(steradian.InputError, match="integrator"):
        box.render(integrator="pathh")
    with pytest.raises(steradian.InputError, match="unexpected"):
        box.render(samples=3)
    with pytest.raises(steradian.InputError, match="no place"):
        box.render(output="x.exr")


def test_pictures(box: steradian.Scene, tmp_path: Path) -> None:
    image = box.render(spp=4)
    image.write(tmp_path / "a.exr")
    image.write(tmp_path / "a.png", exposure="auto")
    assert np.array_equal(np.asarray(steradian.read(tmp_path / "a.exr")), np.asarray(image))
    assert image._repr_png_()[:4] == b"\x89PNG"
    screen = image.tonemapped()
    assert screen.shape == (30, 40, 3) and 0.0 <= screen.min() and screen.max() <= 1.0
    assert steradian.compare(image, image)["mse"] == 0.0
    other = box.render(spp=64, seed=9)
    assert steradian.compare(other, box.render(spp=64))["agree"]
    assert not steradian.compare(np.asarray(other) * 2.0, other)["agree"]
    grey = np.linspace(0, 1, 12, dtype=np.float64).reshape(3, 4)
    steradian.write(tmp_path / "g.pfm", grey)
    assert np.allclose(np.asarray(steradian.read(tmp_path / "g.pfm"))[:, :, 0], grey.astype(np.float32))


def test_memory_does_not_grow_over_200_renders(box: steradian.Scene) -> None:
    def resident() -> int:
        status = Path("/proc/self/status")
        if not status.exists():
            pytest.skip("the system does not say")
        line = next(x for x in status.read_text().splitlines() if x.startswith("VmRSS"))
        return int(line.split()[1]) // 1024

    def some(n: int) -> None:
        for seed in range(n):
            np.asarray(box.render(spp=1, seed=seed, threads=2))

    some(50)
    before = resident()
    some(200)
    assert resident() - before < 16, "megabytes"
