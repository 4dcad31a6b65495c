"""A scene as files for Steradian, pbrt and Mitsuba: SCENE FOLDER. A process of its own, so that its memory is not its parent's."""

from __future__ import annotations

import json
import sys
from pathlib import Path

from ..scenes import SCENES
from ..writers import mitsuba, pbrt


def main() -> None:
    """Writes the files, and facts.json for those who do not want to build the scene again."""
    name, folder = sys.argv[1], Path(sys.argv[2])
    scene = SCENES[name]()
    pbrt.write(scene, folder)
    mitsuba.write(scene, folder)
    facts = {"name": name, "sentence": scene.sentence, "triangles": scene.triangles(), "depth": scene.depth, "spp": list(scene.spp),
             "size": [scene.camera.width, scene.camera.height]}
    (folder / "facts.json").write_text(json.dumps(facts))


main()
