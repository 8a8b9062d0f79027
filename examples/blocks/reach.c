// SPDX-License-Identifier: Apache-2.0
// What a policy that reaches for a goal sees, and who tells it of the goal.
#include <opengpac.h>

FUNCTION_BLOCK(to_goal, "The way to a goal: error = goal - tip.",
    in      (double[7], pose,  "pose of the tool: x y z in m, quaternion w x y z"),
    in_async(double[3], goal,  "where the tip is to be", "m"),
    out     (double[3], tip,   "where it is",            "m"),
    out     (double[3], error, "the way from here to there", "m"))
{
    for (int k = 0; k < 3; k++) {
        self->tip[k] = self->pose[k];
        self->error[k] = self->goal[k] - self->pose[k];
    }
    return OK;
}

FUNCTION_BLOCK(camera, "A camera that sees the goal: goal = target, observed now.",
    in_async(double[3], target,   "where the goal is", "m"),
    out     (double[3], goal,     "where it was seen", "m"),
    out     (int64_t,   observed, "when, in ns of the system's clock"))
{
    for (int k = 0; k < 3; k++) self->goal[k] = self->target[k];
    self->observed = invocation->now_ns;
    return OK;
}
