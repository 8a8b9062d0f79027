// SPDX-License-Identifier: Apache-2.0
// A driver in C: a conveyor whose drive is simulated here, x' = gain u. A real one sends and receives in read and write.
#include <opengpac_driver.h>

struct conveyor {
    double gain, place, speed;
    int64_t at_ns;
    opengpac_slot position, velocity, bias, effort;
    uint64_t *exchanges;
};

DRIVER(conveyor, "A conveyor that follows its effort, x' = gain u.",
    option_number(gain, 1.0, "its speed for an effort of 1", "m/s (0, 100]"),
    safe         ("it stands still", 0, BY_DRIVER),
    counter      (exchanges, "readings so far"),
    service_of   (place, number, "where it is"))

const char *conveyor_make(struct conveyor *self, opengpac_host *host) {
    self->gain = given_number(host, "gain");
    self->position = reads(host, "double", "belt.position", "where it is", "m");
    self->velocity = reads(host, "double", "belt.velocity", "how fast it is", "m/s");
    self->bias = reads(host, "double", "belt.bias", "effort that holds it: none", "N");
    self->effort = writes(host, "double", "belt.effort", 0.0, "what moves it", "N");
    part(host, (opengpac_part){.name = "belt", .is_slide = 1, .kp = 50.0});
    self->exchanges = counter_of(host, "exchanges");
    return OK;
}

const char *conveyor_open(struct conveyor *self, int64_t now_ns) {
    self->at_ns = now_ns;
    return OK;
}

const char *conveyor_read(struct conveyor *self, int64_t release_ns, uint8_t *readings) {
    double place = self->place + self->speed * (double)(release_ns - self->at_ns) * 1e-9;
    __atomic_store(&self->place, &place, __ATOMIC_RELAXED);
    self->at_ns = release_ns;
    set_number(readings, self->position, place);
    set_number(readings, self->velocity, self->speed);
    set_number(readings, self->bias, 0.0);
    count(self->exchanges, 1);
    return OK;
}

const char *conveyor_write(struct conveyor *self, int64_t release_ns, const uint8_t *commands, const uint8_t *engaged) {
    double effort = get_number(commands, self->effort);
    if (!__builtin_isfinite(effort)) return because("at %lld ns its effort is not a number", (long long)release_ns);
    self->speed = is_engaged(engaged, self->effort) ? self->gain * effort : 0.0;
    return OK;
}

void conveyor_safe_state(struct conveyor *self) { self->speed = 0.0; }

const char *conveyor_service(struct conveyor *self, opengpac_host *host, const char *name) {
    double place;
    __atomic_load(&self->place, &place, __ATOMIC_RELAXED);
    if (strcmp(name, "place") == 0) answer(host, because("%.17g", place));
    return OK;
}
