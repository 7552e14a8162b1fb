// Multifrontal factorization P S A S P^T = L D L^T of sparse symmetric indefinite matrices.
//
// D has pivots of order 1 and 2, chosen inside each front by the threshold test of Duff and Reid (ACM TOMS 9, 1983); a
// column without an acceptable pivot is delayed to the parent front. S is a diagonal scaling. A front of order m has
// fully summed columns, its own and the delayed ones of its children, which it eliminates if it can; what remains, the
// contribution block, is added to the parent's front (extend-add: Duff and Reid; Liu, SIAM Review 34, 1992).
#pragma once

#include <memory>
#include <vector>

#include "structure.hpp"

namespace fesd {

// What a front became: its pivots, its part of L and its contribution block.
struct Factor {
    int order = 0;             // order of the front, delayed columns of the children included
    int pivots = 0;            // columns eliminated here
    int delayed = 0;           // fully summed columns without an acceptable pivot, left to the parent
    int negative = 0;          // negative eigenvalues of all that was eliminated in this front and below it ...
    int constraints = 0;       // ... and how many of the eliminated were constraints
    int first = 0;             // number of its first pivot
    std::size_t index = 0;     // where its rows begin in index_, pivots first
    std::size_t lower = 0;     // where its part of L begins in lower_: what is below the diagonal, by columns
    std::size_t contribution = 0;    // where its contribution block begins on its stack, delayed columns first
    int contribution_leading = 0;    // leading dimension of the block
};

class Factorization {
public:
    // Pattern of one triangle (or both) of a symmetric matrix, indices from 1; duplicates are added up.
    Factorization(int order, int entries, const int* row, const int* column);

    // Factorizes values in the order of the pattern's entries.
    // Returns the rank found; less than the order if singular, and 0 if it would take far too long to tell. With `stop`
    // it may end as soon as the number of negative eigenvalues is known to be larger than that of the constraints;
    // negative() then is the smallest such number, and solve() begins with the whole factorization.
    int factorize(const double* value, double threshold, bool stop = false);

    // Solves A x = b in place; `value` is what was factorized last.
    void solve(double* x, const double* value);

    // Lets all further factorizations have one structure, chosen for the pivots of order 2 of the last one: matrices of a
    // loop in real time are alike, and have no time for another analysis.
    void settle();

    int order() const { return order_; }
    int negative() const { return negative_; }

private:
    void adopt(std::shared_ptr<const Structure> structure);
    void reorder();
    int factorize_once(const double* value, double threshold, bool stop, double budget);
    void choose_structure();
    void start_over();
    void count_operations();
    void scale(const double* value);
    void eliminate(Factor& factor, int fully_summed, double threshold);
    bool too_many_negative(const Front& front, const Factor& factor);
    void form_contribution_block(const Front& front, int number, int fully_summed, int inherited,
                                 std::size_t (&top)[2]);
    const int* relative_indices(const Front& child, const Factor& factor, int inherited, int& inherited_before);

    int order_;
    int constraints_ = 0;                   // rows at the end that are not coupled among themselves
    std::vector<int> constraint_diagonal_;  // entries of the pattern on their diagonal
    std::vector<char> constraint_;          // whether a row is one of them, in elimination order
    bool wrong_inertia_solved_ = false;     // a system was solved with not one negative eigenvalue for each constraint
    bool may_stop_ = false;                 // a system was solved, and none of them with such an inertia
    bool stopped_ = false;                  // the last factorization ended early
    bool given_up_ = false;                 // the last factorization was given up
    bool settled_ = false;                  // the structure stays
    double threshold_ = 0.0;
    std::shared_ptr<const Pattern> pattern_;
    std::shared_ptr<const Structure> structure_;
    int reorderings_ = 0;                   // how often the structure was adapted to the pivots of a factorization
    double least_operations_ = 0.0;         // of a factorization, without factors of two and three
    double excess_ = 0.0;                   // operations beyond those since the structure was chosen
    double operations_ = 0.0;               // of the last factorization
    double unadapted_operations_ = 0.0;     // of the last one whose structure was not adapted to pivots
    bool adapting_pays_ = true;             // whether a structure adapted to the pivots was no dearer than that
    std::vector<Factor> factors_;
    std::vector<double> schur_;
    Memory<int> index_;                     // rows of all fronts, in elimination order of the structure
    Memory<double> lower_;                  // L of all fronts
    std::vector<double> diagonal_;          // D: entries (k, k) by number of the pivot ...
    std::vector<double> coupling_;          // ... and (k + 1, k), zero for pivots of order 1
    std::vector<double> scaling_, work_;    // in elimination order
    bool scaled_ = false;                   // for the matrix that comes next
    Memory<double> panel_;                  // the fully summed columns of the front being eliminated
    Memory<double> weighted_;               // L D of the front being eliminated
    Memory<double> dense_;                  // a right side's part in a front
    Memory<double> stack_[2];               // contribution blocks of fronts of even and odd level
    std::vector<int> positions_;            // of rows in a front: those of a child, or the constraints
    int negative_ = 0, delayed_ = 0;
};

}  // namespace fesd
