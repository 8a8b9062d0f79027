// SPDX-License-Identifier: Apache-2.0
#include <float.h>
#include <opengpac.h>

// Results that come out otherwise where rounding, subnormal numbers, traps, precision or the x87 stack are not as they should be.
FUNCTION_BLOCK(witness, "Counts the invocations, and those in which arithmetic is not what it always is.",
    out(double, n, "invocations"),
    out(double, odd, "invocations with another result"))
{
    volatile double one = 1, three = 3, ten = 10, zero = 0, least = DBL_MIN, tiny = 0x1p-1074;
    volatile long double long_one = 1, long_three = 3, long_ten = 10;
    int right = one / three == 0x1.5555555555555p-2 && one / ten == 0x1.999999999999ap-4 && -one / ten == -0x1.999999999999ap-4;
    right &= least / three > 0 && tiny * 0x1p60 > 0 && one / zero > DBL_MAX && (zero / zero != zero) == 1;
    right &= long_one / long_three == 1.0L / 3.0L && long_one / long_ten == 1.0L / 10.0L && long_one / zero > LDBL_MAX;
    self->n += 1;
    self->odd += !right;
    return OK;
}
