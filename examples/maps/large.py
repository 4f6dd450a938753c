#!/usr/bin/env python3
"""Large maps to measure with: python3 large.py FOLDER [CELLS] [WALLS]

Writes FOLDER/building.yaml with a picture of CELLS x CELLS cells of 0.05 m (4000), FOLDER/blocks.geojson with WALLS walls
(100000), and a scenario of eight robots for each, and for the same robots without a map."""

import json
import random
import sys
from pathlib import Path

folder = Path(sys.argv[1])
cells = int(sys.argv[2]) if len(sys.argv) > 2 else 4000
walls = int(sys.argv[3]) if len(sys.argv) > 3 else 100_000
folder.mkdir(parents=True, exist_ok=True)
random.seed(1)

# A building: rooms of 8 m with walls of 0.1 m, doors of 1.6 m, and pillars.
room, thick, door = 160, 2, 32
picture = bytearray(b"\xfe" * (cells * cells))


def fill(left, top, right, bottom, shade):
    for row in range(max(top, 0), min(bottom, cells)):
        picture[row * cells + max(left, 0) : row * cells + min(right, cells)] = bytes([shade]) * (min(right, cells) - max(left, 0))


for at in range(0, cells, room):
    fill(0, at, cells, at + thick, 0)
    fill(at, 0, at + thick, cells, 0)
for y in range(0, cells, room):
    for x in range(0, cells, room):
        if x > 0:
            side = y + 40 + random.randrange(60)
            fill(x, side, x + thick, side + door, 254)
        if y > 0:
            side = x + 40 + random.randrange(60)
            fill(side, y, side + door, y + thick, 254)
        for _ in range(3):
            px, py = x + 30 + random.randrange(90), y + 30 + random.randrange(90)
            fill(px, py, px + 4 + random.randrange(8), py + 4 + random.randrange(8), 0)
(folder / "building.pgm").write_bytes(b"P5 %d %d 255\n" % (cells, cells) + bytes(picture))
(folder / "building.yaml").write_text(
    "image: building.pgm\nresolution: 0.05\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
)

# Blocks of four walls on a lattice of 4 m.
side = round((walls / 4) ** 0.5)
squares = []
for index in range(walls // 4):
    x, y = 4 * (index % side) + 2 + random.random(), 4 * (index // side) + 2 + random.random()
    squares.append([[[x, y], [x + 1, y], [x + 1, y + 1], [x, y + 1], [x, y]]])
(folder / "blocks.geojson").write_text(json.dumps({"type": "MultiPolygon", "coordinates": squares}))


def scenario(name, world, size, starts):
    robots = "".join(
        f'[[robot]]\nid = "r{i}"\nstart_m = [{x}, {y}]\ngoal_m = [{gx}, {gy}]\n' for i, ((x, y), (gx, gy)) in enumerate(starts)
    )
    (folder / f"{name}.toml").write_text(
        f"[world]\n{world}\nx_m = [0, {size}]\ny_m = [0, {size}]\n[clock]\nmode = \"single\"\ntick_hz = 20.0\nduration_s = 30.0\n"
        f'[defaults]\nplanner = "lanes"\nradius_m = 0.2\nknows_map = true\n{robots}'
    )


size = cells * 0.05
spots = [(0.75 + 8 * i, 0.75 + 8 * i) for i in range(8)]
ends = list(zip(spots, [(x + 32, y + 24) for x, y in spots]))
scenario("building", 'map = "building.yaml"', size, ends)
scenario("building-without", "", size, ends)
spots = [(0.9 + 40 * i, 0.9 + 40 * i) for i in range(8)]
ends = list(zip(spots, [(x + 80, y + 60) for x, y in spots]))
scenario("blocks", 'map = "blocks.geojson"', 4 * side + 4, ends)
scenario("blocks-without", "", 4 * side + 4, ends)
