#include "factorization.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>

#include "dense.hpp"

namespace fesd {

namespace {

constexpr double STRONG = 0.1;      // a diagonal entry this large beside its possible partners is taken as it is
constexpr double NO_PIVOT = 1e-20;  // of the scaled matrix: below this a column counts as zero
constexpr int SLACK = 16;           // kernels read and write a little beyond the end
constexpr int LEARN_AT_MOST = 4;

// 2^k near the inverse root of a size, so that scaling costs no round-off.
double inverse_root(double size) {
    std::uint64_t bits;
    std::memcpy(&bits, &size, sizeof bits);
    const int exponent = static_cast<int>(bits >> 52 & 0x7ff);
    if (exponent == 0 || exponent == 0x7ff) return 1.0;  // zero, or not a number
    const int half = (exponent - 1023 + 1) >> 1;
    bits = static_cast<std::uint64_t>(1023 - half) << 52;
    double result;
    std::memcpy(&result, &bits, sizeof result);
    return result;
}

void reserve(Memory<double>& memory, std::size_t size) {
    if (memory.size() < size) memory.resize(std::max(size, memory.size() + memory.size() / 2));
}

}  // namespace

Factorization::Factorization(int order, int entries, const int* row, const int* column) : order_(order) {
    auto pattern = std::make_shared<Pattern>();
    pattern->order = order;
    pattern->row.assign(row, row + entries);
    pattern->column.assign(column, column + entries);
    for (int e = 0; e < entries; ++e) --pattern->row[e], --pattern->column[e];
    pattern_ = pattern;
    adopt(minimum_degree_structure(pattern_));
}

void Factorization::adopt(std::shared_ptr<const Structure> structure) {
    structure_ = std::move(structure);
    pattern_ = structure_->pattern;
    factors_.assign(structure_->fronts.size(), Factor());
    diagonal_.resize(order_);
    coupling_.resize(order_);
    scaling_.resize(order_);
    work_.resize(order_);
    scaled_ = false;
    reserve(lower_, structure_->factor_size + SLACK);
}

// A structure in which the pivots found last come in their order, so that no columns are passed on if they are found again.
void Factorization::learn() {
    std::vector<int> order;
    std::vector<char> paired(order_, 0), seen(order_, 0);
    order.reserve(order_);
    for (const Factor& factor : factors_)
        for (int k = 0; k < factor.pivots; ++k) {
            const int i = index_[factor.index + k];
            paired[order.size()] = coupling_[factor.first + k] != 0.0;
            seen[i] = 1;
            order.push_back(structure_->permutation[i]);
        }
    for (int i = 0; i < order_; ++i)
        if (!seen[i]) order.push_back(structure_->permutation[i]);
    adopt(structure_in_order(pattern_, order, paired));
    ++learned_;
}

void Factorization::scale(const double* value) {
    const Structure& s = *structure_;
    std::fill(work_.begin(), work_.begin() + order_, 0.0);
    for (const Front& front : s.fronts) {
        const int* index = s.index.data() + front.index_begin;
        for (int k = front.first; k < front.first + front.columns; ++k) {
            double most = work_[k];
            for (int q = s.entry_begin[k]; q < s.entry_begin[k + 1]; ++q) {
                const double size = std::abs(value[s.entry[q]]);
                double& other = work_[index[s.entry_place[q]]];
                other = std::max(other, size);
                most = std::max(most, size);
            }
            scaling_[k] = inverse_root(std::max(most, work_[k]));
        }
    }
}

int Factorization::factorize(const double* value, double threshold) {
    if (delayed_ > order_ / 50 && learned_ < LEARN_AT_MOST) learn();
    const Structure& s = *structure_;
    // A matrix that is factorized without a solution in between is the last one with another regularization.
    if (!scaled_) scale(value);
    scaled_ = true;
    negative_ = two_by_two_ = delayed_ = 0;
    factor_entries_ = 0;
    flops_ = 0.0;
    int rank = 0;
    std::size_t lower_top = 0, index_top = 0, top[2] = {0, 0};
    for (std::size_t f = 0; f < s.fronts.size(); ++f) {
        const Front& front = s.fronts[f];
        Factor& factor = factors_[f];
        const int* child = s.child.data() + s.child_begin[f];
        int late = 0;
        for (int c = 0; c < front.children; ++c) late += factors_[child[c]].delayed;
        const int summed = front.columns + late, m = summed + front.rows;
        reserve(dense_, m + SLACK);

        factor.order = m;
        factor.first = rank;
        factor.index = index_top;
        factor.lower = lower_top;
        if (index_.size() < index_top + m) index_.resize(2 * (index_top + m));
        int* index = index_.data() + index_top;
        for (int c = 0; c < front.children; ++c) {  // columns that found no pivot in a child come first
            const Factor& below = factors_[child[c]];
            index = std::copy_n(index_.data() + below.index + below.pivots, below.delayed, index);
        }
        std::copy_n(s.index.data() + front.index_begin, front.columns + front.rows, index);
        index_top += m;

        const std::size_t size = static_cast<std::size_t>(m) * summed;
        reserve(lower_, lower_top + size + SLACK);
        reserve(weighted_, size + SLACK);
        double* panel = lower_.data() + lower_top;
        std::fill(panel, panel + size, 0.0);
        double* own = panel + static_cast<std::size_t>(late) * m + late;
        for (int k = 0; k < front.columns; ++k, own += m) {
            const double factor_k = scaling_[front.first + k];
            for (int q = s.entry_begin[front.first + k]; q < s.entry_begin[front.first + k + 1]; ++q)
                own[s.entry_place[q]] += value[s.entry[q]] * factor_k * scaling_[index[s.entry_place[q]]];
        }
        for (int c = 0, arrived = 0; c < front.children; ++c) {
            const Factor& below = factors_[child[c]];
            const int* place = places(s.fronts[child[c]], below, late, arrived);
            const int rows = below.delayed + s.fronts[child[c]].rows;
            const double* source = stack_[(front.level + 1) & 1].data() + below.rest;
            for (int j = 0; j < rows && place[j] < summed; ++j, source += below.rest_leading) {
                double* target = panel + static_cast<std::size_t>(place[j]) * m;
                for (int i = j; i < rows; ++i) target[place[i]] += source[i];
            }
        }

        eliminate(factor, summed, threshold);
        rank += factor.pivots;  // what a root leaves over has nowhere to go: the matrix is singular
        delayed_ += factor.delayed;
        lower_top += static_cast<std::size_t>(m) * factor.pivots;
        factor_entries_ += static_cast<long long>(factor.pivots) * m - static_cast<long long>(factor.pivots) * (factor.pivots - 1) / 2;
        for (int k = 0; k < factor.pivots; ++k) flops_ += static_cast<double>(m - k) * (m - k);
        pass_on(front, static_cast<int>(f), summed, late, top);
    }
    return rank;
}

// Where the rows of what a child left are in its parent, rising: delayed columns, then the others. `arrived` counts the
// delayed columns of the children before it.
const int* Factorization::places(const Front& child, const Factor& factor, int late, int& arrived) {
    const int* in_parent = structure_->in_parent.data() + child.rows_begin;
    if (late == 0) return in_parent;
    place_.resize(factor.delayed + child.rows);
    for (int i = 0; i < factor.delayed; ++i) place_[i] = arrived++;
    for (int i = 0; i < child.rows; ++i) place_[factor.delayed + i] = late + in_parent[i];
    return place_.data();
}

// What a front leaves for its parent, C - L D L^T, on the stack; what its children left is taken off theirs.
void Factorization::pass_on(const Front& front, int number, int summed, int late, std::size_t (&top)[2]) {
    const Structure& s = *structure_;
    Factor& factor = factors_[number];
    const int m = factor.order, left = factor.delayed, rest = front.rows, side = front.level & 1;
    const int leading = factor.rest_leading = left + (rest + 3) / 4 * 4;
    const int* child = s.child.data() + s.child_begin[number];
    factor.rest = top[side];
    if (front.parent != -1 && left + rest > 0) {
        const std::size_t size = static_cast<std::size_t>(leading) * (left + rest);
        reserve(stack_[side], top[side] + size + SLACK);
        double* out = stack_[side].data() + top[side];
        const double* panel = lower_.data() + factor.lower;
        for (int j = 0; j < left; ++j)
            std::copy(panel + static_cast<std::size_t>(factor.pivots + j) * m + factor.pivots + j,
                      panel + static_cast<std::size_t>(factor.pivots + j) * m + m, out + static_cast<std::size_t>(j) * leading + j);
        double* square = out + static_cast<std::size_t>(left) * leading + left;
        dense::product(rest, factor.pivots, panel + summed, weighted_.data() + summed, m, square, leading);
        for (int c = 0, arrived = 0; c < front.children; ++c) {
            const Factor& below = factors_[child[c]];
            const int* place = places(s.fronts[child[c]], below, late, arrived);
            const int rows = below.delayed + s.fronts[child[c]].rows;
            const int begin = static_cast<int>(std::lower_bound(place, place + rows, summed) - place);
            const double* source = stack_[side ^ 1].data() + below.rest + static_cast<std::size_t>(begin) * below.rest_leading;
            for (int j = begin; j < rows; ++j, source += below.rest_leading) {
                double* target = square + static_cast<std::size_t>(place[j] - summed) * leading - summed;
                for (int i = j; i < rows; ++i) target[place[i]] += source[i];
            }
        }
        top[side] += size;
    }
    if (front.children > 0) top[side ^ 1] = factors_[child[0]].rest;
}

// Eliminates what can be among the first `summed` columns of a front; the others are moved behind the pivots.
void Factorization::eliminate(Factor& factor, int summed, double threshold) {
    const int m = factor.order;
    double* a = lower_.data() + factor.lower;
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
        for (int c = k + 1; c < summed; ++c)
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
        two_by_two_ += 1;
        const double i00 = d1 / determinant, i11 = d0 / determinant, i01 = -e / determinant;
        for (int i = k + 2; i < m; ++i) {
            u[i] = p[i];
            v[i] = q[i];
            p[i] = i00 * u[i] + i01 * v[i];
            q[i] = i01 * u[i] + i11 * v[i];
        }
        for (int c = k + 2; c < summed; ++c)
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
        double beside_j = dense::largest(column(j) + summed, m - summed);
        double beside_r = dense::largest(column(r) + summed, m - summed);
        for (int i = k; i < summed; ++i) {
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
            const double* own = column(j);
            for (int i = k; i < j; ++i) {
                const double size = std::abs(column(i)[j]);
                if (size > partner) partner = size, r = i;
            }
            for (int i = j + 1; i < summed; ++i) {
                const double size = std::abs(own[i]);
                if (size > partner) partner = size, r = i;
            }
            const double d = std::abs(own[j]);
            const bool enough =
                d > NO_PIVOT && d >= threshold * std::max(partner, dense::largest(own + summed, m - summed));
            const bool strong = enough && d >= STRONG * partner;
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
    factor.delayed = summed - k;
}

void Factorization::solve(double* x) {
    scaled_ = false;
    const std::vector<int>& permutation = structure_->permutation;
    double *y = work_.data(), *t = dense_.data();
    for (int i = 0; i < order_; ++i) y[i] = x[permutation[i]] * scaling_[i];
    for (const Factor& factor : factors_) {
        const int m = factor.order, pivots = factor.pivots, *index = index_.data() + factor.index;
        const double* column = lower_.data() + factor.lower;
        for (int i = 0; i < m; ++i) t[i] = y[index[i]];
        int k = 0;
        for (; k + 2 <= pivots; k += 2, column += 2 * m) {
            const double first = t[k], second = t[k + 1] -= column[k + 1] * first;
            dense::subtract(t + k + 2, first, column + k + 2, second, column + m + k + 2, m - k - 2);
        }
        if (k < pivots) dense::subtract(t + k + 1, t[k], column + k + 1, m - k - 1);
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
        const double* column = lower_.data() + factor.lower + static_cast<std::size_t>(factor.pivots) * m;
        int k = factor.pivots;
        for (; k >= 2; k -= 2) {
            column -= 2 * m;
            double first = 0.0, second = 0.0;
            dense::products(column + k, column + m + k, t + k, m - k, first, second);
            t[k - 1] -= second;
            t[k - 2] -= first + column[k - 1] * t[k - 1];
        }
        if (k == 1) {
            column -= m;
            t[0] -= dense::product(column + 1, t + 1, m - 1);
        }
        for (int i = 0; i < factor.pivots; ++i) y[index[i]] = t[i];
    }
    for (int i = 0; i < order_; ++i) x[permutation[i]] = y[i] * scaling_[i];
}

}  // namespace fesd
