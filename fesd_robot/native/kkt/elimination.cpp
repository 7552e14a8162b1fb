#include "factorization.hpp"

#include <algorithm>
#include <cmath>

#include "dense.hpp"

namespace fesd {

namespace {

constexpr double DIAGONAL_PREFERENCE = 0.1;  // a diagonal entry this large beside its row is a pivot of order 1
constexpr double NO_PIVOT = 1e-20;           // of the scaled matrix: below this a column counts as zero
constexpr double NEGATIVE_PIVOT = 1e-8;      // of the largest entry: a pivot this negative is so in spite of round-off

}  // namespace

// Eliminates the fully summed columns of a front that have an acceptable pivot; the others, which are delayed, are
// moved behind the pivots.
void Factorization::eliminate(Factor& factor, int fully_summed, double threshold) {
    const int m = factor.order;
    double* a = panel_.data();
    int* index = index_.data() + factor.index;
    double *diagonal = diagonal_.data() + factor.first, *coupling = coupling_.data() + factor.first;
    auto column = [&](int j) { return a + static_cast<std::size_t>(j) * m; };
    auto weighted = [&](int j) { return weighted_.data() + static_cast<std::size_t>(j) * m; };
    auto at = [&](int i, int j) -> double { return i >= j ? column(j)[i] : column(i)[j]; };
    int k = 0;  // pivots done

    auto exchange = [&](int p, int q) {  // rows and columns p <= q
        if (p == q) return;
        for (int j = 0; j < p; ++j) std::swap(column(j)[p], column(j)[q]);
        for (int i = p + 1; i < q; ++i) std::swap(column(p)[i], column(i)[q]);
        std::swap_ranges(column(p) + q + 1, column(p) + m, column(q) + q + 1);
        std::swap(column(p)[p], column(q)[q]);
        std::swap(index[p], index[q]);
    };
    auto single = [&](int j) {
        exchange(k, j);
        double *pivot = column(k), *u = weighted(k);
        const double d = pivot[k], inverse = 1.0 / d;
        diagonal[k] = d;
        coupling[k] = 0.0;
        negative_ += d < 0.0;
        for (int i = k + 1; i < m; ++i) u[i] = pivot[i], pivot[i] *= inverse;
        for (int c = k + 1; c < fully_summed; ++c)
            if (u[c] != 0.0) dense::subtract(column(c) + c, u[c], pivot + c, m - c);
        pivot[k] = 1.0;
        k += 1;
    };
    auto pair = [&](int j, int r) {
        exchange(k, std::min(j, r));
        exchange(k + 1, std::max(j, r));
        double *p = column(k), *q = column(k + 1), *u = weighted(k), *v = weighted(k + 1);
        const double d0 = p[k], d1 = q[k + 1], e = p[k + 1], determinant = d0 * d1 - e * e;
        diagonal[k] = d0;
        diagonal[k + 1] = d1;
        coupling[k] = e;
        coupling[k + 1] = 0.0;
        negative_ += determinant < 0.0 ? 1 : (d0 < 0.0 ? 2 : 0);
        const double i00 = d1 / determinant, i11 = d0 / determinant, i01 = -e / determinant;
        for (int i = k + 2; i < m; ++i) {
            u[i] = p[i];
            v[i] = q[i];
            p[i] = i00 * u[i] + i01 * v[i];
            q[i] = i01 * u[i] + i11 * v[i];
        }
        for (int c = k + 2; c < fully_summed; ++c)
            if (u[c] != 0.0 || v[c] != 0.0) dense::subtract(column(c) + c, u[c], p + c, v[c], q + c, m - c);
        p[k] = 1.0;
        p[k + 1] = 0.0;
        q[k + 1] = 1.0;
        k += 2;
    };
    // Whether the inverse of the pivot times the largest entries beside it stays below 1 / threshold.
    auto acceptable = [&](int j, int r) {
        const double d = at(j, j), other = at(r, r), off = at(r, j), determinant = d * other - off * off;
        const double size = std::max({std::abs(d), std::abs(other), std::abs(off)});
        double beside_j = dense::largest(column(j) + fully_summed, m - fully_summed);
        double beside_r = dense::largest(column(r) + fully_summed, m - fully_summed);
        for (int i = k; i < fully_summed; ++i) {
            if (i == j || i == r) continue;
            beside_j = std::max(beside_j, std::abs(at(i, j)));
            beside_r = std::max(beside_r, std::abs(at(i, r)));
        }
        return std::abs(determinant) > NO_PIVOT * size &&
               threshold * (std::abs(other) * beside_j + std::abs(off) * beside_r) <= std::abs(determinant) &&
               threshold * (std::abs(off) * beside_j + std::abs(d) * beside_r) <= std::abs(determinant);
    };

    // A refused column may become acceptable as others are eliminated; it is tried again in the next pass, since a search
    // that began anew after every pivot would test all refused columns as often as there are pivots.
    for (bool eliminated = true; eliminated && k < fully_summed;) {
        eliminated = false;
        for (int j = k; j < fully_summed; j = std::max(j + 1, k)) {
            double partner = 0.0;  // the largest entry whose row could make a pivot of order 2 with j
            int r = -1;
            const double* own = column(j);
            for (int i = k; i < j; ++i) {
                const double size = std::abs(column(i)[j]);
                if (size > partner) partner = size, r = i;
            }
            for (int i = j + 1; i < fully_summed; ++i) {
                const double size = std::abs(own[i]);
                if (size > partner) partner = size, r = i;
            }
            const double d = std::abs(own[j]);
            const bool enough =
                d > NO_PIVOT &&
                d >= threshold * std::max(partner, dense::largest(own + fully_summed, m - fully_summed));
            const bool preferred = enough && d >= DIAGONAL_PREFERENCE * partner;
            if (!preferred && partner > NO_PIVOT && acceptable(j, r)) {
                pair(j, r);
                eliminated = true;
            } else if (enough) {
                single(j);
                eliminated = true;
            }
        }
    }
    factor.pivots = k;
    factor.delayed = fully_summed - k;
}

// Whether what was eliminated below and in a front excludes as many negative eigenvalues as there are constraints.
//
// For K = [H A^T; A -D] with diagonal D >= 0 take some variables and all constraints they occur in. If that part of K
// has more negative eigenvalues than constraints, a direction of these variables alone has A d = 0 (D = 0) and
// d^T H d < 0, or d^T (H + A^T D^-1 A) d < 0, and keeps it in all of K. Here these are the eliminated variables and
// constraints E and the constraints B among the remaining rows, with as many negative eigenvalues as E and the Schur
// complement of B together; that one has at least as many as negative pivots are found on its diagonal.
bool Factorization::too_many_negative(const Front& front, const Factor& factor) {
    const int surplus = factor.negative - factor.constraints;
    if (surplus < 1) return false;
    const int* index = index_.data() + factor.index + factor.pivots;
    positions_.clear();
    for (int i = 0; i < factor.delayed + front.rows; ++i)
        if (constraint_[index[i]]) positions_.push_back(i);
    const int b = static_cast<int>(positions_.size());
    int needed = b - surplus + 1;  // negative eigenvalues of the Schur complement that prove it
    if (needed <= 0) return true;
    const double* block = stack_[front.level & 1].data() + factor.contribution;
    // A proof that costs more than the front itself is not worth looking for.
    if (static_cast<double>(b) * b * needed > static_cast<double>(factor.order) * factor.order * factor.pivots) return false;
    const int leading = factor.contribution_leading;
    schur_.resize(static_cast<std::size_t>(b) * b);
    double largest = 0.0;
    for (int j = 0; j < b; ++j)
        for (int i = j; i < b; ++i) {
            const double value = block[static_cast<std::size_t>(positions_[j]) * leading + positions_[i]];
            schur_[j * b + i] = schur_[i * b + j] = value;
            largest = std::max(largest, std::abs(value));
        }
    for (int remaining = b; needed <= remaining; --remaining) {
        int p = 0;
        for (int i = 1; i < b; ++i)
            if (schur_[i * b + i] < schur_[p * b + p]) p = i;
        const double d = schur_[p * b + p];
        if (!(d < -NEGATIVE_PIVOT * largest)) return false;
        if (--needed == 0) return true;
        for (int j = 0; j < b; ++j) {
            const double factor_j = schur_[p * b + j] / d;
            if (j != p && factor_j != 0.0)
                for (int i = 0; i < b; ++i)
                    if (i != p) schur_[j * b + i] -= factor_j * schur_[p * b + i];
        }
        for (int i = 0; i < b; ++i) schur_[p * b + i] = schur_[i * b + p] = 0.0;
    }
    return false;
}

}  // namespace fesd
