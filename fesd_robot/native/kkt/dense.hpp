// Kernels on small dense matrices stored by columns.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstring>

namespace fesd::dense {

typedef double Four __attribute__((vector_size(32)));
typedef long long FourBits __attribute__((vector_size(32)));

inline Four load(const double* p) {
    Four v;
    std::memcpy(&v, p, sizeof v);
    return v;
}

inline void store(double* p, Four v) { std::memcpy(p, &v, sizeof v); }

// Largest |a[i]|, i < n.
inline double largest(const double* a, int n) {
    double result = 0.0;
    int i = 0;
    if (n >= 4) {
        const FourBits mask = {0x7fffffffffffffff, 0x7fffffffffffffff, 0x7fffffffffffffff, 0x7fffffffffffffff};
        Four best = {0.0, 0.0, 0.0, 0.0};
        for (; i + 4 <= n; i += 4) {
            const Four size = (Four)((FourBits)load(a + i) & mask);
            best = size > best ? size : best;
        }
        result = std::max(std::max(best[0], best[1]), std::max(best[2], best[3]));
    }
    for (; i < n; ++i) result = std::max(result, std::abs(a[i]));
    return result;
}

// y[i] -= a x[i], i < n.
inline void subtract(double* y, double a, const double* x, int n) {
    int i = 0;
    for (; i + 4 <= n; i += 4) store(y + i, load(y + i) - a * load(x + i));
    for (; i < n; ++i) y[i] -= a * x[i];
}

// y[i] -= a x[i] + b z[i], i < n.
inline void subtract(double* y, double a, const double* x, double b, const double* z, int n) {
    int i = 0;
    for (; i + 4 <= n; i += 4) store(y + i, load(y + i) - a * load(x + i) - b * load(z + i));
    for (; i < n; ++i) y[i] = y[i] - a * x[i] - b * z[i];
}

// Sum of x[i] t[i], i < n.
inline double product(const double* x, const double* t, int n) {
    Four sum = {};
    int i = 0;
    for (; i + 4 <= n; i += 4) sum += load(x + i) * load(t + i);
    double rest = 0.0;
    for (; i < n; ++i) rest += x[i] * t[i];
    return (sum[0] + sum[1]) + (sum[2] + sum[3]) + rest;
}

// The same for two vectors at once.
inline void products(const double* x, const double* z, const double* t, int n, double& with_x, double& with_z) {
    Four sum_x = {}, sum_z = {};
    int i = 0;
    for (; i + 4 <= n; i += 4) {
        const Four v = load(t + i);
        sum_x += load(x + i) * v;
        sum_z += load(z + i) * v;
    }
    with_x = (sum_x[0] + sum_x[1]) + (sum_x[2] + sum_x[3]);
    with_z = (sum_z[0] + sum_z[1]) + (sum_z[2] + sum_z[3]);
    for (; i < n; ++i) with_x += x[i] * t[i], with_z += z[i] * t[i];
}

template <int ROWS>
inline void tile(const double* l, const double* w, int ld, int k, double* c, int ldc, int columns) {
    Four sum[4][ROWS] = {};
    for (int p = 0; p < k; ++p, l += ld, w += ld)
        for (int j = 0; j < 4; ++j)
            for (int i = 0; i < ROWS; ++i) sum[j][i] -= load(l + 4 * i) * w[j];
    for (int j = 0; j < columns; ++j)
        for (int i = 0; i < ROWS; ++i) store(c + static_cast<std::size_t>(j) * ldc + 4 * i, sum[j][i]);
}

// Lower triangle of C = - L W^T with L and W of order n x k and the same leading dimension. Up to three rows more
// than n are read from L and W and written to C.
inline void product(int n, int k, const double* l, const double* w, int ld, double* c, int ldc) {
    for (int j = 0; j < n; j += 4) {
        const int columns = std::min(4, n - j);
        double* target = c + static_cast<std::size_t>(j) * ldc;
        int i = j;
        for (; n - i > 4; i += 8) tile<2>(l + i, w + j, ld, k, target + i, ldc, columns);
        if (i < n) tile<1>(l + i, w + j, ld, k, target + i, ldc, columns);
    }
}

}  // namespace fesd::dense
