// An agent of shoal in C++: heads for the goal, slows down near others, and turns right before a robot ahead.
#include "shoal_agent.h"

#include <cmath>
#include <stdexcept>

namespace {

struct KeepRight {
    // State of the robot: one process is one robot.
    unsigned long long detours = 0;

    shoal_command operator()(const shoal_view &view) {
        if (view.kind != SHOAL_KIND_POINT) {
            throw std::invalid_argument("this planner is for points");
        }
        const double dx = view.goal.x - view.position.x, dy = view.goal.y - view.position.y;
        const double distance = std::sqrt(dx * dx + dy * dy);
        shoal_command command = {};
        command.stopped = view.arrived;
        if (view.arrived || distance < 1e-9) {
            return command;
        }
        double speed = std::fmin(view.limits.speed_mps_max, distance / view.dt_s);
        double turn = 0.0;
        for (size_t i = 0; i < view.neighbor_count; ++i) {
            const shoal_neighbor &other = view.neighbors[i];
            const double ox = other.position.x - view.position.x, oy = other.position.y - view.position.y;
            const double gap = std::sqrt(ox * ox + oy * oy) - other.radius_m - view.radius_m;
            if (gap < 1.0 && ox * dx + oy * dy > 0.0) {
                turn = -0.9;
                speed = std::fmin(speed, std::fmax(gap, 0.1));
            }
        }
        detours += turn != 0.0;
        const double c = std::cos(turn), s = std::sin(turn);
        command.first = speed * (c * dx - s * dy) / distance;
        command.second = speed * (s * dx + c * dy) / distance;
        return command;
    }
};

} // namespace

int main(int argc, char **argv) {
    return shoal::run(argc, argv, KeepRight{});
}
