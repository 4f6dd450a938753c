"""A planner with state and random numbers: a class, constructed for each robot."""

import numpy as np

import shoal


class Wanderer:
    def __init__(self, robot):
        self.robot = robot
        self.heading = robot.random.uniform(-0.3, 0.3)
        self.plans = 0

    def plan(self, view):
        self.plans += 1
        self.heading += view.random.normal(0.0, 0.02)
        ahead = view.goal - view.position
        speed = min(self.robot.limits.speed_mps_max, np.hypot(*ahead) / view.dt_s)
        angle = np.arctan2(ahead[1], ahead[0]) + self.heading / (1 + self.plans)
        return shoal.Plan((speed * np.cos(angle), speed * np.sin(angle)), stopped=view.arrived)


if __name__ == "__main__":
    shoal.run(Wanderer)
