// SPDX-License-Identifier: Apache-2.0
// Kernels of learned policies. A product runs over its outputs, eight of them a vector, and adds in the order of its inputs: no compiler has to
// reassociate, and every processor gives the same bits. Exponentials are polynomials here, for the same reason; logarithms, sines, powers and erf are
// the C library's, and have its bits.
#include <math.h>
#include <string.h>

#define INLINE __attribute__((always_inline, unused)) static inline
#pragma GCC diagnostic ignored "-Wpsabi"
typedef float v8 __attribute__((vector_size(32)));
typedef int32_t i8v __attribute__((vector_size(32)));

INLINE v8 get(const float *p) { v8 v; __builtin_memcpy(&v, p, sizeof v); return v; }
INLINE void put(float *p, v8 v) { __builtin_memcpy(p, &v, sizeof v); }
// Not a function: gcc would take it apart before it is where there are instructions for it.
#define all(x) ({ float x_ = (x); (v8){x_, x_, x_, x_, x_, x_, x_, x_}; })
INLINE v8 pick(i8v mask, v8 yes, v8 no) { return (v8)((mask & (i8v)yes) | (~mask & (i8v)no)); }
INLINE v8 larger(v8 a, v8 b) { return pick(a > b, a, b); }
INLINE v8 smaller(v8 a, v8 b) { return pick(a < b, a, b); }

// 1 where a comparison holds, 0 elsewhere.
INLINE v8 truth(i8v mask) { return pick(mask, all(1.0f), all(0.0f)); }
INLINE v8 sign(v8 x) { return truth(x > all(0.0f)) - truth(x < all(0.0f)); }

// y[i] = e for each element, AT(x) is that of x.
#define EACH(n, y, e) for (int i = 0; i < (n); i += 8) put((y) + i, e)
#define AT(x) get((x) + i)
// A function of the C library, one lane after the other.
#define LANES(v, f) ({ v8 v_ = (v); for (int l_ = 0; l_ < 8; l_++) v_[l_] = f(v_[l_]); v_; })
#define LANES2(v, w, f) ({ v8 v_ = (v), w_ = (w); for (int l_ = 0; l_ < 8; l_++) v_[l_] = f(v_[l_], w_[l_]); v_; })

// e^x by Cephes' polynomial on [-ln 2 / 2, ln 2 / 2]; within 2 units in the last place.
INLINE v8 exponential(v8 x) {
    v8 over = all(88.72283f), under = all(-103.972084f);
    v8 t = smaller(larger(x, all(-87.33654f)), all(88.02969f));
    v8 n = t * 1.44269504f;
    i8v k = __builtin_convertvector(n + pick(n < all(0.0f), all(-0.5f), all(0.5f)), i8v);
    n = __builtin_convertvector(k, v8);
    t = t - n * 0.693359375f - n * -2.12194440e-4f;
    v8 p = all(1.9875691500e-4f);
    p = p * t + 1.3981999507e-3f;
    p = p * t + 8.3334519073e-3f;
    p = p * t + 4.1665795894e-2f;
    p = p * t + 1.6666665459e-1f;
    p = p * t + 5.0000001201e-1f;
    p = p * t * t + t + 1.0f;
    v8 y = p * (v8)((k + 127) << 23);
    y = pick(x > over, all(__builtin_inff()), y);
    return pick(x < under, all(0.0f), y);
}
INLINE v8 sigmoid(v8 x) { return 1.0f / (1.0f + exponential(-x)); }
INLINE v8 magnitude(v8 x) { return (v8)((i8v)x & 0x7fffffff); }
INLINE v8 hyperbolic_tangent(v8 x) {
    v8 a = magnitude(x), s = x * x;
    v8 p = all(-5.70498872745e-3f);
    p = p * s + 2.06390887954e-2f;
    p = p * s + -5.37397155531e-2f;
    p = p * s + 1.33314422036e-1f;
    p = p * s + -3.33332819422e-1f;
    v8 near = p * s * x + x;
    v8 far = 1.0f - 2.0f / (exponential(a + a) + 1.0f);
    far = (v8)((i8v)far | ((i8v)x & (i8v)all(-0.0f)));
    return pick(a < all(0.625f), near, far);
}
INLINE v8 relu(v8 x) { return larger(x, all(0.0f)); }
INLINE v8 leaky(v8 x, v8 slope) { return pick(x < all(0.0f), x * slope, x); }
// e^x - 1 without cancellation near 0.
INLINE v8 exponential_less_1(v8 x) {
    v8 p = all(1.0f / 720);
    p = p * x + 1.0f / 120;
    p = p * x + 1.0f / 24;
    p = p * x + 1.0f / 6;
    p = p * x + 0.5f;
    p = p * x * x + x;
    return pick(magnitude(x) < all(0.35f), p, exponential(x) - 1.0f);
}
INLINE v8 elu(v8 x, float alpha) { return pick(x < all(0.0f), alpha * exponential_less_1(smaller(x, all(0.0f))), x); }
INLINE v8 celu(v8 x, float alpha) { return pick(x < all(0.0f), alpha * exponential_less_1(smaller(x, all(0.0f)) / alpha), x); }
INLINE v8 selu(v8 x, float alpha, float gamma) { return gamma * elu(x, alpha); }
INLINE v8 softplus(v8 x) { return relu(x) + LANES(exponential(-magnitude(x)), log1pf); }
INLINE v8 softsign(v8 x) { return x / (1.0f + magnitude(x)); }
INLINE v8 gelu(v8 x) { return 0.5f * x * (1.0f + LANES(x * 0.70710678118654752f, erff)); }
INLINE v8 gelu_tanh(v8 x) { return 0.5f * x * (1.0f + hyperbolic_tangent(0.7978845608028654f * (x + 0.044715f * x * x * x))); }
INLINE v8 hard_sigmoid(v8 x, float alpha, float beta) { return larger(all(0.0f), smaller(all(1.0f), alpha * x + beta)); }
INLINE v8 clip(v8 x, float least, float most) { return smaller(larger(x, all(least)), all(most)); }
INLINE v8 root(v8 x) { return LANES(x, sqrtf); }

#define R1(X) X(0)
#define R2(X) X(0) X(1)
#define R4(X) X(0) X(1) X(2) X(3)
#define R8(X) X(0) X(1) X(2) X(3) X(4) X(5) X(6) X(7)
#define START(j) v8 a##j = get(bias + 8 * j);
#define ADD(j) a##j += s * get(w + 8 * j);
#define KEEP(j) put(y + 8 * j, a##j);
// y = bias + x W for 8 g outputs; W lies so that the g vectors of one input are side by side. SET are the instructions that product.h is for, and
// NAMED what it calls things.
#define INSTRUCTIONS __attribute__((SET always_inline, unused)) static inline
#define WIDE(g) \
    INSTRUCTIONS const float *NAMED(product_##g)(const float *w, const float *bias, const float *x, float *y, int k) { \
        R##g(START) \
        for (int i = 0; i < k; i++, w += 8 * g) { v8 s = all(x[i]); R##g(ADD) } \
        R##g(KEEP) \
        return w; \
    }
// The same where the weights do not fit the caches near the core: what comes next is fetched meanwhile, beyond a page too, where hardware stops.
#define AHEAD 1024
#define FAR(g) \
    INSTRUCTIONS const float *NAMED(product_far_##g)(const float *w, const float *bias, const float *x, float *y, int k) { \
        R##g(START) \
        for (int i = 0; i < k; i++, w += 8 * g) { \
            for (int next = 0; next < 8 * g; next += 16) __builtin_prefetch(w + AHEAD + next); \
            v8 s = all(x[i]); \
            R##g(ADD) \
        } \
        R##g(KEEP) \
        return w; \
    }
// The same where few outputs leave the adder idle: four sums side by side, joined at the end in a fixed order.
#define NARROW_START(j) v8 a##j = get(bias + 8 * j), b##j = all(0), c##j = all(0), d##j = all(0);
#define NARROW_ADD(g, j) a##j += x[i] * get(w + 8 * (j)); b##j += x[i + 1] * get(w + 8 * (g + j)); c##j += x[i + 2] * get(w + 8 * (2 * g + j)); d##j += x[i + 3] * get(w + 8 * (3 * g + j));
#define NARROW_KEEP(j) put(y + 8 * j, (a##j + b##j) + (c##j + d##j));
#define NARROW_ADD_1(j) NARROW_ADD(1, j)
#define NARROW_ADD_2(j) NARROW_ADD(2, j)
#define NARROW(g) \
    INSTRUCTIONS const float *NAMED(product_##g)(const float *w, const float *bias, const float *x, float *y, int k) { \
        R##g(NARROW_START) \
        int i = 0; \
        for (; i + 4 <= k; i += 4, w += 32 * g) { R##g(NARROW_ADD_##g) } \
        for (; i < k; i++, w += 8 * g) { v8 s = all(x[i]); R##g(ADD) } \
        R##g(NARROW_KEEP) \
        return w; \
    }

// y = scale sum x[at(i)] z[at(i)] of two operands that are known while it runs only.
INLINE float inner(const float *x, int dx, const float *z, int dz, int k) {
    float sum = 0;
    for (int i = 0; i < k; i++) sum += x[i * dx] * z[i * dz];
    return sum;
}
INLINE void gather(float *y, const float *x, const uint32_t *at, int n) { for (int i = 0; i < n; i++) y[i] = x[at[i]]; }
// Rows of x whose numbers are values: NaN for one that there is not.
INLINE void gather_rows(float *y, const float *x, const float *which, int before, int rows, int inner, int n) {
    for (int o = 0; o < before; o++)
        for (int j = 0; j < n; j++, y += inner) {
            float number = which[j] < 0 ? which[j] + (float)rows : which[j];
            int there = number >= 0 && number < (float)rows;
            for (int i = 0; i < inner; i++) y[i] = there ? x[(o * rows + (int)number) * inner + i] : __builtin_nanf("");
        }
}
// Windows of x, the elements of each up to its end in the list.
INLINE void pool_max(float *y, const float *x, const uint32_t *at, const uint32_t *ends, int n) {
    for (int i = 0, k = 0; i < n; i++) {
        float most = x[at[k]];
        for (k++; k < (int)ends[i]; k++) most = x[at[k]] > most ? x[at[k]] : most;
        y[i] = most;
    }
}
INLINE void pool_mean(float *y, const float *x, const uint32_t *at, const uint32_t *ends, const uint32_t *counts, int n) {
    for (int i = 0, k = 0; i < n; i++) {
        float sum = 0;
        for (; k < (int)ends[i]; k++) sum += x[at[k]];
        y[i] = sum / (float)counts[i];
    }
}
INLINE void softmax(float *y, const float *x, int n, int logarithm) {
    float most = x[0], sum = 0;
    for (int i = 1; i < n; i++) most = x[i] > most ? x[i] : most;
    for (int i = 0; i < n; i++) sum += exponential(all(x[i] - most))[0];
    float log_sum = logf(sum);
    for (int i = 0; i < n; i++) y[i] = logarithm ? x[i] - most - log_sum : exponential(all(x[i] - most))[0] / sum;
}
// (x - mean) / sqrt(variance + epsilon)
INLINE void normalise(float *y, const float *x, int n, float epsilon, float *mean_out, float *inverse_out) {
    float mean = 0, square = 0;
    for (int i = 0; i < n; i++) mean += x[i];
    mean /= (float)n;
    for (int i = 0; i < n; i++) square += (x[i] - mean) * (x[i] - mean);
    float by = 1.0f / sqrtf(square / (float)n + epsilon);
    for (int i = 0; i < n; i++) y[i] = (x[i] - mean) * by;
    *mean_out = mean;
    *inverse_out = by;
}
