#include "factorization.hpp"

#include <algorithm>
#include <cmath>

#include "dense.hpp"

namespace fesd {

void Factorization::solve(double* x, const double* value) {
    if (stopped_) factorize_once(value, threshold_, false, HUGE_VAL);
    scaled_ = false;
    wrong_inertia_solved_ = wrong_inertia_solved_ || negative_ != constraints_;
    may_stop_ = !wrong_inertia_solved_;
    const std::vector<int>& permutation = structure_->permutation;
    double *y = work_.data(), *t = dense_.data();
    for (int i = 0; i < order_; ++i) y[i] = x[permutation[i]] * scaling_[i];
    for (const Factor& factor : factors_) {
        const int m = factor.order, pivots = factor.pivots, *index = index_.data() + factor.index;
        const double* column = lower_.data() + factor.lower;
        for (int i = 0; i < m; ++i) t[i] = y[index[i]];
        int k = 0;
        for (; k + 2 <= pivots; k += 2) {
            const double *other = column + (m - k - 1), first = t[k], second = t[k + 1] -= column[0] * first;
            dense::subtract(t + k + 2, first, column + 1, second, other, m - k - 2);
            column = other + (m - k - 2);
        }
        if (k < pivots) dense::subtract(t + k + 1, t[k], column, m - k - 1);
        for (int i = 0; i < m; ++i) y[index[i]] = t[i];
    }
    for (std::size_t f = factors_.size(); f-- > 0;) {
        const Factor& factor = factors_[f];
        const int m = factor.order, *index = index_.data() + factor.index;
        const double *diagonal = diagonal_.data() + factor.first, *coupling = coupling_.data() + factor.first;
        for (int i = 0; i < m; ++i) t[i] = y[index[i]];
        for (int k = 0; k < factor.pivots;) {
            if (coupling[k] != 0.0) {
                const double d0 = diagonal[k], d1 = diagonal[k + 1], e = coupling[k], first = t[k], second = t[k + 1];
                const double determinant = d0 * d1 - e * e;
                t[k] = (d1 * first - e * second) / determinant;
                t[k + 1] = (d0 * second - e * first) / determinant;
                k += 2;
            } else {
                t[k] /= diagonal[k];
                k += 1;
            }
        }
        const std::size_t pivots = factor.pivots;
        const double* column = lower_.data() + factor.lower + pivots * m - pivots * (pivots + 1) / 2;
        int k = factor.pivots;
        for (; k >= 2; k -= 2) {
            const double* other = column - (m - k);
            column = other - (m - k + 1);
            double first = 0.0, second = 0.0;
            dense::products(column + 1, other, t + k, m - k, first, second);
            t[k - 1] -= second;
            t[k - 2] -= first + column[0] * t[k - 1];
        }
        if (k == 1) t[0] -= dense::product(column - (m - 1), t + 1, m - 1);
        for (int i = 0; i < factor.pivots; ++i) y[index[i]] = t[i];
    }
    for (int i = 0; i < order_; ++i) x[permutation[i]] = y[i] * scaling_[i];
}

}  // namespace fesd
