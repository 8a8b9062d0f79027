// SPDX-License-Identifier: Apache-2.0
// A poor encoder: what it reads is true but for noise, the same noise at each start.
#include <opengpac.h>

FUNCTION_BLOCK(noisy_encoder, "Reads a position with noise: y = channel + amplitude w, w even over -1 to 1.",
    device(double, channel, read, "position of a joint"),
    out   (double, y,           "what the encoder says"),
    out   (double, truth,       "what it is: for figures, never for control"),
    param (double, amplitude, 0.001, "greatest error"),
    state (uint64_t, seed, 88172645463325252, "state of the xorshift generator (Marsaglia, 2003)"))
{
    self->seed ^= self->seed << 13;
    self->seed ^= self->seed >> 7;
    self->seed ^= self->seed << 17;
    self->truth = self->channel;
    self->y = self->channel + self->amplitude * ((double)(self->seed >> 11) * 0x1p-52 - 1.0);
    return OK;
}
