// What depends on the pattern alone: elimination order, fronts, and where every entry goes.
#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>
#include <algorithm>
#include <numeric>

#include "factorization.hpp"

namespace fesd {

namespace {

constexpr int SMALL = 16;           // a front with so few columns joins its parent when that costs little

// Elimination tree and column counts of a symmetric matrix whose upper triangle is given by columns.
void elimination_tree(int n, const std::vector<int>& ptr, const std::vector<int>& ind, std::vector<int>& parent) {
    std::vector<int> ancestor(n, -1);
    parent.assign(n, -1);
    for (int k = 0; k < n; ++k)
        for (int p = ptr[k]; p < ptr[k + 1]; ++p)
            for (int i = ind[p]; i != -1 && i < k;) {
                int next = ancestor[i];
                ancestor[i] = k;
                if (next == -1) parent[i] = k;
                i = next;
            }
}

std::vector<int> postorder(const std::vector<int>& parent) {
    int n = static_cast<int>(parent.size());
    std::vector<int> head(n, -1), next(n, -1), order, stack;
    order.reserve(n);
    for (int i = n - 1; i >= 0; --i)
        if (parent[i] != -1) next[i] = head[parent[i]], head[parent[i]] = i;
    for (int root = 0; root < n; ++root) {
        if (parent[root] != -1) continue;
        stack.push_back(root);
        while (!stack.empty()) {
            int i = stack.back();
            if (head[i] == -1) {
                order.push_back(i);
                stack.pop_back();
            } else {
                int child = head[i];
                head[i] = next[child];
                stack.push_back(child);
            }
        }
    }
    return order;
}

}  // namespace

Factorization::Factorization(int order, int entries, const int* row, const int* column)
    : order_(order), entries_(entries), row_(row, row + entries), column_(column, column + entries) {
    for (int e = 0; e < entries; ++e) --row_[e], --column_[e];
    analyse();
}

void Factorization::analyse() {
    const int order = order_, entries = entries_;
    std::vector<Eigen::Triplet<double, int>> triplets;
    triplets.reserve(2 * entries + order);
    for (int e = 0; e < entries; ++e) {
        triplets.emplace_back(row_[e], column_[e], 1.0);
        triplets.emplace_back(column_[e], row_[e], 1.0);
    }
    for (int i = 0; i < order; ++i) triplets.emplace_back(i, i, 1.0);
    Eigen::SparseMatrix<double, Eigen::ColMajor, int> pattern(order, order);
    pattern.setFromTriplets(triplets.begin(), triplets.end());
    Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> amd;
    Eigen::AMDOrdering<int>()(pattern, amd);  // variable amd.indices()[k] is eliminated at place k

    std::vector<int> first(amd.indices().data(), amd.indices().data() + order), position(order);
    auto permuted = [&](std::vector<int>& ptr, std::vector<int>& ind) {
        for (int k = 0; k < order; ++k) position[first[k]] = k;
        ptr.assign(order + 1, 0);
        ind.clear();
        for (int k = 0; k < order; ++k) {
            for (Eigen::SparseMatrix<double>::InnerIterator it(pattern, first[k]); it; ++it)
                ind.push_back(position[it.row()]);
            std::sort(ind.begin() + ptr[k], ind.end());
            ptr[k + 1] = static_cast<int>(ind.size());
        }
    };
    std::vector<int> ptr, ind, parent;
    permuted(ptr, ind);
    elimination_tree(order, ptr, ind, parent);
    std::vector<int> post = postorder(parent), combined(order);
    for (int k = 0; k < order; ++k) combined[k] = first[post[k]];
    first = combined;
    permuted(ptr, ind);
    permutation_ = first;
    inverse_ = position;
    build_fronts(ptr, ind);

    place_entries();

    factors_.assign(fronts_.size(), Factor());
    contribution_.assign(fronts_.size(), {});
    scaling_.assign(order, 1.0);
    values_.resize(entries);
    work_.resize(order);
}

// Where every entry, and every row of a child, sits in its front, not counting columns that come delayed from children.
void Factorization::place_entries() {
    place_row_.resize(entries_);
    place_column_.resize(entries_);
    std::vector<int> owner(entries_), local(order_, -1);
    for (int e = 0; e < entries_; ++e) {
        const int i = inverse_[row_[e]], j = inverse_[column_[e]];
        place_row_[e] = std::max(i, j);
        place_column_[e] = std::min(i, j);
        owner[e] = front_of_[place_column_[e]];
    }
    front_begin_.assign(fronts_.size() + 1, 0);
    for (int f : owner) ++front_begin_[f + 1];
    std::partial_sum(front_begin_.begin(), front_begin_.end(), front_begin_.begin());
    by_front_.resize(entries_);
    std::vector<int> next(front_begin_.begin(), front_begin_.end() - 1);
    for (int e = 0; e < entries_; ++e) by_front_[next[owner[e]]++] = e;
    local_row_.resize(entries_);
    local_column_.resize(entries_);
    for (size_t f = 0; f < fronts_.size(); ++f) {
        Front& node = fronts_[f];
        for (int k = 0; k < node.columns; ++k) local[node.first + k] = k;
        for (size_t i = 0; i < node.rows.size(); ++i) local[node.rows[i]] = node.columns + static_cast<int>(i);
        for (int q = front_begin_[f]; q < front_begin_[f + 1]; ++q) {
            local_row_[q] = local[place_row_[by_front_[q]]];
            local_column_[q] = local[place_column_[by_front_[q]]];
        }
        for (int child : node.children) {
            fronts_[child].in_parent.clear();
            for (int row : fronts_[child].rows) fronts_[child].in_parent.push_back(local[row]);
        }
    }
}

void Factorization::build_fronts(const std::vector<int>& ptr, const std::vector<int>& ind) {
    int n = order_;
    std::vector<int> parent;
    elimination_tree(n, ptr, ind, parent);
    // Row structure of every column of L, merged up the tree; columns with the structure of their child join its front.
    std::vector<std::vector<int>> structure(n);
    std::vector<std::vector<int>> children(n);
    std::vector<int> mark(n, -1);
    for (int k = 0; k < n; ++k) {
        auto& rows = structure[k];
        mark[k] = k;
        for (int p = ptr[k]; p < ptr[k + 1]; ++p)
            if (ind[p] > k && mark[ind[p]] != k) mark[ind[p]] = k, rows.push_back(ind[p]);
        for (int child : children[k])
            for (int i : structure[child])
                if (i > k && mark[i] != k) mark[i] = k, rows.push_back(i);
        std::sort(rows.begin(), rows.end());
        if (parent[k] != -1) children[parent[k]].push_back(k);
    }
    // Fundamental supernodes, then relaxed ones: a last child joins its parent if few zeros come with it.
    std::vector<int> begin, width;
    for (int k = 0; k < n; ++k) {
        const bool only = k > 0 && parent[k - 1] == k && children[k].size() == 1;
        if (only && structure[k - 1].size() == structure[k].size() + 1) {
            ++width.back();
        } else {
            begin.push_back(k);
            width.push_back(1);
        }
    }
    // Relaxation works on the last child of a front, whose columns come directly before the front's own.
    std::vector<int> merged_begin, merged_width;
    std::vector<long long> merged_zeros;
    for (size_t f = 0; f < begin.size(); ++f) {
        int b = begin[f], w = width[f];
        long long z = 0;
        while (!merged_begin.empty()) {
            int cb = merged_begin.back(), cw = merged_width.back(), last = cb + cw - 1;
            if (cb + cw != b || parent[last] != b) break;
            long long rows_child = static_cast<long long>(structure[last].size());
            long long rows_here = static_cast<long long>(structure[b + w - 1].size());
            long long added = (w + rows_here - rows_child) * cw;
            long long total = merged_zeros.back() + z + added;
            long long size = static_cast<long long>(cw + w) * (cw + w + 1) / 2 + (cw + w) * rows_here;
            bool small = cw <= SMALL && w <= SMALL && total * 2 <= size;
            if (!(small || total * 8 <= size)) break;
            b = cb;
            w += cw;
            z = total;
            merged_begin.pop_back();
            merged_width.pop_back();
            merged_zeros.pop_back();
        }
        merged_begin.push_back(b);
        merged_width.push_back(w);
        merged_zeros.push_back(z);
    }
    fronts_.assign(merged_begin.size(), Front());
    front_of_.assign(n, -1);
    for (size_t f = 0; f < fronts_.size(); ++f) {
        Front& node = fronts_[f];
        node.first = merged_begin[f];
        node.columns = merged_width[f];
        for (int k = 0; k < node.columns; ++k) front_of_[node.first + k] = static_cast<int>(f);
        node.rows = structure[node.first + node.columns - 1];
    }
    for (size_t f = 0; f < fronts_.size(); ++f) {
        Front& node = fronts_[f];
        int up = parent[node.first + node.columns - 1];
        node.parent = up == -1 ? -1 : front_of_[up];
        if (node.parent != -1) fronts_[node.parent].children.push_back(static_cast<int>(f));
    }
}

}  // namespace fesd
