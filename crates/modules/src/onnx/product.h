// SPDX-License-Identifier: Apache-2.0
// What is compiled for each set of instructions: SET says which, TARGET begins a function of it, and NAMED gives names of their own, as the macros
// product and network do.
WIDE(8)
WIDE(4)
NARROW(2)
NARROW(1)
FAR(8)
// y = bias + x W for k inputs and n outputs; y has room for a multiple of 8.
TARGET void product(const float *w, const float *bias, const float *x, float *y, int k, int n) {
    int left = (n + 7) / 8;
    // 128 kB of weights.
    if ((int64_t)k * n >= 32768) for (; left >= 8; left -= 8, bias += 64, y += 64) w = NAMED(product_far_8)(w, bias, x, y, k);
    for (; left >= 8; left -= 8, bias += 64, y += 64) w = NAMED(product_8)(w, bias, x, y, k);
    if (left >= 4) { w = NAMED(product_4)(w, bias, x, y, k); left -= 4; bias += 32; y += 32; }
    if (left >= 2) { w = NAMED(product_2)(w, bias, x, y, k); left -= 2; bias += 16; y += 16; }
    if (left >= 1) NAMED(product_1)(w, bias, x, y, k);
}

