#!/usr/bin/env python3
"""Scenes, and what the authors' RVO2 library commands in each: `python3 rvo2.py > rvo2.txt`, with `pip install pyrvo==0.4.3`.

Each line is a scene: the robot's velocity, its preferred velocity and the velocity that the library answers; then the other
robots (x, y, vx, vy, radius); then the corners of an obstacle, counter-clockwise. The robot has radius 0.2 m and stands in
the origin; greatest speed 1 m/s, a step of 0.1 s, horizons of 2 s for robots and 1 s for obstacles.
"""
import math
import random

import pyrvo

DT_S, HORIZON_S, WALL_HORIZON_S, RADIUS_M, SPEED_MPS = 0.1, 2.0, 1.0, 0.2, 1.0


def vector(size):
    angle, length = random.uniform(0.0, 2.0 * math.pi), random.uniform(0.01, size)
    return [round(length * math.cos(angle), 4), round(length * math.sin(angle), 4)]


def distance_to_edge(a, b):
    along = [b[0] - a[0], b[1] - a[1]]
    share = -(a[0] * along[0] + a[1] * along[1]) / (along[0] ** 2 + along[1] ** 2)
    share = min(max(share, 0.0), 1.0)
    return math.hypot(a[0] + share * along[0], a[1] + share * along[1])


def polygon():
    """A wall, a triangle or a block that the robot is not in; it may touch it."""
    while True:
        middle, size = vector(2.0), random.uniform(0.2, 1.5)
        count = random.choice([2, 3, 4, 5])
        angles = sorted(random.uniform(0.0, 2.0 * math.pi) for _ in range(count))
        corners = [[round(middle[0] + size * math.cos(t), 4), round(middle[1] + size * math.sin(t), 4)] for t in angles]
        if count > 3 and random.random() < 0.5:
            # A corner that points inwards.
            corners[1] = [round(middle[0] + 0.2 * size * math.cos(angles[1]), 4), round(middle[1] + 0.2 * size * math.sin(angles[1]), 4)]
        edges = list(zip(corners, corners[1:] + corners[:1]))
        if min(math.dist(a, b) for a, b in edges) < 0.1 or min(distance_to_edge(a, b) for a, b in edges) < 0.15:
            continue
        area = sum(a[0] * b[1] - a[1] * b[0] for a, b in edges)
        crossings = sum((a[1] > 0) != (b[1] > 0) and 0 < b[0] - b[1] * (b[0] - a[0]) / (b[1] - a[1]) for a, b in edges)
        if count == 2 or area > 0.02 and crossings % 2 == 0:
            return corners


def main():
    random.seed(1)
    for scene in range(400):
        others = [vector(3.0) + vector(1.0) + [round(random.uniform(0.1, 0.4), 4)] for _ in range(random.randint(0, 8))]
        corners = polygon() if scene % 2 else []
        velocity, wish = vector(1.0), vector(1.0)
        simulator = pyrvo.RVOSimulator()
        simulator.set_time_step(DT_S)
        simulator.set_agent_defaults(100.0, 100, HORIZON_S, WALL_HORIZON_S, RADIUS_M, SPEED_MPS)
        if corners:
            simulator.add_obstacle([tuple(corner) for corner in corners])
            simulator.process_obstacles()
        me = simulator.add_agent((0.0, 0.0))
        simulator.set_agent_velocity(me, tuple(velocity))
        simulator.set_agent_pref_velocity(me, tuple(wish))
        for x, y, vx, vy, radius in others:
            other = simulator.add_agent((x, y))
            simulator.set_agent_velocity(other, (vx, vy))
            simulator.set_agent_pref_velocity(other, (vx, vy))
            simulator.set_agent_radius(other, radius)
        simulator.do_step()
        answer = simulator.get_agent_velocity(me)
        answer = [round(answer.x, 6), round(answer.y, 6)]
        parts = [velocity + wish + answer, [x for other in others for x in other], [x for corner in corners for x in corner]]
        print(" | ".join(" ".join(str(x) for x in part) for part in parts))


main()
