#include "factorization.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>

#include "dense.hpp"

namespace fesd {

namespace {

constexpr int SLACK = 16;  // kernels read and write a little beyond the end
constexpr int MAX_REORDERINGS = 4;
// In factorizations as cheap as the cheapest:
constexpr double PATIENCE = 10.0;  // excess after which a structure is given up
constexpr double DEARER = 1.5;     // than a factorization without pivots in mind: one for which adapting does not pay
constexpr double BUDGET = 20.0;    // cost at which a factorization is given up ...
constexpr int GIVEN_UP = -1;       // ... with this in the place of its rank

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

double operations_of(int order, int pivots) { return static_cast<double>(order) * order * pivots; }

void reserve(Memory<double>& memory, std::size_t size) {
    if (memory.size() < size) memory.resize(std::max(size, memory.size() + memory.size() / 2));
}

// Extend-add: the lower triangle of the columns [begin, end) of a child's contribution block is added where it belongs
// in its parent. The block has `order` rows, row i of it is row position[i] of the parent's front; `target` begins with
// row and column number `first` of that front.
inline void extend_add(const double* block, int block_leading, const int* position, int begin, int end, int order,
                       double* target, int leading, int first) {
    block += static_cast<std::size_t>(begin) * block_leading;
    for (int j = begin; j < end; ++j, block += block_leading) {
        double* column = target + static_cast<std::size_t>(position[j] - first) * leading - first;
        for (int i = j; i < order; ++i) column[position[i]] += block[i];
    }
}

}  // namespace

Factorization::Factorization(int order, int entries, const int* row, const int* column) : order_(order) {
    auto pattern = std::make_shared<Pattern>();
    pattern->order = order;
    pattern->row.assign(row, row + entries);
    pattern->column.assign(column, column + entries);
    for (int e = 0; e < entries; ++e) --pattern->row[e], --pattern->column[e];
    pattern_ = pattern;
    // IPOPT's systems end with the constraints, which are not coupled among themselves.
    std::vector<int> coupled(order, -1);  // the last row that a row is coupled with
    for (int e = 0; e < entries; ++e) {
        const int i = pattern->row[e], j = pattern->column[e];
        if (i != j) coupled[std::min(i, j)] = std::max(coupled[std::min(i, j)], std::max(i, j));
    }
    while (constraints_ < order && coupled[order - 1 - constraints_] == -1) ++constraints_;
    for (int e = 0; e < entries; ++e)
        if (pattern->row[e] == pattern->column[e] && pattern->row[e] >= order - constraints_)
            constraint_diagonal_.push_back(e);
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
    constraint_.resize(order_);
    for (int i = 0; i < order_; ++i) constraint_[i] = structure_->permutation[i] >= order_ - constraints_;
    reserve(lower_, structure_->factor_size + SLACK);
}

// Reordering: a structure with the pivots of the last factorization in their order, so that no columns are delayed if
// the same pivots are acceptable again.
void Factorization::reorder() {
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
    ++reorderings_;
    excess_ = 0.0;
}

void Factorization::settle() {
    std::vector<int> partner(order_, -1);
    for (const Factor& factor : factors_)
        for (int k = 0; k < factor.pivots; ++k) {
            if (coupling_[factor.first + k] == 0.0) continue;
            const int *index = index_.data() + factor.index + k, i = structure_->permutation[index[0]],
                      j = structure_->permutation[index[1]];
            partner[i] = j;
            partner[j] = i;
        }
    adopt(paired_structure(pattern_, partner));
    reorderings_ = 0;
    settled_ = true;
}

// Chooses the structure of the next factorization. One that was adapted to pivots that are no longer acceptable costs up
// to thirty times as much as one without pivots in mind; so it is given up when what it has cost more than the cheapest
// factorization adds up to `PATIENCE` of them, and at once when it costs more than the one before it was adapted: many
// delayed columns are then no reason to adapt one again.
void Factorization::choose_structure() {
    const bool wasteful = excess_ > PATIENCE * least_operations_;
    const bool dearer = reorderings_ > 0 && operations_ > DEARER * unadapted_operations_;
    if (dearer) adapting_pays_ = false;
    if ((wasteful && reorderings_ > 0) || dearer) {
        start_over();
    } else if (wasteful || (adapting_pays_ && delayed_ > order_ / 50 && reorderings_ < MAX_REORDERINGS)) {
        reorder();
    }
}

void Factorization::start_over() {
    adopt(minimum_degree_structure(pattern_));
    reorderings_ = 0;
    excess_ = 0.0;
}

void Factorization::count_operations() {
    double operations = 0.0;
    for (const Factor& factor : factors_) operations += operations_of(factor.order, factor.pivots);
    operations_ = operations;
    if (reorderings_ == 0) unadapted_operations_ = operations;
    least_operations_ = least_operations_ == 0.0 ? operations : std::min(least_operations_, operations);
    excess_ += operations - least_operations_;
}

void Factorization::scale(const double* value) {
    const Structure& s = *structure_;
    std::fill(work_.begin(), work_.begin() + order_, 0.0);
    for (const Front& front : s.fronts) {
        const int* index = s.index.data() + front.index_begin;
        for (int k = front.first; k < front.first + front.columns; ++k) {
            double largest = work_[k];
            for (int q = s.entry_begin[k]; q < s.entry_begin[k + 1]; ++q) {
                __builtin_prefetch(value + s.entry[q + PREFETCH_DISTANCE]);
                const double size = std::abs(value[s.entry[q]]);
                double& other = work_[index[s.entry_place[q]]];
                other = std::max(other, size);
                largest = std::max(largest, size);
            }
            scaling_[k] = inverse_root(std::max(largest, work_[k]));
        }
    }
}

// Where almost no pivot is acceptable, columns are delayed until one front holds most of the matrix, and a factorization
// takes a thousand times as long as others. One beyond its budget begins again with a structure without pivots in mind;
// if that has none left either, the matrix counts as singular, and IPOPT regularizes it.
int Factorization::factorize(const double* value, double threshold, bool stop) {
    if (!settled_ && !stopped_ && !given_up_) choose_structure();
    const double budget = least_operations_ > 0.0 ? BUDGET * least_operations_ : HUGE_VAL;
    int rank = factorize_once(value, threshold, stop, budget);
    if (rank == GIVEN_UP && reorderings_ > 0) {
        start_over();
        rank = factorize_once(value, threshold, stop, budget);
    }
    given_up_ = rank == GIVEN_UP;
    return given_up_ ? 0 : rank;
}

int Factorization::factorize_once(const double* value, double threshold, bool stop, double budget) {
    const Structure& s = *structure_;
    // A matrix that is factorized without a solution in between is the last one with another regularization.
    if (!scaled_) scale(value);
    scaled_ = true;
    const auto& corner = constraint_diagonal_;
    stop = stop && may_stop_ && std::all_of(corner.begin(), corner.end(), [&](int e) { return value[e] <= 0.0; });
    stopped_ = false;
    negative_ = delayed_ = 0;
    int rank = 0;
    std::size_t lower_top = 0, index_top = 0, top[2] = {0, 0};
    for (std::size_t f = 0; f < s.fronts.size(); ++f) {
        const Front& front = s.fronts[f];
        Factor& factor = factors_[f];
        const int* child = s.child.data() + s.child_begin[f];
        int inherited = 0;  // delayed columns of the children
        for (int c = 0; c < front.children; ++c) inherited += factors_[child[c]].delayed;
        const int fully_summed = front.columns + inherited, m = fully_summed + front.rows;
        budget -= operations_of(m, fully_summed);
        if (budget < 0.0) return GIVEN_UP;
        reserve(dense_, m + SLACK);

        factor.order = m;
        factor.first = rank;
        factor.index = index_top;
        factor.lower = lower_top;
        if (index_.size() < index_top + m) index_.resize(2 * (index_top + m));
        int* index = index_.data() + index_top;
        for (int c = 0; c < front.children; ++c) {  // delayed columns come first
            const Factor& below = factors_[child[c]];
            index = std::copy_n(index_.data() + below.index + below.pivots, below.delayed, index);
        }
        std::copy_n(s.index.data() + front.index_begin, front.columns + front.rows, index);
        index_top += m;

        const std::size_t size = static_cast<std::size_t>(m) * fully_summed;
        reserve(panel_, size + SLACK);
        reserve(weighted_, size + SLACK);
        double* panel = panel_.data();
        std::fill(panel, panel + size, 0.0);
        double* own = panel + static_cast<std::size_t>(inherited) * m + inherited;
        for (int k = 0; k < front.columns; ++k, own += m) {
            const double factor_k = scaling_[front.first + k];
            for (int q = s.entry_begin[front.first + k]; q < s.entry_begin[front.first + k + 1]; ++q) {
                __builtin_prefetch(value + s.entry[q + PREFETCH_DISTANCE]);
                own[s.entry_place[q]] += value[s.entry[q]] * factor_k * scaling_[index[s.entry_place[q]]];
            }
        }
        for (int c = 0, inherited_before = 0; c < front.children; ++c) {
            const Factor& below = factors_[child[c]];
            const int* position = relative_indices(s.fronts[child[c]], below, inherited, inherited_before);
            const int order = below.delayed + s.fronts[child[c]].rows;
            const int end = static_cast<int>(std::lower_bound(position, position + order, fully_summed) - position);
            const double* source = stack_[(front.level + 1) & 1].data() + below.contribution;
            extend_add(source, below.contribution_leading, position, 0, end, order, panel, m, 0);
        }

        const int negative_before = negative_;
        eliminate(factor, fully_summed, threshold);
        factor.negative = negative_ - negative_before;
        factor.constraints = 0;
        for (int k = 0; k < factor.pivots; ++k) factor.constraints += constraint_[index_[factor.index + k]];
        for (int c = 0; c < front.children; ++c) {
            factor.negative += factors_[child[c]].negative;
            factor.constraints += factors_[child[c]].constraints;
        }
        rank += factor.pivots;  // a column that a root delays has no further front: the matrix is singular
        delayed_ += factor.delayed;
        form_contribution_block(front, static_cast<int>(f), fully_summed, inherited, top);
        reserve(lower_, lower_top + static_cast<std::size_t>(m) * factor.pivots);
        for (int k = 0; k < factor.pivots; ++k, panel += m) {
            std::copy(panel + k + 1, panel + m, lower_.data() + lower_top);
            lower_top += m - k - 1;
        }
        if (stop && front.parent != -1 && too_many_negative(front, factor)) {
            stopped_ = true;
            negative_ = constraints_ + 1;
            threshold_ = threshold;
            return order_;
        }
    }
    count_operations();
    return rank;
}

// Where the rows of a child's contribution block are in its parent, rising: delayed columns, then the others.
// `inherited` counts the delayed columns of all children, `inherited_before` those of the children before this one.
const int* Factorization::relative_indices(const Front& child, const Factor& factor, int inherited,
                                           int& inherited_before) {
    const int* relative_index = structure_->relative_index.data() + child.rows_begin;
    if (inherited == 0) return relative_index;
    positions_.resize(factor.delayed + child.rows);
    for (int i = 0; i < factor.delayed; ++i) positions_[i] = inherited_before++;
    for (int i = 0; i < child.rows; ++i) positions_[factor.delayed + i] = inherited + relative_index[i];
    return positions_.data();
}

// The contribution block of a front, C - L D L^T with the children's contribution blocks in C, is put on one stack;
// the children's are taken off the other.
void Factorization::form_contribution_block(const Front& front, int number, int fully_summed, int inherited,
                                            std::size_t (&top)[2]) {
    const Structure& s = *structure_;
    Factor& factor = factors_[number];
    const int m = factor.order, delayed = factor.delayed, rows = front.rows, side = front.level & 1;
    const int leading = factor.contribution_leading = delayed + (rows + 3) / 4 * 4;
    const int* child = s.child.data() + s.child_begin[number];
    factor.contribution = top[side];
    if (front.parent != -1 && delayed + rows > 0) {
        const std::size_t size = static_cast<std::size_t>(leading) * (delayed + rows);
        reserve(stack_[side], top[side] + size + SLACK);
        double* block = stack_[side].data() + top[side];
        const double* panel = panel_.data();
        for (int j = 0; j < delayed; ++j) {
            const double* column = panel + static_cast<std::size_t>(factor.pivots + j) * m;
            std::copy(column + factor.pivots + j, column + m, block + static_cast<std::size_t>(j) * leading + j);
        }
        double* schur = block + static_cast<std::size_t>(delayed) * leading + delayed;
        dense::product(rows, factor.pivots, panel + fully_summed, weighted_.data() + fully_summed, m, schur, leading);
        for (int c = 0, inherited_before = 0; c < front.children; ++c) {
            const Factor& below = factors_[child[c]];
            const int* position = relative_indices(s.fronts[child[c]], below, inherited, inherited_before);
            const int order = below.delayed + s.fronts[child[c]].rows;
            const int begin = static_cast<int>(std::lower_bound(position, position + order, fully_summed) - position);
            const double* source = stack_[side ^ 1].data() + below.contribution;
            extend_add(source, below.contribution_leading, position, begin, order, order, schur, leading, fully_summed);
        }
        top[side] += size;
    }
    if (front.children > 0) top[side ^ 1] = factors_[child[0]].contribution;
}

}  // namespace fesd
