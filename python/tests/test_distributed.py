"""Two nodes on this machine: merged pictures have the bytes of local ones, whatever dies."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import steradian
from steradian import distributed

ray = pytest.importorskip("ray")


@pytest.fixture(scope="module")
def cluster() -> Iterator[object]:
    from ray.cluster_utils import Cluster

    cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 1, "include_dashboard": False})
    cluster.add_node(num_cpus=1)
    yield cluster
    cluster.shutdown()


def test_round_shards_cover_what_is_new() -> None:
    from fractions import Fraction

    for first, end in [(0, 32), (32, 48), (48, 64), (64, 96), (96, 128), (128, 192)]:
        for most in (1, 3, 8, 100):
            at = Fraction(first)
            for shard in distributed._round_shards(first, end, most):
                i, n = map(int, shard.split("/"))
                assert Fraction(end * (i - 1), n) == at
                at = Fraction(end * i, n)
            assert at == end


def test_parts_join_to_the_whole(box: steradian.Scene, tmp_path: Path) -> None:
    words = ["--spp=8", "--threads=1"]
    parts = [tmp_path / f"{i}.part" for i in (1, 2, 3)]
    for i, path in enumerate(parts, 1):
        path.write_bytes(box._native.part([*words, f"--shard={i}/3"], True))
    image = distributed._joined(parts[::-1])[0]
    assert np.array_equal(np.asarray(image), np.asarray(box.render(spp=8)))
    some, complete, _ = distributed._joined(parts[:2], partial=True)
    assert complete == pytest.approx(2 / 3, abs=0.15) and np.asarray(some).mean() > 0
    with pytest.raises(steradian.InputError, match="missing"):
        distributed._joined(parts[:2])


def same(one: steradian.Image, other: steradian.Image) -> bool:
    """Whether all channels have the same bits."""
    return one.channels == other.channels and all(np.array_equal(one[c], other[c]) for c in one.channels)


def test_two_nodes(cluster: object, box: steradian.Scene, tmp_path: Path) -> None:
    seen: list[steradian.Image] = []
    aovs = ["albedo", "normal", "crypto-object", "direct", "variance"]
    image = distributed.render(
        box, spp=32, parts=6, aovs=aovs, address=cluster.address, spill=tmp_path, preview=seen.append  # type: ignore[attr-defined]
    )
    assert same(image, box.render(spp=32, aovs=aovs))
    assert not list(tmp_path.rglob("*.part")), "what is merged is not kept"


def test_an_error_goal_ends_where_it_does_here(cluster: object, box: steradian.Scene, tmp_path: Path) -> None:
    options = {"error": 0.25, "spp": 512, "aovs": ["depth", "indirect", "error"]}
    image = distributed.render(box, parts=2, address=cluster.address, spill=tmp_path, **options)  # type: ignore[attr-defined]
    here = box.render(no_adaptive=True, **options)
    assert here.outcome == image.outcome == "error reached"
    assert same(image, here)
    # What they say of themselves differs in when and where, and nothing else.
    own = {"renderTimeSeconds", "steradian.date", "steradian.threads"}
    differs = {n for n in {*image.metadata, *here.metadata} if image.metadata.get(n) != here.metadata.get(n)}
    assert differs <= own, differs


def test_a_worker_that_is_killed_loses_nothing(cluster: object, box: steradian.Scene, tmp_path: Path) -> None:
    killed: list[int] = []

    def kill(_: float) -> None:
        if not killed:
            me = os.getpid()
            listing = subprocess.run(["ps", "-eo", "pid,args"], capture_output=True, text=True, check=True).stdout
            for line in listing.splitlines():
                pid, _, command = line.strip().partition(" ")
                if "ray::_render_part" in command and int(pid) != me:
                    os.kill(int(pid), signal.SIGKILL)
                    killed.append(int(pid))
                    return

    image = distributed.render(
        box, spp=512, parts=4, address=cluster.address, spill=tmp_path, progress=kill  # type: ignore[attr-defined]
    )
    assert killed, "there was a worker to kill"
    assert np.array_equal(np.asarray(image), np.asarray(box.render(spp=512)))


def test_a_node_that_is_killed_loses_nothing(cluster: object, box: steradian.Scene, tmp_path: Path) -> None:
    node = cluster.add_node(num_cpus=1)  # type: ignore[attr-defined]
    raylet = node.all_processes["raylet"][0].process.pid
    killed: list[float] = []

    def kill(fraction: float) -> None:
        # Parts are under way everywhere by now.
        if fraction > 0.2 and not killed:
            os.kill(raylet, signal.SIGKILL)
            killed.append(fraction)

    options = {"spp": 1024, "aovs": ["normal"]}
    image = distributed.render(
        box, parts=24, address=cluster.address, spill=tmp_path, progress=kill, **options  # type: ignore[attr-defined]
    )
    assert killed, "there was a node to kill"
    cluster.remove_node(node, allow_graceful=False)  # type: ignore[attr-defined]
    assert same(image, box.render(**options))


def test_late_parts_are_given_to_the_idle() -> None:
    now = time.monotonic()
    late = distributed._Driver.late
    under_way = {"a": (7, now - 100.0), "b": (8, now - 50.0), "c": (9, now - 2.0)}
    assert late(under_way, [10.0], 5) == [7, 8], "the oldest first, none that is no later than others"
    assert late(under_way, [10.0], 4) == [7], "no more than are idle"
    assert late(under_way, [10.0], 3) == late(under_way, [], 5) == []
    assert late({**under_way, "d": (7, now)}, [10.0], 9) == [8], "twice is enough"


def test_errors_of_a_part_come_through(cluster: object, box: steradian.Scene, tmp_path: Path) -> None:
    with pytest.raises(steradian.InputError, match="does not tell"):
        distributed.render(
            box, integrator="normals", aovs=["direct"], address=cluster.address, spill=tmp_path  # type: ignore[attr-defined]
        )
    with pytest.raises(steradian.InputError, match="time"):
        distributed.render(box, time=3)


def test_a_driver_that_is_killed_is_continued(cluster: object, box: steradian.Scene, tmp_path: Path) -> None:
    text = (
        "import sys, steradian\nfrom steradian import distributed\n"
        "scene = steradian.load()\n"
        "distributed.render(scene, spp=64, size=(96, 60), parts=8, address=sys.argv[1], spill=sys.argv[2])\n"
    )
    driver = subprocess.Popen([sys.executable, "-c", text, cluster.address, str(tmp_path)])  # type: ignore[attr-defined]
    end = time.monotonic() + 120
    while not list(tmp_path.rglob("0*.part")) and time.monotonic() < end and driver.poll() is None:
        time.sleep(0.02)
    driver.send_signal(signal.SIGKILL)
    driver.wait()
    kept = len(list(tmp_path.rglob("0*.part")))
    assert 0 < kept, "there were parts to go on with"
    fractions: list[float] = []
    image = distributed.render(
        None,
        spp=64,
        size=(96, 60),
        parts=8,
        address=cluster.address,  # type: ignore[attr-defined]
        spill=tmp_path,
        progress=fractions.append,
    )
    assert fractions[0] >= kept / 8
    assert np.array_equal(np.asarray(image), np.asarray(steradian.render(spp=64, size=(96, 60))))
