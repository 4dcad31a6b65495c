"""What a render on many nodes costs besides rendering: a simulation fed with measured numbers.

    python thousand_nodes.py [--nodes 1,10,100,1000] [--hours 1] ...

One driver hands out parts, as `steradian render --engine ray` does. The scene goes from node to node; each node reads it and builds its trees
once; parts come back over the driver's one link, are written to its disk and are joined at the end. Some nodes are slow, some die; the part of
a dead node is noticed as lost after a while and given to another one. Nothing here is random but by the seed.
"""

from __future__ import annotations

import argparse
import heapq
import math
import random
from dataclasses import dataclass

TILE = 16
TILES_EACH = 8


@dataclass(frozen=True)
class Costs:
    """Rates of reading and merging, start and part as measured (docs/cluster.md); disk, network and nodes as assumed."""

    scene_bytes: float = 1e9
    read_rate: float = 150e6  # bytes of scene read and built into trees, a second, by a node
    start: float = 2.0  # a worker's process
    part: float = 0.04  # a part besides its samples: its task, its film, its bytes
    store_rate: float = 500e6  # bytes of parts that the driver takes and writes, a second
    merge_rate: float = 200e6  # bytes of parts joined, a second
    link: float = 1.25e9  # bytes a second between two nodes, and to the driver
    cores: int = 32
    jitter: float = 0.05  # spread of the speed of nodes, and again of parts
    slow_share: float = 0.01  # nodes that are slow
    slow: float = 3.0  # by this
    life: float = 7.0 * 24 * 3600  # of a node, on average
    notice: float = 30.0  # until a dead node is known to be dead


@dataclass(frozen=True)
class Picture:
    width: int = 1920
    height: int = 1080
    spp: int = 4096

    @property
    def tiles(self) -> int:
        return math.ceil(self.width / TILE) * math.ceil(self.height / TILE)


def cut(picture: Picture, parts: int, by_samples: bool) -> tuple[int, int]:
    """Groups of tiles and pieces of samples, as `Share::of` cuts; all by samples if so wished."""
    if by_samples:
        return 1, parts
    groups = max(g for g in range(1, parts + 1) if parts % g == 0 and (picture.tiles >= g * TILES_EACH or g == 1))
    return groups, parts // groups


def sums_of(first: int, end: int) -> int:
    """How many partial sums the samples ``first`` to ``end`` have: the blocks of the dyadic tree that cover them."""
    count = 0
    while first < end:
        step = 1 << (end - first).bit_length() - 1
        while first % step:
            step //= 2
        first, count = first + step, count + 1
    return count


def bytes_of(picture: Picture, parts: int, by_samples: bool) -> float:
    """Of all parts together: six floats for each partial sum of a pixel, and what every part says of every tile."""
    groups, pieces = cut(picture, parts, by_samples)
    edges = [picture.spp * k // pieces for k in range(pieces + 1)]
    sums = sum(sums_of(a, b) for a, b in zip(edges, edges[1:]))
    return picture.width * picture.height * 24.0 * sums + parts * picture.tiles * 52.0


@dataclass
class Outcome:
    wall: float
    ship: float
    build: float
    tail: float
    merge: float
    efficiency: float
    repeated: int
    second: int
    gigabytes: float
    driver: float


def simulate(nodes: int, core_hours: float, parts_each: int, costs: Costs, picture: Picture, by_samples: bool, patience: float, seed: int) -> Outcome:
    rng = random.Random(seed)
    parts = nodes * parts_each
    work = core_hours * 3600 / costs.cores / parts  # of a part, on a node as it should be
    total = bytes_of(picture, parts, by_samples)
    each = total / parts
    # Whoever has the scene gives it to one other at a time.
    hop = costs.scene_bytes / costs.link
    speed = []
    ready = []
    for i in range(nodes):
        arrives = hop * math.ceil(math.log2(i + 2))
        slow = costs.slow if rng.random() < costs.slow_share else 1.0
        speed.append(math.exp(rng.gauss(0.0, costs.jitter)) / slow)
        ready.append(arrives + costs.start + costs.scene_bytes / costs.read_rate * slow)
    death = [rng.expovariate(1.0 / costs.life) for _ in range(nodes)]
    free = [(ready[i], i) for i in range(nodes)]
    heapq.heapify(free)
    waiting = list(range(parts))[::-1]
    begun = [0.0] * parts
    finished = [math.inf] * parts
    copies = [0] * parts
    noticed = [math.inf] * parts  # when the part of a dead node goes to another one
    under_way = list(range(parts))
    repeated = second = 0
    while free:
        now, node = heapq.heappop(free)
        if waiting:
            part = waiting.pop()
        else:
            # What is lost, as soon as that is known; else a second copy of what takes too long.
            under_way = [i for i in under_way if finished[i] > now]
            open_parts = [(noticed[i], i) for i in under_way if noticed[i] < finished[i]]
            if patience > 0.0:
                late = [(begun[i] + patience * work, i) for i in under_way if copies[i] == 1]
                open_parts += [(when, i) for when, i in late if when < finished[i]]
            if not open_parts:
                continue
            when, part = min(open_parts)
            if when > now:
                heapq.heappush(free, (when, node))
                continue
            repeated, second = repeated + (noticed[part] < math.inf), second + (noticed[part] == math.inf)
            noticed[part] = math.inf
        begun[part], copies[part] = now, copies[part] + 1
        took = work / speed[node] * math.exp(rng.gauss(0.0, costs.jitter)) + costs.part
        if death[node] < now + took:
            noticed[part] = max(death[node], now) + costs.notice
            continue
        finished[part] = min(finished[part], now + took)
        heapq.heappush(free, (now + took, node))
    arrivals = finished
    # One link and one disk take what comes, in turn.
    arrivals.sort()
    if arrivals[-1] == math.inf:
        raise RuntimeError("all nodes died")
    at = 0.0
    for when in arrivals:
        at = max(at, when) + each / min(costs.link, costs.store_rate)
    merge = total / costs.merge_rate
    wall = at + merge
    even = work * parts / sum(speed)  # if all came to an end at once
    ship = hop * math.ceil(math.log2(nodes + 1))
    build = costs.start + costs.scene_bytes / costs.read_rate
    tail = at - ship - build - even
    return Outcome(wall, ship, build, tail, merge, even / wall, repeated, second, total / 1e9, total / min(costs.link, costs.store_rate) / wall)


def main() -> None:
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("--nodes", default="1,10,100,1000", help="numbers of nodes")
    p.add_argument("--hours", type=float, default=1.0, help="of pure rendering, on all nodes of a row")
    p.add_argument("--parts-each", default="4,16,64", help="parts for each node")
    p.add_argument("--patience", type=float, default=1.5, help="a part that takes so many times as long as parts do is begun a second time")
    p.add_argument("--seed", type=int, default=1)
    for name, value in vars(Costs()).items():
        p.add_argument("--" + name.replace("_", "-"), type=type(value), default=value)
    a = p.parse_args()
    costs = Costs(**{name: getattr(a, name) for name in vars(Costs())})
    picture = Picture()
    print("| nodes | parts each | cut | backups | ship s | build s | last parts s | merge s | parts GB | driver busy | lost | twice | efficiency |")
    print("| ---: | ---: | --- | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |")
    for nodes in map(int, a.nodes.split(",")):
        for each in map(int, a.parts_each.split(",")):
            for by_samples, patience in ((True, 0.0), (False, 0.0), (False, a.patience)):
                groups, pieces = cut(picture, nodes * each, by_samples)
                core_hours = a.hours * nodes * costs.cores
                o = simulate(nodes, core_hours, each, costs, picture, by_samples, patience, a.seed)
                print(
                    f"| {nodes} | {each} | {groups} x {pieces} | {'yes' if patience else 'no'} | {o.ship:.0f} | {o.build:.0f} | {o.tail:.0f} |"
                    f" {o.merge:.0f} | {o.gigabytes:.1f} | {100 * o.driver:.0f} % | {o.repeated} | {o.second} | {o.efficiency:.3f} |"
                )


if __name__ == "__main__":
    main()
