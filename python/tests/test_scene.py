from pathlib import Path

import numpy as np
import pytest

import steradian

TEXT = 'WorldBegin\nLightSource "infinite"\nMaterial "diffuse" "rgb reflectance" [ 0.5 0.5 0.5 ]\nShape "sphere"\n'


def test_parameters(box: steradian.Scene) -> None:
    assert box["camera.fov"] == pytest.approx(40)
    assert box["materials.red.reflectance"] == pytest.approx([0.8, 0.1, 0.1], abs=2e-3)
    before = np.asarray(box.render(spp=4))
    other = box.copy()
    other["materials.red.reflectance"] = np.array([0.1, 0.1, 0.8])
    other["camera.fov"] = 30
    other["lights.0.radiance"] = (1, 1, 1)
    assert np.array_equal(before, np.asarray(box.render(spp=4))), "a copy is a copy"
    assert box.hash != other.hash
    after = np.asarray(other.render(spp=4))
    assert after[16, 20, 2] > after[16, 20, 0] and before[16, 20, 2] < before[16, 20, 0]
    with pytest.raises(KeyError, match="camera.fov"):
        box["camera.fv"] = 3
    with pytest.raises(steradian.InputError, match="between 0 and 180"):
        box["camera.fov"] = 200
    with pytest.raises(steradian.InputError, match="not be negative"):
        box["lights.0.radiance"] = (1, -1, 1)
    assert "camera.fov" in box.keys() and "camera.fov" in box._ipython_key_completions_()


def test_look_at_is_pbrts() -> None:
    description = {
        "film": {"size": (24, 16)},
        "lights": [{"type": "infinite"}],
        "shapes": [{"type": "sphere", "translate": (0.5, 0.3, 0), "material": {"type": "diffuse", "reflectance": [0.2, 0.4, 0.6]}}],
    }
    there = steradian.build({**description, "camera": {"fov": 45, "look_at": [(1, 2, 6), (0, 0, 0)]}})
    moved = steradian.build({**description, "camera": {"fov": 45, "look_at": [(4, 2, 1), (0, 1, 0)]}})
    moved.look_at((1, 2, 6), (0, 0, 0))
    assert np.allclose(moved["camera.to_world"], there["camera.to_world"], atol=1e-5)
    assert np.allclose(np.asarray(moved.render(spp=4)), np.asarray(there.render(spp=4)), atol=1e-3)


def test_problems_have_a_place(tmp_path: Path) -> None:
    with pytest.raises(steradian.SceneError) as e:
        steradian.loads(TEXT.replace('"sphere"', '"spere"'), "mine.pbrt")
    assert (e.value.file, e.value.line) == ("mine.pbrt", 4) and e.value.column is not None
    assert "sphere" in str(e.value) and e.value.diagnostics[0].severity == "error"
    with pytest.raises(steradian.SceneError, match="no such file"):
        steradian.load(tmp_path / "none.pbrt")
    scene = steradian.loads('Sampler "halton"\nSampler "pmj02bn"\n' + TEXT)
    assert [d.severity for d in scene.warnings] == ["warning"] and scene.warnings[0].line == 2


def test_arrays_become_meshes_and_pictures() -> None:
    rng = np.random.default_rng(1)
    texels = rng.random((4, 4, 3)).astype(np.float32)
    corners = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    uv = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    scene = steradian.build(
        {
            "camera": {"type": "orthographic", "look_at": [(0, 0, 5), (0, 0, 0)]},
            "film": {"size": (8, 8)},
            "textures": {"t": {"type": "imagemap", "filename": texels, "filter": "point", "encoding": "linear"}},
            "materials": {"m": {"type": "diffuse", "texture reflectance": "t"}},
            "lights": [{"type": "infinite", "L": [1, 1, 1]}],
            "shapes": [{"vertices": corners, "faces": [[0, 1, 2], [0, 2, 3]], "uv": uv, "material": "m"}],
        }
    )
    seen = scene.render(integrator="albedo", spp=4, color="rgb", filter="box")
    # pbrt's camera looks along +z with x to the right: seen from z = 5, x goes left.
    cells = np.asarray(seen).reshape(4, 2, 4, 2, 3).mean(axis=(1, 3))
    assert min(np.abs(cells - texels).max(), np.abs(cells - texels[:, ::-1]).max()) < 0.02


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"shapes": [{"vertices": [[0, 0]], "faces": [[0, 0, 0]]}]}, "N x 3"),
        ({"shapes": [{"vertices": [[0.0, 0, 0]], "faces": [[0, 0, 1]]}]}, "from 0 to 0"),
        ({"shapes": [{"vertices": [[np.nan, 0, 0]], "faces": [[0, 0, 0]]}]}, "finite"),
        ({"shapes": [{"radius": 1}]}, "needs a 'type'"),
        ({"lamps": []}, "lamps"),
        ({"lights": [{"type": "point", "I": [1, 2, np.inf]}]}, "finite"),
        ({"camera": {"fov": object()}}, "numbers"),
    ],
)
def test_descriptions_that_make_no_sense(change: dict, said: str) -> None:
    with pytest.raises(steradian.InputError, match=said):
        steradian.build(change)


def test_errors_of_a_description_are_errors_of_a_scene() -> None:
    with pytest.raises(steradian.SceneError, match="reflectanse"):
        steradian.build({"materials": {"m": {"type": "diffuse", "rgb reflectanse": [1, 1, 1]}}, "shapes": [{"type": "sphere"}]})


def test_packed_scenes_travel_whole(box: steradian.Scene) -> None:
    box["camera.fov"] = 33
    there = steradian.Scene.unpack(box.pack())
    assert there.hash == box.hash and there["camera.fov"] == pytest.approx(33)
    assert np.array_equal(np.asarray(there.render(spp=2)), np.asarray(box.render(spp=2)))
    packed = bytearray(box.pack())
    packed[100] ^= 1
    with pytest.raises(steradian.InputError, match="damaged"):
        steradian.Scene.unpack(bytes(packed))


def test_a_packed_scene_reads_no_file(tmp_path: Path) -> None:
    (tmp_path / "part.pbrt").write_text('Shape "sphere"\n')
    (tmp_path / "s.pbrt").write_text('WorldBegin\nLightSource "infinite"\nInclude "part.pbrt"\n')
    scene = steradian.load(tmp_path / "s.pbrt")
    packed = scene.pack()
    (tmp_path / "part.pbrt").unlink()
    assert steradian.Scene.unpack(packed).hash == scene.hash
    with pytest.raises(steradian.MachineError, match="part.pbrt"):
        scene.pack()
