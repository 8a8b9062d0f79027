// SPDX-License-Identifier: Apache-2.0
// What is compiled for each set of instructions: TARGET says which, and product and network are macros for names of their own.
// y = bias + x W for k inputs and n outputs; y has room for a multiple of 8.
TARGET void product(const float *w, const float *bias, const float *x, float *y, int k, int n) {
    int left = (n + 7) / 8;
    for (; left >= 8; left -= 8, bias += 64, y += 64) w = product_8(w, bias, x, y, k);
    if (left >= 4) { w = product_4(w, bias, x, y, k); left -= 4; bias += 32; y += 32; }
    if (left >= 2) { w = product_2(w, bias, x, y, k); left -= 2; bias += 16; y += 16; }
    if (left >= 1) product_1(w, bias, x, y, k);
}

