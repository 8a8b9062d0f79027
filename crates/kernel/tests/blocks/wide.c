// SPDX-License-Identifier: Apache-2.0
// A block whose stores take a good part of its time.
#include <opengpac.h>

FUNCTION_BLOCK(wide, "Fills wide outputs with the number of the invocation: y = number.",
    out(double[2000], a, "the first"),
    out(double[2000], b, "the second"),
    out(double[2000], c, "the third"),
    out(double[2000], d, "the fourth"))
{
    for (int i = 0; i < 2000; i++) self->a[i] = self->b[i] = self->c[i] = self->d[i] = (double)invocation->number;
    return OK;
}
