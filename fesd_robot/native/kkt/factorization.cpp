#include "factorization.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace fesd {

namespace {

using Matrix = Eigen::MatrixXd;
using Map = Eigen::Map<Matrix, 0, Eigen::OuterStride<>>;

constexpr int SCALING_ROUNDS = 1;
constexpr double TINY = 1e-300;
constexpr double STRONG = 0.1;      // a diagonal entry this large beside the others is taken as it is
constexpr double NO_PIVOT = 1e-20;  // of the scaled matrix: below this a column counts as zero
constexpr int BLOCK = 48;           // columns per product in the update of what remains of a front

}  // namespace

void Factorization::scale(const double* value) {
    std::fill(scaling_.begin(), scaling_.end(), 1.0);
    for (int round = 0; round < SCALING_ROUNDS; ++round) {
        std::fill(work_.begin(), work_.end(), 0.0);
        for (int e = 0; e < entries_; ++e) {
            int i = place_row_[e], j = place_column_[e];
            double size = std::abs(value[e]) * scaling_[i] * scaling_[j];
            work_[i] = std::max(work_[i], size);
            work_[j] = std::max(work_[j], size);
        }
        for (int i = 0; i < order_; ++i)
            if (work_[i] > TINY) scaling_[i] /= std::sqrt(work_[i]);
    }
    // Powers of two, so that scaling costs no round-off.
    for (double& s : scaling_) s = std::exp2(std::round(std::log2(s)));
    for (int q = 0; q < entries_; ++q) {
        const int e = by_front_[q];
        values_[q] = value[e] * scaling_[place_row_[e]] * scaling_[place_column_[e]];
    }
}

int Factorization::factorize(const double* value, double threshold) {
    scale(value);
    negative_ = two_by_two_ = delayed_ = 0;
    factor_entries_ = 0;
    flops_ = 0.0;
    int rank = 0;
    for (size_t f = 0; f < fronts_.size(); ++f) {
        const Front& node = fronts_[f];
        Factor& factor = factors_[f];
        auto& index = factor.index;
        index.clear();
        for (int child : node.children) {  // columns that found no pivot in a child come first
            const Factor& below = factors_[child];
            int left = below.order - below.pivots - static_cast<int>(fronts_[child].rows.size());
            index.insert(index.end(), below.index.begin() + below.pivots, below.index.begin() + below.pivots + left);
        }
        for (int k = 0; k < node.columns; ++k) index.push_back(node.first + k);
        const int summed = static_cast<int>(index.size()), late = summed - node.columns;
        index.insert(index.end(), node.rows.begin(), node.rows.end());
        const int m = factor.order = static_cast<int>(index.size());

        front_.assign(static_cast<size_t>(m) * m, 0.0);
        double* own = front_.data() + static_cast<size_t>(late) * m + late;
        for (int q = front_begin_[f]; q < front_begin_[f + 1]; ++q)
            own[static_cast<size_t>(local_column_[q]) * m + local_row_[q]] += values_[q];
        int arrived = 0;  // delayed columns of the children so far
        for (int child : node.children) {
            const Factor& below = factors_[child];
            int size = below.order - below.pivots;
            const double* source = contribution_[child].data();
            place_.clear();  // rising: delayed columns come first, the other rows keep their order
            const auto& in_parent = fronts_[child].in_parent;
            for (int left = size - static_cast<int>(in_parent.size()); left > 0; --left) place_.push_back(arrived++);
            for (int row : in_parent) place_.push_back(late + row);
            for (int j = 0; j < size; ++j, source += size) {
                double* column = front_.data() + static_cast<size_t>(place_[j]) * m;
                for (int i = j; i < size; ++i) column[place_[i]] += source[i];
            }
        }

        const int pivots = eliminate(factor, summed, threshold);
        rank += pivots;  // what a root leaves over has nowhere to go: the matrix is singular
        delayed_ += summed - pivots;
        int rest = m - pivots;
        if (node.parent != -1 && rest > 0) {
            auto& out = contribution_[f];
            out.resize(static_cast<size_t>(rest) * rest);
            for (int j = 0; j < rest; ++j)
                std::copy(front_.begin() + static_cast<size_t>(pivots + j) * m + pivots + j,
                          front_.begin() + static_cast<size_t>(pivots + j) * m + m,
                          out.begin() + static_cast<size_t>(j) * rest + j);
        }
        factor.lower.assign(front_.begin(), front_.begin() + static_cast<size_t>(pivots) * m);
        factor_entries_ += static_cast<long long>(pivots) * m - static_cast<long long>(pivots) * (pivots - 1) / 2;
        for (int k = 0; k < pivots; ++k) flops_ += static_cast<double>(m - k) * (m - k);
    }
    return rank;
}

// Eliminates what can be among the first `summed` columns of front_; the others are moved behind the pivots.
int Factorization::eliminate(Factor& factor, int summed, double threshold) {
    const int m = factor.order;
    double* a = front_.data();
    auto column = [&](int j) { return a + static_cast<size_t>(j) * m; };
    auto at = [&](int i, int j) -> double { return i >= j ? column(j)[i] : column(i)[j]; };
    factor.diagonal.assign(summed, 0.0);
    factor.coupling.assign(summed, 0.0);
    scratch_.resize(2 * static_cast<size_t>(m));
    double* u = scratch_.data();
    double* v = scratch_.data() + m;
    int k = 0;  // pivots done

    auto exchange = [&](int p, int q) {  // rows and columns p <= q
        if (p == q) return;
        for (int j = 0; j < p; ++j) std::swap(column(j)[p], column(j)[q]);
        for (int i = p + 1; i < q; ++i) std::swap(column(p)[i], column(i)[q]);
        for (int i = q + 1; i < m; ++i) std::swap(column(p)[i], column(q)[i]);
        std::swap(column(p)[p], column(q)[q]);
        std::swap(factor.index[p], factor.index[q]);
    };
    auto single = [&](int j) {
        exchange(k, j);
        double* pivot = column(k);
        const double d = pivot[k], inverse = 1.0 / d;
        factor.diagonal[k] = d;
        negative_ += d < 0.0;
        for (int i = k + 1; i < m; ++i) u[i] = pivot[i], pivot[i] *= inverse;
        for (int c = k + 1; c < summed; ++c) {
            const double w = u[c];
            if (w == 0.0) continue;
            double* target = column(c);
            for (int i = c; i < m; ++i) target[i] -= w * pivot[i];
        }
        pivot[k] = 1.0;
        k += 1;
    };
    auto pair = [&](int j, int r) {
        exchange(k, std::min(j, r));
        exchange(k + 1, std::max(j, r));
        double *p = column(k), *q = column(k + 1);
        const double d0 = p[k], d1 = q[k + 1], e = p[k + 1], determinant = d0 * d1 - e * e;
        factor.diagonal[k] = d0;
        factor.diagonal[k + 1] = d1;
        factor.coupling[k] = e;
        negative_ += determinant < 0.0 ? 1 : (d0 < 0.0 ? 2 : 0);
        two_by_two_ += 1;
        const double i00 = d1 / determinant, i11 = d0 / determinant, i01 = -e / determinant;
        for (int i = k + 2; i < m; ++i) {
            u[i] = p[i];
            v[i] = q[i];
            p[i] = i00 * u[i] + i01 * v[i];
            q[i] = i01 * u[i] + i11 * v[i];
        }
        for (int c = k + 2; c < summed; ++c) {
            const double wu = u[c], wv = v[c];
            if (wu == 0.0 && wv == 0.0) continue;
            double* target = column(c);
            for (int i = c; i < m; ++i) target[i] -= wu * p[i] + wv * q[i];
        }
        p[k] = 1.0;
        p[k + 1] = 0.0;
        q[k + 1] = 1.0;
        k += 2;
    };
    // Whether the inverse of the pivot times the largest entries beside it stays below 1 / threshold.
    auto acceptable = [&](int j, int r) {
        const double d = at(j, j), other = at(r, r), off = at(r, j), determinant = d * other - off * off;
        const double size = std::max({std::abs(d), std::abs(other), std::abs(off)});
        double beside_j = 0.0, beside_r = 0.0;
        for (int i = k; i < m; ++i) {
            if (i == j || i == r) continue;
            beside_j = std::max(beside_j, std::abs(at(i, j)));
            beside_r = std::max(beside_r, std::abs(at(i, r)));
        }
        return std::abs(determinant) > NO_PIVOT * size &&
               threshold * (std::abs(other) * beside_j + std::abs(off) * beside_r) <= std::abs(determinant) &&
               threshold * (std::abs(off) * beside_j + std::abs(d) * beside_r) <= std::abs(determinant);
    };

    for (bool found = true; found && k < summed;) {
        found = false;
        for (int j = k; j < summed && !found; ++j) {
            double partner = 0.0;  // the largest entry in a row that could make a pivot of order 2 with j
            int r = -1;
            for (int i = k; i < summed; ++i) {
                const double size = i == j ? 0.0 : std::abs(at(i, j));
                if (size > partner) partner = size, r = i;
            }
            const double* own = column(j);
            const double d = std::abs(own[j]);
            double largest = partner;
            if (m > summed)
                largest = std::max(largest, Eigen::Map<const Eigen::ArrayXd>(own + summed, m - summed).abs().maxCoeff());
            const bool enough = d > NO_PIVOT && d >= threshold * largest;
            const bool strong = enough && (d >= STRONG * partner || d >= STRONG * largest);
            if (!strong && partner > NO_PIVOT && acceptable(j, r)) {
                pair(j, r);
                found = true;
            } else if (enough) {
                single(j);
                found = true;
            }
        }
    }
    factor.pivots = k;
    factor.diagonal.resize(k);
    factor.coupling.resize(k);
    // What remains: C -= L2 D L2^T for the rows beyond the summed columns; the columns that were passed over are
    // up to date in all their rows.
    int rest = m - summed;
    if (rest > 0 && k > 0) {
        Map lower(a, m, k, Eigen::OuterStride<>(m));
        weighted_.resize(static_cast<size_t>(rest) * k);
        Map weighted(weighted_.data(), rest, k, Eigen::OuterStride<>(rest));
        for (int c = 0; c < k;) {
            if (factor.coupling[c] != 0.0) {
                weighted.col(c) = factor.diagonal[c] * lower.col(c).tail(rest) + factor.coupling[c] * lower.col(c + 1).tail(rest);
                weighted.col(c + 1) = factor.coupling[c] * lower.col(c).tail(rest) + factor.diagonal[c + 1] * lower.col(c + 1).tail(rest);
                c += 2;
            } else {
                weighted.col(c) = factor.diagonal[c] * lower.col(c).tail(rest);
                c += 1;
            }
        }
        Map target(a + static_cast<size_t>(summed) * m + summed, rest, rest, Eigen::OuterStride<>(m));
        for (int b = 0; b < rest; b += BLOCK) {
            int w = std::min(BLOCK, rest - b);
            target.block(b, b, rest - b, w).noalias() -=
                lower.block(summed + b, 0, rest - b, k) * weighted.block(b, 0, w, k).transpose();
        }
    }
    return k;
}

void Factorization::solve(double* x) {
    std::vector<double>& y = work_;
    for (int i = 0; i < order_; ++i) y[i] = x[permutation_[i]] * scaling_[i];
    for (size_t f = 0; f < factors_.size(); ++f) {
        const Factor& factor = factors_[f];
        const double* column = factor.lower.data();
        for (int k = 0; k < factor.pivots; ++k, column += factor.order) {
            double value = y[factor.index[k]];
            if (value == 0.0) continue;
            for (int i = k + 1; i < factor.order; ++i) y[factor.index[i]] -= column[i] * value;
        }
    }
    for (const Factor& factor : factors_)
        for (int k = 0; k < factor.pivots;) {
            double& first = y[factor.index[k]];
            if (factor.coupling[k] != 0.0) {
                double& second = y[factor.index[k + 1]];
                double d0 = factor.diagonal[k], d1 = factor.diagonal[k + 1], e = factor.coupling[k];
                double determinant = d0 * d1 - e * e, old = first;
                first = (d1 * old - e * second) / determinant;
                second = (d0 * second - e * old) / determinant;
                k += 2;
            } else {
                first /= factor.diagonal[k];
                k += 1;
            }
        }
    for (size_t f = factors_.size(); f-- > 0;) {
        const Factor& factor = factors_[f];
        for (int k = factor.pivots - 1; k >= 0; --k) {
            const double* column = factor.lower.data() + static_cast<size_t>(k) * factor.order;
            double value = y[factor.index[k]];
            for (int i = k + 1; i < factor.order; ++i) value -= column[i] * y[factor.index[i]];
            y[factor.index[k]] = value;
        }
    }
    for (int i = 0; i < order_; ++i) x[permutation_[i]] = y[i] * scaling_[i];
}

}  // namespace fesd
