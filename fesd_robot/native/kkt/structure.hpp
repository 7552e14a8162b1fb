// What depends on the pattern and the elimination order alone: fronts, and where every entry goes.
#pragma once

#include <memory>
#include <vector>

#include "memory.hpp"

namespace fesd {

// One triangle (or both) of a symmetric matrix by entries, indices from 0; duplicates are added up.
struct Pattern {
    int order = 0;
    std::vector<int> row, column;
};

// Of the assembly tree: the columns that are eliminated together, and the rows below them.
struct Front {
    int first = 0;        // first of its own columns in elimination order
    int columns = 0;      // number of its own columns
    int rows = 0;         // number of rows below them, those of its contribution block
    int parent = -1;
    int children = 0;     // their number; they are the last unclaimed fronts before this one
    int index_begin = 0;  // in Structure::index: own columns, then the rows below them
    int rows_begin = 0;   // in Structure::relative_index
    int level = 0;        // distance from the root
};

constexpr int PREFETCH_DISTANCE = 64;  // values are fetched so many entries before they are needed

struct Structure {
    std::shared_ptr<const Pattern> pattern;
    std::vector<int> requested;           // the order and pairs it was made for
    std::vector<char> paired;
    std::vector<int> permutation;         // elimination order -> variable
    std::vector<Front> fronts;            // children before parents
    Memory<int> index;                    // of all fronts: own columns and rows, in elimination order
    Memory<int> relative_index;           // of all fronts: where the rows are in the parent
    std::vector<int> child_begin, child;  // children by front
    std::vector<int> entry_begin;         // by column in elimination order
    Memory<int> entry;                    // entry of the pattern; PREFETCH_DISTANCE more than there are
    Memory<int> entry_place;              // where its row is in the front
    std::size_t factor_size = 0;          // entries of L if nothing is delayed
};

// The structure for approximate minimum degree, and for a given order of elimination in which paired[k] keeps columns
// k and k + 1, a pivot of order 2, in one front. Structures are kept, and given out again for the same input.
std::shared_ptr<const Structure> minimum_degree_structure(const std::shared_ptr<const Pattern>& pattern);
std::shared_ptr<const Structure> structure_in_order(const std::shared_ptr<const Pattern>& pattern,
                                                    const std::vector<int>& order, const std::vector<char>& paired);

// The structure for approximate minimum degree of the graph in which a variable and its partner, -1 for none, are one
// node: a pivot of order 2 is known to come, and the order counts what it fills in.
std::shared_ptr<const Structure> paired_structure(const std::shared_ptr<const Pattern>& pattern,
                                                  const std::vector<int>& partner);

}  // namespace fesd
