#include "structure.hpp"

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>
#include <algorithm>
#include <list>
#include <mutex>
#include <numeric>

namespace fesd {

namespace {

// About the nanoseconds a front takes: for itself, by row, operation, and entry of its contribution block. Twice
// as much or half of any makes little difference.
constexpr double FRONT_FIXED = 120, FRONT_LEAF = 60, FRONT_ROW = 3, FRONT_FLOP = 0.25, FRONT_CONTRIBUTION = 0.6;

// Adjacency without diagonal and duplicates.
struct Graph {
    std::vector<int> begin, neighbour;
};

Graph adjacency(const Pattern& pattern) {
    const int n = pattern.order, entries = static_cast<int>(pattern.row.size());
    std::vector<int> begin(n + 1, 0);
    for (int e = 0; e < entries; ++e)
        if (pattern.row[e] != pattern.column[e]) ++begin[pattern.row[e] + 1], ++begin[pattern.column[e] + 1];
    std::partial_sum(begin.begin(), begin.end(), begin.begin());
    std::vector<int> neighbour(begin[n]), next(begin.begin(), begin.end() - 1);
    for (int e = 0; e < entries; ++e) {
        const int i = pattern.row[e], j = pattern.column[e];
        if (i != j) neighbour[next[i]++] = j, neighbour[next[j]++] = i;
    }
    Graph graph;
    graph.begin.assign(n + 1, 0);
    graph.neighbour.reserve(neighbour.size());
    for (int i = 0; i < n; ++i) {
        std::sort(neighbour.begin() + begin[i], neighbour.begin() + begin[i + 1]);
        auto last = std::unique(neighbour.begin() + begin[i], neighbour.begin() + begin[i + 1]);
        graph.neighbour.insert(graph.neighbour.end(), neighbour.begin() + begin[i], last);
        graph.begin[i + 1] = static_cast<int>(graph.neighbour.size());
    }
    return graph;
}

std::vector<int> minimum_degree(const Graph& graph) {
    const int n = static_cast<int>(graph.begin.size()) - 1;
    std::vector<int> begin(n + 1), row;  // upper triangle with diagonal, without which Eigen calls a row dense
    for (int j = 0; j < n; ++j) {
        begin[j] = static_cast<int>(row.size());
        for (int p = graph.begin[j]; p < graph.begin[j + 1] && graph.neighbour[p] < j; ++p)
            row.push_back(graph.neighbour[p]);
        row.push_back(j);
    }
    begin[n] = static_cast<int>(row.size());
    const std::vector<double> ones(row.size(), 1.0);
    Eigen::Map<const Eigen::SparseMatrix<double>> upper(n, n, begin[n], begin.data(), row.data(), ones.data());
    Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> amd;
    Eigen::AMDOrdering<int>()(Eigen::SparseMatrix<double>(upper).selfadjointView<Eigen::Upper>(), amd);
    return {amd.indices().data(), amd.indices().data() + n};
}

// Elimination tree of the graph in a given order.
std::vector<int> elimination_tree(const Graph& graph, const std::vector<int>& order, const std::vector<int>& position) {
    const int n = static_cast<int>(order.size());
    std::vector<int> parent(n, -1), ancestor(n, -1);
    for (int k = 0; k < n; ++k)
        for (int p = graph.begin[order[k]]; p < graph.begin[order[k] + 1]; ++p)
            for (int i = position[graph.neighbour[p]]; i != -1 && i < k;) {
                const int next = ancestor[i];
                ancestor[i] = k;
                if (next == -1) parent[i] = k;
                i = next;
            }
    return parent;
}

// Postorder of a forest; `last` marks nodes that come directly before their parent.
std::vector<int> postorder(const std::vector<int>& parent, const std::vector<char>& last) {
    const int n = static_cast<int>(parent.size());
    std::vector<int> head(n, -1), next(n, -1), order, stack;
    order.reserve(n);
    auto insert = [&](int i) {
        if (parent[i] != -1) next[i] = head[parent[i]], head[parent[i]] = i;
    };
    for (int i = n - 1; i >= 0; --i)
        if (last[i]) insert(i);
    for (int i = n - 1; i >= 0; --i)
        if (!last[i]) insert(i);
    for (int root = 0; root < n; ++root) {
        if (parent[root] != -1) continue;
        stack.push_back(root);
        while (!stack.empty()) {
            const int i = stack.back();
            if (head[i] == -1) {
                order.push_back(i);
                stack.pop_back();
            } else {
                stack.push_back(head[i]);
                head[i] = next[head[i]];
            }
        }
    }
    return order;
}

// Number of rows below the diagonal in every column of L.
std::vector<int> column_counts(const Graph& graph, const std::vector<int>& order, const std::vector<int>& position,
                               const std::vector<int>& parent) {
    const int n = static_cast<int>(order.size());
    std::vector<int> count(n, 0), mark(n, -1);
    for (int k = 0; k < n; ++k) {
        mark[k] = k;
        for (int p = graph.begin[order[k]]; p < graph.begin[order[k] + 1]; ++p)
            for (int i = position[graph.neighbour[p]]; i < k && mark[i] != k; i = parent[i]) mark[i] = k, ++count[i];
    }
    return count;
}

// What a front costs, about, in nanoseconds.
double cost(double columns, double rows, bool leaf) {
    const double m = columns + rows;
    const double flops = columns * m * m - columns * columns * m + columns * columns * columns / 3;
    return (leaf ? FRONT_LEAF : FRONT_FIXED) + FRONT_ROW * m + FRONT_FLOP * flops + FRONT_CONTRIBUTION * rows * rows;
}

std::vector<int> inverse(const std::vector<int>& order) {
    std::vector<int> position(order.size());
    for (size_t k = 0; k < order.size(); ++k) position[order[k]] = static_cast<int>(k);
    return position;
}

// The assembly tree: fundamental supernodes in postorder, joined with their parents where that pays (amalgamation).
void make_fronts(const Graph& graph, Structure& s, const std::vector<int>& start, const std::vector<char>& paired) {
    const int n = s.pattern->order;
    std::vector<int> position = inverse(start), parent = elimination_tree(graph, start, position);
    const std::vector<int> post = postorder(parent, paired), place = inverse(post);
    std::vector<int> order(n), up(n);
    std::vector<char> tied(n);
    for (int k = 0; k < n; ++k) {
        order[k] = start[post[k]];
        tied[k] = paired[post[k]];
        up[k] = parent[post[k]] == -1 ? -1 : place[parent[post[k]]];
    }
    position = inverse(order);
    const std::vector<int> count = column_counts(graph, order, position, up);
    std::vector<int> offspring(n, 0);
    for (int k = 0; k < n; ++k)
        if (up[k] != -1) ++offspring[up[k]];

    std::vector<int> owner(n), begin;
    for (int k = 0; k < n; ++k) {
        const bool chain = k > 0 && up[k - 1] == k;
        if (!chain || !(tied[k - 1] || (offspring[k] == 1 && count[k - 1] == count[k] + 1))) begin.push_back(k);
        owner[k] = static_cast<int>(begin.size()) - 1;
    }
    const int nodes = static_cast<int>(begin.size());
    begin.push_back(n);
    std::vector<int> above(nodes), width(nodes), below(nodes);
    std::vector<std::vector<int>> children(nodes), parts(nodes);
    for (int f = 0; f < nodes; ++f) {
        const int last = begin[f + 1] - 1;
        above[f] = up[last] == -1 ? -1 : owner[up[last]];
        width[f] = begin[f + 1] - begin[f];
        below[f] = count[last];
        parts[f] = {f};
        if (above[f] != -1) children[above[f]].push_back(f);
    }
    std::vector<int> kept, taken;
    for (int f = 0; f < nodes; ++f) {
        kept.clear();
        taken.clear();
        bool leaf = children[f].empty();
        for (int c : children[f]) {
            const double apart = cost(width[c], below[c], children[c].empty()) + cost(width[f], below[f], leaf);
            if (cost(width[c] + width[f], below[f], false) < apart) {
                width[f] += width[c];
                taken.insert(taken.end(), parts[c].begin(), parts[c].end());
                kept.insert(kept.end(), children[c].begin(), children[c].end());
            } else {
                kept.push_back(c);
            }
        }
        taken.push_back(f);
        parts[f] = taken;
        children[f] = kept;
    }
    // The joined tree is numbered anew, large subtrees first, so that few contribution blocks wait on the stacks.
    std::vector<int> size(width);
    for (int f = 0; f < nodes; ++f) {
        for (int c : children[f]) size[f] += size[c];
        std::stable_sort(children[f].begin(), children[f].end(), [&](int a, int b) { return size[a] > size[b]; });
    }
    std::vector<int> stack, numbered;
    std::vector<size_t> done(nodes, 0);
    for (int f = 0; f < nodes; ++f) {
        if (above[f] != -1) continue;
        stack.push_back(f);
        while (!stack.empty()) {
            const int g = stack.back();
            if (done[g] < children[g].size()) {
                stack.push_back(children[g][done[g]++]);
            } else {
                numbered.push_back(g);
                stack.pop_back();
            }
        }
    }
    std::vector<int> number(nodes, -1);
    for (size_t f = 0; f < numbered.size(); ++f) number[numbered[f]] = static_cast<int>(f);
    s.fronts.assign(numbered.size(), Front());
    s.child_begin.assign(1, 0);
    for (size_t f = 0; f < numbered.size(); ++f) {
        Front& front = s.fronts[f];
        front.first = static_cast<int>(s.permutation.size());
        for (int part : parts[numbered[f]])
            for (int k = begin[part]; k < begin[part + 1]; ++k) s.permutation.push_back(order[k]);
        front.columns = static_cast<int>(s.permutation.size()) - front.first;
        for (int c : children[numbered[f]]) {
            s.child.push_back(number[c]);
            s.fronts[number[c]].parent = static_cast<int>(f);
        }
        front.children = static_cast<int>(children[numbered[f]].size());
        s.child_begin.push_back(static_cast<int>(s.child.size()));
    }
    for (size_t f = s.fronts.size(); f-- > 0;)
        s.fronts[f].level = s.fronts[f].parent == -1 ? 0 : s.fronts[s.fronts[f].parent].level + 1;
}

// Rows of every front, and where every entry of the matrix and every row of a child is in its front.
void symbolic_factorization(const Graph& graph, Structure& s) {
    const Pattern& pattern = *s.pattern;
    const int n = pattern.order, entries = static_cast<int>(pattern.row.size());
    const std::vector<int> position = inverse(s.permutation);
    s.entry_begin.assign(n + 1, 0);
    for (int e = 0; e < entries; ++e)
        ++s.entry_begin[std::min(position[pattern.row[e]], position[pattern.column[e]]) + 1];
    std::partial_sum(s.entry_begin.begin(), s.entry_begin.end(), s.entry_begin.begin());
    std::vector<int> next(s.entry_begin.begin(), s.entry_begin.end() - 1);
    s.entry.assign(entries + PREFETCH_DISTANCE, 0);
    s.entry_place.resize(entries);
    for (int e = 0; e < entries; ++e) {
        const int i = position[pattern.row[e]], j = position[pattern.column[e]], q = next[std::min(i, j)]++;
        s.entry[q] = e;
        s.entry_place[q] = std::max(i, j);
    }
    std::vector<int> mark(n, -1), local(n, -1);
    for (size_t f = 0; f < s.fronts.size(); ++f) {
        Front& front = s.fronts[f];
        front.index_begin = static_cast<int>(s.index.size());
        front.rows_begin = static_cast<int>(s.relative_index.size());
        const int own = front.first + front.columns, name = static_cast<int>(f);
        auto add = [&](int i) {
            if (i >= own && mark[i] != name) mark[i] = name, s.index.push_back(i);
        };
        for (int k = front.first; k < own; ++k) s.index.push_back(k);
        for (int k = front.first; k < own; ++k)
            for (int p = graph.begin[s.permutation[k]]; p < graph.begin[s.permutation[k] + 1]; ++p)
                add(position[graph.neighbour[p]]);
        auto below = [&](int child) { return s.index.data() + s.fronts[child].index_begin + s.fronts[child].columns; };
        for (int c = s.child_begin[f]; c < s.child_begin[f + 1]; ++c)
            for (int i = 0; i < s.fronts[s.child[c]].rows; ++i) add(below(s.child[c])[i]);
        const int m = static_cast<int>(s.index.size()) - front.index_begin;
        front.rows = m - front.columns;
        std::sort(s.index.begin() + front.index_begin + front.columns, s.index.end());
        s.relative_index.resize(s.relative_index.size() + front.rows);
        for (int i = 0; i < m; ++i) local[s.index[front.index_begin + i]] = i;
        for (int q = s.entry_begin[front.first]; q < s.entry_begin[own]; ++q)
            s.entry_place[q] = local[s.entry_place[q]];
        for (int c = s.child_begin[f]; c < s.child_begin[f + 1]; ++c) {
            const Front& child = s.fronts[s.child[c]];
            for (int i = 0; i < child.rows; ++i) s.relative_index[child.rows_begin + i] = local[below(s.child[c])[i]];
        }
        const size_t columns = front.columns;
        s.factor_size += m * columns - columns * (columns + 1) / 2;
    }
}

constexpr size_t KEPT = 16;  // structures
constexpr size_t KEPT_ENTRIES = 4000000;  // of all kept patterns
std::mutex guard;
std::list<std::shared_ptr<const Structure>> kept;  // used last comes first

bool same(const Pattern& a, const Pattern& b) {
    return &a == &b || (a.order == b.order && a.row == b.row && a.column == b.column);
}

}  // namespace

std::shared_ptr<const Structure> structure_in_order(const std::shared_ptr<const Pattern>& pattern,
                                                    const std::vector<int>& order, const std::vector<char>& paired) {
    {
        std::lock_guard<std::mutex> lock(guard);
        for (auto it = kept.begin(); it != kept.end(); ++it)
            if ((*it)->requested == order && (*it)->paired == paired && same(*(*it)->pattern, *pattern)) {
                kept.splice(kept.begin(), kept, it);
                return kept.front();
            }
    }
    auto made = std::make_shared<Structure>();
    made->pattern = pattern;
    made->requested = order;
    made->paired = paired;
    const Graph graph = adjacency(*pattern);
    const bool free = order.empty();  // no order asked for
    make_fronts(graph, *made, free ? minimum_degree(graph) : order,
                free ? std::vector<char>(pattern->order, 0) : paired);
    symbolic_factorization(graph, *made);
    std::lock_guard<std::mutex> lock(guard);
    kept.push_front(made);
    size_t entries = 0, number = 0;
    for (auto it = kept.begin(); it != kept.end();) {
        entries += (*it)->pattern->row.size();
        it = ++number > 1 && (number > KEPT || entries > KEPT_ENTRIES) ? kept.erase(it) : std::next(it);
    }
    return made;
}

std::shared_ptr<const Structure> paired_structure(const std::shared_ptr<const Pattern>& pattern,
                                                  const std::vector<int>& partner) {
    const int n = pattern->order;
    std::vector<int> node(n, -1), first;
    for (int i = 0; i < n; ++i) {
        if (node[i] != -1) continue;
        node[i] = static_cast<int>(first.size());
        if (partner[i] != -1) node[partner[i]] = node[i];
        first.push_back(i);
    }
    Pattern joined;
    joined.order = static_cast<int>(first.size());
    for (size_t e = 0; e < pattern->row.size(); ++e) {
        joined.row.push_back(node[pattern->row[e]]);
        joined.column.push_back(node[pattern->column[e]]);
    }
    std::vector<int> order;
    std::vector<char> paired;
    for (int k : minimum_degree(adjacency(joined))) {
        const int i = first[k];
        const bool both = partner[i] != -1;
        order.push_back(i);
        paired.push_back(both);
        if (both) order.push_back(partner[i]), paired.push_back(0);
    }
    return structure_in_order(pattern, order, paired);
}

std::shared_ptr<const Structure> minimum_degree_structure(const std::shared_ptr<const Pattern>& pattern) {
    return structure_in_order(pattern, {}, {});
}

}  // namespace fesd
