// Multifrontal factorization P S A S P^T = L D L^T of sparse symmetric indefinite matrices.
//
// D has pivots of order 1 and 2, chosen inside each front by the threshold test of Duff and Reid (ACM TOMS 9, 1983); a
// column without an acceptable pivot is passed on to the parent front. S is a diagonal scaling.
#pragma once

#include <memory>
#include <vector>

#include "structure.hpp"

namespace fesd {

// What a front became: its pivots and what lies below them.
struct Factor {
    int order = 0;             // order of the front, delayed columns of the children included
    int pivots = 0;            // columns eliminated here
    int delayed = 0;           // columns passed on to the parent
    int negative = 0;          // negative eigenvalues of all that was eliminated in this front and below it ...
    int constraints = 0;       // ... and how many of the eliminated were constraints
    int first = 0;             // number of its first pivot
    std::size_t index = 0;     // where its rows begin in index_, pivots first
    std::size_t lower = 0;     // where its part of L begins in lower_: what is below the diagonal, by columns
    // What it leaves for its parent, delayed columns first.
    std::size_t rest = 0;      // where that begins on its stack
    int rest_leading = 0;      // leading dimension
};

class Factorization {
public:
    // Pattern of one triangle (or both) of a symmetric matrix, indices from 1; duplicates are added up.
    Factorization(int order, int entries, const int* row, const int* column);

    // Factorizes values in the order of the pattern's entries.
    // Returns the rank found; less than the order if singular. With `stop` it may end as soon as the number of negative
    // eigenvalues is known to be larger than that of the constraints; negative() then is the smallest such number, and
    // solve() begins with the whole factorization.
    int factorize(const double* value, double threshold, bool stop = false);

    // Solves A x = b in place; `value` is what was factorized last.
    void solve(double* x, const double* value);

    int order() const { return order_; }
    int negative() const { return negative_; }

private:
    void adopt(std::shared_ptr<const Structure> structure);
    void learn();
    void scale(const double* value);
    void eliminate(Factor& factor, int summed, double threshold);
    bool too_many_negative(const Front& front, const Factor& factor);
    void pass_on(const Front& front, int number, int summed, int late, std::size_t (&top)[2]);
    const int* places(const Front& child, const Factor& factor, int late, int& arrived);

    int order_;
    int constraints_ = 0;                           // rows at the end that are not coupled among themselves
    std::vector<int> corner_;                       // their diagonal entries
    std::vector<char> constraint_;                  // whether a row is one of them, in elimination order
    bool trusted_ = false, doubted_ = false;        // whether all that was solved had so many negative eigenvalues
    bool stopped_ = false;                          // the last factorization ended early
    double threshold_ = 0.0;
    std::shared_ptr<const Pattern> pattern_;
    std::shared_ptr<const Structure> structure_;
    int learned_ = 0;                               // how often the structure was adapted to the pivots found
    std::vector<Factor> factors_;
    std::vector<double> schur_;
    Memory<int> index_;                        // rows of all fronts, in elimination order of the structure
    Memory<double> lower_;                     // L of all fronts
    std::vector<double> diagonal_, coupling_;       // D: entries (k, k) and (k + 1, k) by number of the pivot
    std::vector<double> scaling_, work_;            // in elimination order
    bool scaled_ = false;                           // for the matrix that comes next
    Memory<double> panel_;                          // the columns of the front being eliminated
    Memory<double> weighted_;                  // L D of the front being eliminated
    Memory<double> dense_;                     // a right side's part in a front
    Memory<double> stack_[2];                  // what fronts of even and odd level have left
    std::vector<int> place_;                        // where the rows of a child are in its parent
    int negative_ = 0, delayed_ = 0;
};

}  // namespace fesd
