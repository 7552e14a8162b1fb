// Multifrontal factorization P S A S P^T = L D L^T of sparse symmetric indefinite matrices.
//
// D has pivots of order 1 and 2, chosen inside each front by the threshold test of Duff and Reid (ACM TOMS 9, 1983); a
// column without an acceptable pivot is passed on to the parent front. S is a diagonal scaling.
#pragma once

#include <vector>

namespace fesd {

struct Front {
    int first = 0;                  // first of its own columns in elimination order
    int columns = 0;                // number of its own columns
    int parent = -1;
    std::vector<int> rows;          // rows below its own columns, in elimination order
    std::vector<int> in_parent;     // where these rows are in the parent
    std::vector<int> children;
};

// What a front became: its pivots and what lies below them.
struct Factor {
    int order = 0;                  // order of the front, delayed columns of the children included
    int pivots = 0;                 // columns eliminated here
    std::vector<int> index;         // elimination-order index of every row of the front, pivots first
    std::vector<double> lower;      // order x pivots by columns, unit lower trapezoid
    std::vector<double> diagonal;   // D: entry (k, k)
    std::vector<double> coupling;   // D: entry (k + 1, k), zero unless k begins a pivot of order 2
};

class Factorization {
public:
    // Pattern of one triangle (or both) of a symmetric matrix, indices from 1; duplicates are added up.
    Factorization(int order, int entries, const int* row, const int* column);

    // Factorizes values in the order of the pattern's entries.
    // Returns the rank found; less than the order if singular.
    int factorize(const double* value, double threshold);

    // Solves A x = b in place.
    void solve(double* x);

    int order() const { return order_; }
    int negative() const { return negative_; }
    int two_by_two() const { return two_by_two_; }
    int delayed() const { return delayed_; }
    long long factor_entries() const { return factor_entries_; }
    double flops() const { return flops_; }

private:
    void analyse();
    void place_entries();
    void build_fronts(const std::vector<int>& colptr, const std::vector<int>& rowind);
    void scale(const double* value);
    int eliminate(Factor& factor, int summed, double threshold);

    int order_, entries_;
    std::vector<int> row_, column_;                 // pattern, from 0
    std::vector<int> permutation_, inverse_;        // elimination order -> variable, variable -> elimination order
    std::vector<int> place_row_, place_column_;     // of every entry, in elimination order, row >= column
    std::vector<int> by_front_, front_begin_;       // entries sorted by the front that takes them
    std::vector<int> local_row_, local_column_;     // where they go in it, in this order
    std::vector<Front> fronts_;
    std::vector<int> front_of_;
    std::vector<Factor> factors_;
    std::vector<double> scaling_, values_, work_;
    std::vector<double> scratch_, weighted_;        // of the elimination of a front
    std::vector<double> front_;                     // the matrix of the front being eliminated
    std::vector<std::vector<double>> contribution_; // by front: what is left for its parent
    std::vector<int> place_;                        // where the rows of a child are in its parent
    int negative_ = 0, two_by_two_ = 0, delayed_ = 0;
    long long factor_entries_ = 0;
    double flops_ = 0.0;
};

}  // namespace fesd
