// The calling interface of HSL's MA27 as IPOPT uses it, in front of our own factorization.
//
// IPOPT loads the library named by its option `hsllib` and calls ma27id, ma27ad, ma27bd and ma27cd. What analysis and
// factorization produce is kept here; the arrays that the interface passes carry only a ticket to it, and the matrix,
// which stays as it is until it was solved with.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <list>
#include <memory>
#include <mutex>
#include <unordered_map>

#include "factorization.hpp"

namespace {

using fesd::Factorization;

constexpr std::size_t KEPT = 16;  // factorizations alive at a time; the least recently used goes first
constexpr int SINGULAR = 3;       // INFO(1): rank deficient, INFO(2) is the rank
constexpr int BAD_TICKET = -7;
constexpr int STOP_EARLY = 29;    // of ICNTL, set by ma27id: a factorization may end early if the inertia is wrong

std::mutex guard;
std::unordered_map<int, std::shared_ptr<Factorization>> kept;
std::list<int> recent;
int issued = 0;

int keep(std::shared_ptr<Factorization> factorization) {
    std::lock_guard<std::mutex> lock(guard);
    int ticket = ++issued;
    kept[ticket] = std::move(factorization);
    recent.push_back(ticket);
    if (recent.size() > KEPT) {
        kept.erase(recent.front());
        recent.pop_front();
    }
    return ticket;
}

std::shared_ptr<Factorization> find(int ticket) {
    std::lock_guard<std::mutex> lock(guard);
    auto entry = kept.find(ticket);
    if (entry == kept.end()) return nullptr;
    recent.splice(recent.end(), recent, std::find(recent.begin(), recent.end(), ticket));
    return entry->second;
}

#ifdef KKT_DUMP
// Writes one of KKT_EVERY systems that are factorized into the folder KKT_FOLDER (variables of the environment),
// binary: n, nz, rows, columns, values, threshold.
void dump(int n, int nz, const int* row, const int* column, const double* value, double threshold) {
    static int number = 0;
    if (number++ % std::atoi(std::getenv("KKT_EVERY"))) return;
    char name[512];
    std::snprintf(name, sizeof name, "%s/%06d.kkt", std::getenv("KKT_FOLDER"), number);
    if (std::FILE* file = std::fopen(name, "wb")) {
        std::fwrite(&n, sizeof n, 1, file);
        std::fwrite(&nz, sizeof nz, 1, file);
        std::fwrite(row, sizeof *row, nz, file);
        std::fwrite(column, sizeof *column, nz, file);
        std::fwrite(value, sizeof *value, nz, file);
        std::fwrite(&threshold, sizeof threshold, 1, file);
        std::fclose(file);
    }
}
#endif

void clear(int* info) { std::fill(info, info + 20, 0); }

}  // namespace

extern "C" {

void ma27id_(int* icntl, double* cntl) {
    std::fill(icntl, icntl + 30, 0);
    std::fill(cntl, cntl + 5, 0.0);
    cntl[0] = 0.1;
    icntl[STOP_EARLY] = 1;
}

void ma27ad_(int* n, int* nz, const int* row, const int* column, int*, int*, int* ikeep, int*, int* nsteps, int*,
             int*, double*, int* info, double* ops) {
    clear(info);
    ikeep[0] = keep(std::make_shared<Factorization>(*n, *nz, row, column));
    *nsteps = 1;
    *ops = 0.0;
    info[4] = *nz + 1;  // what IPOPT allocates for the values ...
    info[5] = 16;       // ... and for the indices: nothing is kept there but the ticket
}

void ma27bd_([[maybe_unused]] int* n, [[maybe_unused]] int* nz, [[maybe_unused]] const int* row,
             [[maybe_unused]] const int* column, double* a, int*, int* iw, int*, int* ikeep, int*, int* maxfrt, int*,
             int* icntl, double* cntl, int* info) {
    clear(info);
    *maxfrt = 1;
    auto factorization = find(ikeep[0]);
    if (!factorization) {
        info[0] = BAD_TICKET;
        return;
    }
#ifdef KKT_DUMP
    dump(*n, *nz, row, column, a, cntl[0]);
#endif
    int rank = factorization->factorize(a, cntl[0], icntl && icntl[STOP_EARLY]);
    iw[0] = ikeep[0];
    info[13] = 0;
    info[14] = factorization->negative();
    if (rank < factorization->order()) {
        info[0] = SINGULAR;
        info[1] = rank;
    }
}

void ma27cd_(int*, double* a, int*, int* iw, int*, double*, int*, double* rhs, int*, int*, int*, double*) {
    if (auto factorization = find(iw[0])) factorization->solve(rhs, a);
}

}  // extern "C"
