// Systems that are factorized again and again in a loop: whoever makes one holds it until it is ended.
#include "factorization.hpp"

using fesd::Factorization;

extern "C" {

// Pattern of one triangle, indices from 1.
void* kkt_begin(int order, int entries, const int* row, const int* column) {
    return new Factorization(order, entries, row, column);
}

void kkt_end(void* system) { delete static_cast<Factorization*>(system); }

// Returns the number of negative eigenvalues, -1 for a singular matrix.
int kkt_factorize(void* system, const double* value, double threshold) {
    auto* own = static_cast<Factorization*>(system);
    return own->factorize(value, threshold) < own->order() ? -1 : own->negative();
}

void kkt_settle(void* system) { static_cast<Factorization*>(system)->settle(); }

// `value` is what was factorized last.
void kkt_solve(void* system, const double* value, double* x) { static_cast<Factorization*>(system)->solve(x, value); }

}  // extern "C"
