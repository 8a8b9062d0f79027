// SPDX-License-Identifier: Apache-2.0
#include <opengpac.h>

FUNCTION_BLOCK(tell, "Reports a value, if it is to.",
    out         (double, y,           "the value"),
    param       (double, value, 0.0,  "what is reported"),
    param       (bool,   tells, true, "whether it reports"),
    condition_of(double, told,        "the value"))
{
    self->y = self->value;
    if (self->tells) report_value(told, self->value);
    return OK;
}
