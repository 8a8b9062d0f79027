// SPDX-License-Identifier: Apache-2.0
// Blocks of the graphs that must give the same values on every mapping: what they compute depends on how often they ran, never on time;
// but for those of ratios, which go by numbers: a release that is skipped takes its number with it.
#include <opengpac.h>

// ---- stimuli: the k-th invocation that took place gives value k ----

FUNCTION_BLOCK(ramp, "Ramp: y = first + step k.",
    out  (double, y,         "ramp"),
    param(double, first, 0,  "value of invocation 0"),
    param(double, step, 1,   "difference of two values"),
    state(int64_t, k, 0,     "invocations so far"))
{
    self->y = self->first + self->step * (double)self->k++;
    return OK;
}

FUNCTION_BLOCK(number, "The number of each invocation.", out(double, y, "number"))
{
    self->y = (double)invocation->number;
    return OK;
}

FUNCTION_BLOCK(number_of_four, "The number of every fourth invocation.", out_ratio(double, y, 4, "number"))
{
    self->y = (double)invocation->number;
    return OK;
}

FUNCTION_BLOCK(scatter, "Scattered values: y = frac(k g) - 1/2, with g near the golden ratio.",
    out  (double,  y,             "value in [-0.5, 0.5)"),
    param(uint32_t, seed, 40503,  "another sequence"),
    state(uint32_t, k, 0,         "invocations so far"))
{
    self->y = (double)(self->k++ * 2654435769u + self->seed * 69069u) * 0x1p-32 - 0.5;
    return OK;
}

FUNCTION_BLOCK(square, "Square wave: y is true in every second half period.",
    out  (bool,    y,        "wave"),
    out  (bool,    not_y,    "its opposite"),
    param(int64_t, half, 7,  "invocations of a half period"),
    state(int64_t, k, 0,     "invocations so far"))
{
    self->y = self->k++ / self->half % 2 != 0;
    self->not_y = !self->y;
    return OK;
}

FUNCTION_BLOCK(blink, "Light: on at every second invocation.",
    out  (double, y,         "0 or 1"),
    state(int64_t, k, 0,     "invocations so far"))
{
    self->y = (double)(self->k++ % 2);
    return OK;
}

FUNCTION_BLOCK(vector, "Vector: v[i] = k + i / 8.",
    out  (double[4], v,  "four values"),
    state(int64_t, k, 0, "invocations so far"))
{
    for (int i = 0; i < 4; i++) self->v[i] = (double)self->k + i * 0.125;
    self->k++;
    return OK;
}

FUNCTION_BLOCK(widths, "One value of each width: they wrap around.",
    out  (int8_t,   i8,   "k"),
    out  (uint16_t, u16,  "257 k"),
    out  (int64_t,  i64,  "-k^3"),
    out  (float,    f,    "k / 3"),
    state(int64_t,  k, 0, "invocations so far"))
{
    int64_t k = self->k++;
    self->i8 = (int8_t)(k * 3);
    self->u16 = (uint16_t)(k * 257);
    self->i64 = -k * k * k;
    self->f = (float)k / 3.0f;
    return OK;
}

TYPE(place, "Place on a plane.", field(double[2], p), field(float, heading), field(int32_t, number));
TYPE(leg, "From one place to another.", field(place, from), field(place, to));

FUNCTION_BLOCK(places, "Places: on a line, one a step.",
    out  (place,   at,    "place"),
    state(int32_t, k, 0,  "invocations so far"))
{
    self->at.p[0] = (double)self->k;
    self->at.p[1] = -0.5 * (double)self->k;
    self->at.heading = 0.25f * (float)(self->k % 16);
    self->at.number = self->k++;
    return OK;
}

FUNCTION_BLOCK(bad_at_times, "Ramp of the good invocations: every 50th gives no number, and stores nothing.",
    out  (double,  y, "how many were good"))
{
    volatile double zero = 0;
    self->y += 1;
    if (invocation->number % 50 == 49) self->y = zero / zero;
    return OK;
}

// ---- what stands between ----

FUNCTION_BLOCK(add, "Sum of two: y = a + b, once both are new.", in(double, a, "first"), in(double, b, "second"), out(double, y, "sum"))
{
    self->y = self->a + self->b;
    return OK;
}

FUNCTION_BLOCK(weigh, "y = a + 10 b + 100 c, once all three are new.",
    in (double, a, "first"),
    in (double, b, "second"),
    in (double, c, "third"),
    out(double, y, "sum"))
{
    self->y = self->a + 10 * self->b + 100 * self->c;
    return OK;
}

FUNCTION_BLOCK(echo, "Echo: y = u + g times what came back.",
    in              (double, u,         "value"),
    in_async_default(double, back, 0.0, "what came back"),
    param           (double, g, 0.5,    "share"),
    out             (double, y,         "value with its echo"))
{
    self->y = self->u + self->g * self->back;
    return OK;
}

FUNCTION_BLOCK(mean_of_four, "Decimation: y = mean of four values of u, on every fourth.",
    in       (double, u,      "values"),
    out_ratio(double, y, 4,   "their mean"),
    state    (double, sum, 0, "sum so far"),
    state    (int64_t, k, 0,  "invocations so far"))
{
    self->sum += self->u;
    self->y = self->sum / 4.0;
    if (++self->k % 4 == 0) self->sum = 0;
    return OK;
}

FUNCTION_BLOCK(pair_sum, "Decimation: y = sum of two values of u, on every second.",
    in       (double, u,       "values"),
    out_ratio(double, y, 2,    "their sum"),
    state    (double, last, 0, "the one before"))
{
    self->y = self->last + self->u;
    self->last = self->u;
    return OK;
}

FUNCTION_BLOCK(held, "A slow value, and when it was read: y = 10^6 u + number of the invocation.",
    in_ratio(double, u, 5,  "updated once in five invocations"),
    out     (double, y,     "both in one"))
{
    self->y = 1e6 * self->u + (double)invocation->number;
    return OK;
}

FUNCTION_BLOCK(beside, "A slow value beside a fast one: y = 1000 slow + fast.",
    in_ratio(double, slow, 5, "updated once in five invocations"),
    in      (double, fast,    "updated at each"),
    out     (double, y,       "both in one"))
{
    self->y = 1000.0 * self->slow + self->fast;
    return OK;
}

FUNCTION_BLOCK(recent, "The last four values, oldest first; k makes it one of its own.",
    in_history(double, u, 4,  "values"),
    out       (double[4], y,  "the same"))
{
    for (int i = 0; i < 4; i++) self->y[i] = self->u[i];
    return OK;
}

FUNCTION_BLOCK(steepness, "Mean difference of the last three values: y = (u[2] - u[0]) / 2.",
    in_history(double, u, 3, "values"),
    out       (double, y,    "mean difference"))
{
    self->y = (self->u[2] - self->u[0]) / 2.0;
    return OK;
}

FUNCTION_BLOCK(digest, "Digest of integers: y = 6364136223846793005 y + u.",
    in (int64_t,  u, "value"),
    out(uint64_t, y, "digest of all so far"))
{
    self->y = self->y * 6364136223846793005u + (uint64_t)self->u;
    return OK;
}

FUNCTION_BLOCK(gather_widths, "One number of values of each width.",
    in (int8_t,   i8,  "8 bits"),
    in (uint16_t, u16, "16 bits"),
    in (int64_t,  i64, "64 bits"),
    in (float,    f,   "single precision"),
    out(double,   y,   "i8 + 2 u16 + 3 i64 + 4 f"))
{
    self->y = (double)self->i8 + 2.0 * (double)self->u16 + 3.0 * (double)self->i64 + 4.0 * (double)self->f;
    return OK;
}

FUNCTION_BLOCK(lamp, "State machine of a lamp: red, red and yellow, green, yellow; a car that waits shortens red.",
    in   (bool,    car,      "a car waits"),
    out  (int64_t, phase,    "0 red, 1 red and yellow, 2 green, 3 yellow"),
    out  (int64_t, rounds,   "how often it was green"),
    state(int64_t, here, 0,  "invocations in this phase"))
{
    int64_t longest = self->phase == 0 ? (self->car ? 4 : 11) : self->phase == 2 ? 9 : 2;
    if (++self->here >= longest) {
        self->here = 0;
        self->phase = (self->phase + 1) % 4;
        if (self->phase == 2) self->rounds++;
    }
    return OK;
}

FUNCTION_BLOCK(step_on, "Moves a place on by one step ahead.",
    in   (place, at,        "place"),
    out  (place, next,      "the next one"),
    param(double, size, 2,  "step"))
{
    self->next = self->at;
    self->next.p[0] += self->size;
    self->next.heading = self->at.heading * 2.0f;
    return OK;
}

FUNCTION_BLOCK(join_legs, "A leg of two places, once both are new.",
    in (place, from, "begin"),
    in (place, to,   "end"),
    out(leg,   way,  "leg"))
{
    self->way.from = self->from;
    self->way.to = self->to;
    return OK;
}

FUNCTION_BLOCK(unfold_leg, "The numbers of a leg.",
    in (leg, way,       "leg"),
    out(double[4], y,   "begin x, begin y, end x, end heading"))
{
    self->y[0] = self->way.from.p[0];
    self->y[1] = self->way.from.p[1];
    self->y[2] = self->way.to.p[0] + (double)self->way.to.number;
    self->y[3] = (double)self->way.to.heading;
    return OK;
}

FUNCTION_BLOCK(unfold_place, "The numbers of a place.",
    in (place, at,     "place"),
    out(double[4], y,  "x, y, heading, number"))
{
    self->y[0] = self->at.p[0];
    self->y[1] = self->at.p[1];
    self->y[2] = (double)self->at.heading;
    self->y[3] = (double)self->at.number;
    return OK;
}

FUNCTION_BLOCK(times, "y = k u, of n elements, once all are new.",
    size (n, 1, 8),
    in   (double[n], u,  "vector"),
    out  (double[n], y,  "k times that"),
    param(double, k, 3,  "factor"))
{
    for (uint32_t i = 0; i < n; i++) self->y[i] = self->k * self->u[i];
    return OK;
}

FUNCTION_BLOCK(six_joints, "Six joint positions that sway: of its k-th invocation.",
    out  (double[6], q,   "joint positions", "rad"),
    state(int64_t, k, 0,  "invocations so far"))
{
    for (int i = 0; i < 6; i++) {
        int64_t at = (self->k * (i + 3)) % 200;
        self->q[i] = (double)(at < 100 ? at : 200 - at) * 0.01 - 0.5;
    }
    self->k++;
    return OK;
}

FUNCTION_BLOCK(limit_switch, "Passes u on, and reports `enough` once, when it comes to its preset.",
    in                  (double, u,           "value"),
    out                 (double, y,           "the same"),
    condition_of_default(double, enough, 1e9, "u has come to the preset"))
{
    self->y = self->u;
    if (self->u == self->enough) report_value(enough, self->u);
    return OK;
}

FUNCTION_BLOCK(counted, "Ramp that reports `enough` when it comes to its preset.",
    out                 (double, y,           "number of the invocation since it was installed"),
    state               (int64_t, k, 0,       "invocations so far"),
    condition_of_default(double, enough, 1e9, "y has come to the preset"))
{
    self->y = (double)self->k++;
    if (self->y == self->enough) report_value(enough, self->y);
    return OK;
}

// ---- recorders: the first 200 values, then `full`, again and again: a list that begins anew waits for it anew ----

FUNCTION_BLOCK(record, "Records the first 200 values.",
    in       (double, u,            "value"),
    out      (double[200], values,  "the first 200"),
    out      (int64_t, count,       "how many so far"),
    condition(full,                 "200 are there"))
{
    if (self->count < 200) self->values[self->count++] = self->u;
    if (self->count == 200) report(full);
    return OK;
}

FUNCTION_BLOCK(record_vector, "Records the first 200 vectors of four.",
    in       (double[4], u,           "vector"),
    out      (double[800], values, "the first 200"),
    out      (int64_t, count,         "how many so far"),
    condition(full,                   "200 are there"))
{
    if (self->count < 200) {
        for (int i = 0; i < 4; i++) self->values[self->count * 4 + i] = self->u[i];
        self->count++;
    }
    if (self->count == 200) report(full);
    return OK;
}

FUNCTION_BLOCK(record_pose, "Records the first 200 poses of seven numbers.",
    in       (double[7], u,           "pose"),
    out      (double[1400], values, "the first 200"),
    out      (int64_t, count,         "how many so far"),
    condition(full,                   "200 are there"))
{
    if (self->count < 200) {
        for (int i = 0; i < 7; i++) self->values[self->count * 7 + i] = self->u[i];
        self->count++;
    }
    if (self->count == 200) report(full);
    return OK;
}

FUNCTION_BLOCK(record_integer, "Records the first 200 integers.",
    in       (int64_t, u,            "value"),
    out      (int64_t[200], values,  "the first 200"),
    out      (int64_t, count,        "how many so far"),
    condition(full,                  "200 are there"))
{
    if (self->count < 200) self->values[self->count++] = self->u;
    if (self->count == 200) report(full);
    return OK;
}

FUNCTION_BLOCK(record_digest, "Records the first 200 digests.",
    in       (uint64_t, u,           "value"),
    out      (uint64_t[200], values, "the first 200"),
    out      (int64_t, count,        "how many so far"),
    condition(full,                  "200 are there"))
{
    if (self->count < 200) self->values[self->count++] = self->u;
    if (self->count == 200) report(full);
    return OK;
}

FUNCTION_BLOCK(record_bool, "Records the first 200 truth values.",
    in       (bool, u,           "value"),
    out      (bool[200], values, "the first 200"),
    out      (int64_t, count,    "how many so far"),
    condition(full,              "200 are there"))
{
    if (self->count < 200) self->values[self->count++] = self->u;
    if (self->count == 200) report(full);
    return OK;
}
