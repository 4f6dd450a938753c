#!/usr/bin/env python3
"""Writes the crowd scenes beside it: `python3 make.py`. The same files every time."""

import math
import pathlib
import random

HERE = pathlib.Path(__file__).parent
R = 0.2


def number(x):
    return f"{x:.4f}".rstrip("0").rstrip(".")


def point(p):
    return f"[{number(p[0])}, {number(p[1])}]"


def block(x0, y0, x1, y1):
    corners = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]
    return 'shape = "polygon"\ncorners_m = [' + ", ".join(map(point, corners)) + "]"


def disc(x, y, r):
    return f'shape = "disc"\ncenter_m = {point((x, y))}\nradius_m = {number(r)}'


def write(name, about, robots, obstacles=(), duration=300):
    """Robots are (start, goal) or (start, goal, radius)."""
    far = max(max(abs(v) for p in robot[:2] for v in p) for robot in robots) + 4
    lines = [
        f'description = "{about}"',
        "",
        f"[world]\nx_m = [-{number(far)}, {number(far)}]\ny_m = [-{number(far)}, {number(far)}]",
        "",
        f'[clock]\nmode = "single"\ntick_hz = 10\nseed = 1\nduration_s = {duration}',
        "",
        f"[defaults]\nradius_m = {R}\ngoal_tolerance_m = {R}\nspeed_mps_max = 1\nknows_map = true",
        "sensor_range_m = 8\nradio_range_m = 8",
        "",
        "[layout]\nkind = \"list\"",
        f"robots = {len(robots)}\njitter_m = 0.01",
        "starts_m = [" + ", ".join(point(robot[0]) for robot in robots) + "]",
        "goals_m = [" + ", ".join(point(robot[1]) for robot in robots) + "]",
        "",
        f"[fleet]\nmax_robots = {len(robots)}",
    ]
    lines += [f"\n[[obstacle]]\n{text}" for text in obstacles]
    width = len(str(len(robots) - 1)) if len(robots) > 100 else 2
    for index, robot in enumerate(robots):
        if len(robot) > 2:
            lines.append(f'\n[[robot]]\nid = "r{index:0{width}}"\nradius_m = {number(robot[2])}')
    (HERE / f"{name}.toml").write_text("\n".join(lines) + "\n")


def on_circle(count, radius, squeeze=1.0, shake=0.0, draw=random.Random(1)):
    places = []
    for index in range(count):
        angle = 2 * math.pi * (index + shake * draw.uniform(-0.5, 0.5)) / count
        places.append((radius * math.cos(angle), squeeze * radius * math.sin(angle)))
    return places


def across(places, radii=None):
    robots = [(p, (-p[0], -p[1])) for p in places]
    return [robot + (r,) for robot, r in zip(robots, radii)] if radii else robots


def rings():
    for count in (5, 8, 11, 16, 21, 30):
        radius = max(3.5, count * 0.5 / math.pi)
        write(f"ring-{count}", f"{count} robots on an exact circle, each to the place opposite.", across(on_circle(count, radius)))
    for count in (13, 20, 28, 36, 45):
        draw = random.Random(count)
        radii = [draw.uniform(0.12, 0.2) for _ in range(count)]
        places = on_circle(count, max(3.0, count * 0.14), shake=0.3, draw=draw)
        write(f"circle-{count}", f"{count} unequal robots on a circle that is not evenly filled.", across(places, radii))
    for count in (12, 22):
        write(f"ellipse-{count}", f"{count} robots on an ellipse.", across(on_circle(count, 5.5, squeeze=0.6)))


def pillars():
    for count in (6, 10):
        spots = [disc(0, 0, 0.5)] + [disc(2 * math.cos(a), 2 * math.sin(a), 0.35) for a in (0.4, 2.5, 4.6)]
        write(f"pillars-{count}", f"{count} robots on a circle with pillars inside.", across(on_circle(count, 4.2)), spots)
    for count in (10, 16, 22):
        draw = random.Random(100 + count)
        spots = []
        while len(spots) < 6:
            x, y, r = draw.uniform(-2.2, 2.2), draw.uniform(-2.2, 2.2), draw.uniform(0.2, 0.45)
            if all(math.hypot(x - u, y - v) > r + s + 2.6 * R for u, v, s in spots):
                spots.append((x, y, r))
        write(
            f"obstacles-{count}",
            f"{count} robots cross a circle with six obstacles.",
            across(on_circle(count, 4.6, shake=0.2, draw=draw)),
            [disc(*spot) for spot in spots],
        )


def groups(count, rows, gap, x, sign, y=0.0):
    """A block of robots beyond x on one side."""
    return [(sign * (x + gap * (index // rows)), y + (index % rows - (rows - 1) / 2) * gap) for index in range(count)]


def passages():
    for width in (2.4, 2.9, 3.5, 4.5):
        walls = [block(-4, width / 2, 4, width / 2 + 0.5), block(-4, -width / 2 - 0.5, 4, -width / 2)]
        robots = []
        for sign in (-1, 1):
            starts = groups(6, 3, 0.7, 5.2, sign)
            robots += [(p, (-p[0], p[1])) for p in starts]
        write(f"corridor-{width}", f"Two groups of six swap sides through a corridor {width} m wide.", robots, walls)
    for name, width, per_side, both in (
        ("door-0.5", 0.5, 10, False),
        ("door-0.6", 0.6, 14, False),
        ("door-0.9", 0.9, 16, False),
        ("swap-0.5", 0.5, 3, True),
        ("swap-0.6", 0.6, 5, True),
        ("swap-0.8", 0.8, 4, True),
        ("swap-1.2", 1.2, 8, True),
    ):
        walls = [block(-0.3, width / 2, 0.3, 6), block(-0.3, -6, 0.3, -width / 2)]
        starts = groups(per_side, 4, 0.75, 1.4, -1)
        robots = [(p, (3.9 + 1.4 + p[0] if not both else -p[0], p[1])) for p in starts]
        if both:
            robots += [((-p[0], -p[1] + 0.1), (p[0], -p[1] + 0.1)) for p in starts]
            robots = [(s, (g[0] + (1.5 if g[0] > 0 else -1.5), g[1])) for s, g in robots]
        what = "Robots on both sides of a wall swap" if both else "A group goes"
        write(name, f"{what} through a door {width} m wide.", robots, walls)


def streets():
    for side in (3, 4):
        blocks = [block(sx * 2.2 - 1.2, sy * 2.2 - 1.2, sx * 2.2 + 1.2, sy * 2.2 + 1.2) for sx in (-1, 1) for sy in (-1, 1)]
        robots = []
        for sx in (-1, 1):
            for sy in (-1, 1):
                for i in range(side):
                    for j in range(side):
                        p = (sx * (4.6 + 0.8 * i), sy * (4.6 + 0.8 * j))
                        robots.append((p, (-p[0], -p[1])))
        write(f"blocks-{4 * side * side}", "Four groups cross between four blocks.", robots, blocks)
    write("cross-4", "Four robots cross at right angles.", across([(4, 0.05), (0, 4), (-4, 0), (0.05, -4)]))
    walls = [block(-5, 0.45, 5, 0.9), block(-5, -0.9, 5, -0.45)]
    write("hall-2", "Two robots meet in a hall in which they can just pass.", [((-4, 0.2), (4, 0.2)), ((4, -0.2), (-4, -0.2))], walls)


def maps():
    for count, seed in ((12, 3), (20, 5), (28, 8), (36, 9)):
        draw = random.Random(seed)
        cell, half = 1.2, 4 if count < 20 else 5
        taken = {(i, j) for i in range(-half, half) for j in range(-half, half) if draw.random() < 0.2}
        free = [(i, j) for i in range(-half, half) for j in range(-half, half) if (i, j) not in taken]
        # Only cells that hang together: the largest part of the map.
        parts = []
        while free:
            part, todo = set(), [free[0]]
            while todo:
                i, j = todo.pop()
                if (i, j) in part or (i, j) not in free:
                    continue
                part.add((i, j))
                todo += [(i + 1, j), (i - 1, j), (i, j + 1), (i, j - 1)]
            parts.append(part)
            free = [cell for cell in free if cell not in part]
        free = sorted(max(parts, key=len))
        starts, goals = draw.sample(free, count), draw.sample(free, count)
        middle = lambda c: ((c[0] + 0.5) * cell, (c[1] + 0.5) * cell)
        robots = [(middle(s), middle(g)) for s, g in zip(starts, goals)]
        solid = [block(i * cell, j * cell, (i + 1) * cell, (j + 1) * cell) for i, j in sorted(taken)]
        write(f"map-{count}", f"{count} robots on a map of square blocks.", robots, solid)


def open_fields():
    for count, size in ((40, 6), (100, 10), (200, 14)):
        draw = random.Random(count)

        def scatter():
            places = []
            while len(places) < count:
                p = (draw.uniform(-size, size), draw.uniform(-size, size))
                if all(math.hypot(p[0] - q[0], p[1] - q[1]) > 3.2 * R for q in places):
                    places.append(p)
            return places

        write(f"field-{count}", f"{count} robots anywhere go anywhere.", list(zip(scatter(), scatter())))


for family in (rings, pillars, passages, streets, maps, open_fields):
    family()
