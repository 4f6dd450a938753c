/* Agents of shoal in C and C++. Lengths are metres, angles radians counter-clockwise from +x, times seconds.
 * capi/tests/header.rs holds this file against capi/src. */
#ifndef SHOAL_AGENT_H
#define SHOAL_AGENT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* A point of the plane, m, or a velocity, m/s. */
typedef struct shoal_vec2 {
    /* Along x. */
    double x;
    /* Along y. */
    double y;
} shoal_vec2;

/* A body that moves into any direction; its command is a velocity. */
#define SHOAL_KIND_POINT 0u

/* A body that drives ahead and turns; its command is a speed and a turn rate. */
#define SHOAL_KIND_UNICYCLE 1u

/* A body with two driven wheels; its command is a speed and a turn rate, or the rates of its wheels. */
#define SHOAL_KIND_DIFF_DRIVE 2u

/* An arm of two links; its command is the rates of its joints. */
#define SHOAL_KIND_TWO_LINK_ARM 3u

/* What a body can do. */
typedef struct shoal_limits {
    /* Greatest speed, m/s. */
    double speed_mps_max;
    /* Greatest reverse speed, m/s. */
    double reverse_mps_max;
    /* Smallest turning radius, m. */
    double turning_radius_m_min;
    /* Greatest turn rate, and of an arm the greatest rate of each joint, rad/s. */
    double turn_radps_max;
    /* Greatest change of speed or velocity, m/s^2. */
    double accel_mps2_max;
    /* Greatest change of the turn rate, rad/s^2. */
    double turn_accel_radps2_max;
} shoal_limits;

/* Another robot, as its newest message describes it. */
typedef struct shoal_neighbor {
    /* Position when it spoke, m. */
    shoal_vec2 position;
    /* Velocity when it spoke, m/s. */
    shoal_vec2 velocity;
    /* Where its command takes it within a tick after it spoke, m; it counts with has_next. */
    shoal_vec2 next;
    /* Heading when it spoke, rad. */
    double yaw_rad;
    /* Body radius, m. */
    double radius_m;
    /* Age of the message, s. */
    double age_s;
    /* Distance to its goal, m. */
    double remaining_m;
    /* Index of the robot in the fleet. */
    uint32_t id;
    /* It says where its command takes it. */
    bool has_next;
    /* It has reached its last goal. */
    bool arrived;
    /* It stands still on purpose. */
    bool stopped;
} shoal_neighbor;

/* A collider of an obstacle: everything within radius_m of the line from a to b. A disc has a equal to b. */
typedef struct shoal_obstacle {
    /* One end, m. */
    shoal_vec2 a;
    /* The other end, m. */
    shoal_vec2 b;
    /* Velocity, m/s. */
    shoal_vec2 velocity;
    /* Distance from the line to the surface, m. */
    double radius_m;
    /* Names the obstacle; the edges of a polygon share it. */
    uint32_t id;
} shoal_obstacle;

/* The velocities with normal.x * vx + normal.y * vy <= bound. */
typedef struct shoal_half_plane {
    /* Of length 1. */
    shoal_vec2 normal;
    /* m/s. */
    double bound;
} shoal_half_plane;

/* Everything that a planner may look at in a tick, in the world frame. What it points to is valid during the call. */
typedef struct shoal_view {
    /* The robot's name. */
    const char *name;
    /* The tick that is planned, from 0 at the start of the run. */
    uint64_t tick;
    /* Seed of the run. */
    uint64_t seed;
    /* Simulated time of this tick, s. */
    double time_s;
    /* Length of a tick, s. */
    double dt_s;
    /* Own position, m; of an arm, that of its tip. */
    shoal_vec2 position;
    /* Own velocity, m/s. */
    shoal_vec2 velocity;
    /* Own heading, rad. */
    double yaw_rad;
    /* Own turn rate, rad/s. */
    double turn_radps;
    /* Own body radius, m. */
    double radius_m;
    /* What the body can do. */
    shoal_limits limits;
    /* Where the robot heads now, m. */
    shoal_vec2 goal;
    /* The goal counts as reached within this distance, m. */
    double goal_tolerance_m;
    /* The heading that the robot is to have at its goal, rad; it counts with has_goal_yaw. */
    double goal_yaw_rad;
    /* Joint angles of an arm, the one at the base first, rad; zero for other bodies. */
    double joints_rad[2];
    /* The robots that are heard on the radio, by index. */
    const shoal_neighbor *neighbors;
    /* Number of neighbours. */
    size_t neighbor_count;
    /* What the sensors see. */
    const shoal_obstacle *obstacles;
    /* Number of colliders that the sensors see. */
    size_t obstacle_count;
    /* The fixed obstacles of the whole world, if the robot knows the map. */
    const shoal_obstacle *map;
    /* Number of colliders of the map. */
    size_t map_count;
    /* The velocities that the filter allows. */
    const shoal_half_plane *allowed;
    /* Number of half-planes; without a filter 0. */
    size_t allowed_count;
    /* The robot's stream of random numbers, for shoal_uniform and shoal_normal. */
    void *random;
    /* The robot's index in the fleet, from 0. */
    uint32_t index;
    /* How often its process was started before. */
    uint32_t incarnation;
    /* How the body moves: SHOAL_KIND_POINT and so on. */
    uint32_t kind;
    /* The goal has a heading. */
    bool has_goal_yaw;
    /* The last goal has been reached. */
    bool arrived;
} shoal_view;

/* The command that the kind of body takes. */
#define SHOAL_FORM_DEFAULT 0u

/* The rates of the left and the right wheel of a diff-drive, rad/s. */
#define SHOAL_FORM_WHEELS 1u

/* What a planner asks of the body. It is zero when the planner is called: the body stands. */
typedef struct shoal_command {
    /* Velocity along x, m/s; or forward speed, m/s; or rate of the joint at the base or of the left wheel, rad/s. */
    double first;
    /* Velocity along y, m/s; or turn rate, rad/s; or rate of the joint at the elbow or of the right wheel, rad/s. */
    double second;
    /* SHOAL_FORM_DEFAULT or SHOAL_FORM_WHEELS. */
    uint32_t form;
    /* The robot stands still on purpose; the others are told. */
    bool stopped;
} shoal_command;

/* Plans a tick: fills in the command and returns 0. Any other number ends the process: the robot is dead for
 * the fleet, which goes on. It must not throw. */
typedef int32_t (*shoal_plan)(void *user, const shoal_view *view, shoal_command *command);

/* Runs this process as the agent of a robot until the robot leaves or the run ends: 0 then, and 3 when something failed, with the
 * reason on standard error. The arguments are those of main; shoal's own are the last ones, from --root on. plan is called for every
 * tick, on this thread, with user as it is given here. */
int shoal_agent_run(int argc, char *const *argv, shoal_plan plan, void *user);

/* A random number, uniform in [0, 1), from the stream of a view: the same numbers for the same seed, robot and incarnation. Only during
 * the call that got the view. */
double shoal_uniform(void *random);

/* A random number, normal with mean 0 and standard deviation 1, as above. */
double shoal_normal(void *random);

#ifdef __cplusplus
} // extern "C"

#include <cstdio>
#include <exception>

namespace shoal {

/* Runs this process as an agent. plan is called as `shoal_command plan(const shoal_view &)`; an exception that it throws ends the
 * process, with its words on standard error. */
template <class Plan>
int run(int argc, char **argv, Plan plan) {
    auto call = [](void *user, const shoal_view *view, shoal_command *command) -> int32_t {
        try {
            *command = (*static_cast<Plan *>(user))(*view);
            return 0;
        } catch (const std::exception &error) {
            std::fprintf(stderr, "error: robot `%s`: %s\n", view->name, error.what());
        } catch (...) {
            std::fprintf(stderr, "error: robot `%s`: an exception other than a std::exception\n", view->name);
        }
        return 1;
    };
    return shoal_agent_run(argc, argv, call, &plan);
}

} // namespace shoal
#endif

#endif
