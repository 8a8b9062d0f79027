// SPDX-License-Identifier: Apache-2.0
#include <opengpac.h>

FUNCTION_BLOCK(most, "The maximum numbers there are, written and reported.",
    out         (uint64_t, y,    "2^64 - 1, less what is given"),
    param       (uint64_t, less, 0, "what is taken off"),
    condition_of(uint64_t, full, "y, once"))
{
    self->y = UINT64_MAX - self->less;
    report_value(full, self->y);
    return OK;
}
