/*
 * The functions of an NLP that is a sum of blocks, each block being many copies of a few small functions.
 *
 * tables.h, made for each NLP, names the functions of the blocks (made by lanes.py) and says where their inputs and
 * outputs belong. The interface to them is what CasADi's `external` asks for.
 */
#include <stddef.h>
#include <stdint.h>

#include "lanes.h"

typedef long long casadi_int;
typedef void stage(const lanes *restrict in, lanes *restrict out, lanes *restrict work);

/* Indices of all copies: copy k has pattern[which[k]][0..entries) + shift[k]. */
typedef struct {
    int entries;
    const int *pattern, *which, *shift;
} places;

enum { COST, ROWS, GRADIENT, JACOBIAN, HESSIAN, KINDS };

typedef struct {
    int copies, variables, parameters, rows, first_row;
    const double *parameter; /* copies x parameters */
    places index;            /* local variables among x */
    stage *function[KINDS];
    int size[KINDS];
    places at[KINDS];                      /* outputs among the entries of the result; none for the cost */
    const int *row[KINDS], *column[KINDS]; /* of Jacobian and Hessian, in the block's own rows and variables */
} block;

#include "tables.h"

/* tables.h defines: BLOCKS, blocks[], VARIABLES, ROWS_IN_ALL, JACOBIAN_NONZEROS, HESSIAN_NONZEROS, JACOBIAN_ADDS,
   HESSIAN_ADDS, WORK (lanes for in, out and work of any function), SLACKS, slack_level[] (the sigma of
   each slack variable). */

static double *copied(const double *from, int count, double *to)
{
    for (int i = 0; i < count; ++i, to += LANES)
        *to = from ? from[i] : 0.0; /* CasADi passes no pointer for zeros */
    return to;
}

/* The inputs of LANES copies from `copy` on: variables, parameters, sigmas, weight of the cost, multipliers. */
static void gather(const block *b, int kind, int copy, int valid, const double *const *arg, double *in)
{
    for (int lane = 0; lane < LANES; ++lane) {
        const int k = copy + (lane < valid ? lane : 0), shift = b->index.shift[k];
        const int *place = b->index.pattern + b->index.which[k] * b->index.entries;
        double *to = in + lane;
        for (int i = 0; i < b->variables; ++i, to += LANES)
            *to = arg[0] ? arg[0][place[i] + shift] : 0.0;
        to = copied(b->parameter + k * b->parameters, b->parameters, to);
        to = copied(arg[1], 2, to);
        if (kind == HESSIAN) {
            to = copied(arg[2], 1, to);
            copied(arg[3] ? arg[3] + b->first_row + k * b->rows : 0, b->rows, to);
        }
    }
}

/* Write the outputs of one copy to their places in the result or, with add, add them there. */
static void scatter(const block *b, int kind, int add, int k, const double *out, double *result)
{
    const places *at = &b->at[kind];
    const int size = b->size[kind], *place = at->pattern + at->which[k] * at->entries;
    double *to = result + at->shift[k];
    if (add)
        for (int i = 0; i < size; ++i)
            to[place[i]] += out[i * LANES];
    else
        for (int i = 0; i < size; ++i)
            to[place[i]] = out[i * LANES];
}

/* One function of all copies of all blocks. */
static void evaluate(int kind, int add, const double *const *arg, double *result, double *memory)
{
    lanes *in = (lanes *)(((uintptr_t)memory + sizeof(lanes) - 1) / sizeof(lanes) * sizeof(lanes));
    for (const block *b = blocks; b < blocks + BLOCKS; ++b) {
        lanes *out = in + b->variables + b->parameters + 3 + b->rows, *work = out + b->size[kind];
        double sum = 0.0;
        if (!b->size[kind])
            continue;
        for (int copy = 0; copy < b->copies; copy += LANES) {
            const int valid = b->copies - copy < LANES ? b->copies - copy : LANES;
            gather(b, kind, copy, valid, arg, (double *)in);
            b->function[kind](in, out, work);
            for (int lane = 0; lane < valid; ++lane)
                if (kind == COST)
                    sum += out[0][lane];
                else
                    scatter(b, kind, add, copy + lane, (const double *)out + lane, result);
        }
        if (kind == COST)
            *result += sum;
    }
#ifdef __AVX__
    /* Otherwise older vector code, as in CasADi and IPOPT, runs slower from here on. Compilers do this by themselves
       only where they optimise more than is good for the code of the blocks. */
    __builtin_ia32_vzeroupper();
#endif
}

static double slack_penalty(const double *sigma, int slack)
{
    return 1.0 / (sigma ? sigma[slack_level[slack]] : 0.0);
}

static void clear(double *values, int count)
{
    for (int i = 0; i < count; ++i)
        values[i] = 0.0;
}

static void cost(const double *const *arg, double *result, double *memory)
{
    double sum = 0.0;
    *result = 0.0;
    evaluate(COST, 0, arg, result, memory);
    for (int i = 0; i < SLACKS; ++i)
        sum += slack_penalty(arg[1], i) * (arg[0] ? arg[0][VARIABLES - SLACKS + i] : 0.0);
    *result += sum;
}

/* The sparsity of a matrix as CasADi reads it: rows, columns, first entry of each column, row of each entry. */
static const casadi_int *sparsity(int kind, casadi_int rows, casadi_int nonzeros, casadi_int *compressed)
{
    casadi_int *first = compressed + 2, *row = first + VARIABLES + 1;
    compressed[0] = rows;
    compressed[1] = VARIABLES;
    for (int i = 0; i <= VARIABLES; ++i)
        first[i] = nonzeros;
    for (const block *b = blocks; b < blocks + BLOCKS; ++b)
        for (int k = 0; b->size[kind] && k < b->copies; ++k) {
            const int *place = b->at[kind].pattern + b->at[kind].which[k] * b->at[kind].entries;
            const int *index = b->index.pattern + b->index.which[k] * b->index.entries;
            for (int i = 0; i < b->size[kind]; ++i) {
                const int at = place[i] + b->at[kind].shift[k], shift = b->index.shift[k];
                int r = b->row[kind][i], c = index[b->column[kind][i]] + shift;
                if (kind == JACOBIAN) {
                    r += b->first_row + k * b->rows;
                } else {
                    r = index[r] + shift;
                    if (r > c) {
                        const int larger = r;
                        r = c;
                        c = larger;
                    }
                }
                row[at] = r;
                if (at < first[c])
                    first[c] = at;
            }
        }
    for (int i = VARIABLES; i-- > 0;) /* a column without entries begins where the next one does */
        if (first[i] > first[i + 1])
            first[i] = first[i + 1];
    return compressed;
}

static casadi_int jacobian_sparsity[3 + VARIABLES + JACOBIAN_NONZEROS];
static casadi_int hessian_sparsity[3 + VARIABLES + HESSIAN_NONZEROS];

static const casadi_int scalar[] = {1, 1, 1}, of_x[] = {VARIABLES, 1, 1}, of_p[] = {2, 1, 1},
                        of_g[] = {ROWS_IN_ALL, 1, 1};

static int space(casadi_int *arg, casadi_int *res, casadi_int *iw, casadi_int *w)
{
    *arg = 4;
    *res = 2;
    *iw = 0;
    *w = (WORK + 1) * LANES;
    return 0;
}

#define INTERFACE(name, inputs, outputs)                                                                       \
    casadi_int name##_n_in(void) { return inputs; }                                                            \
    casadi_int name##_n_out(void) { return outputs; }                                                          \
    int name##_work(casadi_int *arg, casadi_int *res, casadi_int *iw, casadi_int *w)                           \
    {                                                                                                          \
        return space(arg, res, iw, w);                                                                         \
    }                                                                                                          \
    const char *name##_name_in(casadi_int i)                                                                   \
    {                                                                                                          \
        return i == 0 ? "x" : i == 1 ? "p" : i == 2 ? "lam_f" : "lam_g";                                       \
    }                                                                                                          \
    const casadi_int *name##_sparsity_in(casadi_int i)                                                         \
    {                                                                                                          \
        return i == 0 ? of_x : i == 1 ? of_p : i == 2 ? scalar : of_g;                                         \
    }

INTERFACE(nlp, 2, 2)
const char *nlp_name_out(casadi_int i) { return i == 0 ? "f" : "g"; }
const casadi_int *nlp_sparsity_out(casadi_int i) { return i == 0 ? scalar : of_g; }
int nlp(const double **arg, double **res, casadi_int *iw, double *w, int mem)
{
    (void)iw, (void)mem;
    if (res[0])
        cost(arg, res[0], w);
    if (res[1])
        evaluate(ROWS, 0, arg, res[1], w);
    return 0;
}

INTERFACE(nlp_grad_f, 2, 2)
const char *nlp_grad_f_name_out(casadi_int i) { return i == 0 ? "f" : "grad_f_x"; }
const casadi_int *nlp_grad_f_sparsity_out(casadi_int i) { return i == 0 ? scalar : of_x; }
int nlp_grad_f(const double **arg, double **res, casadi_int *iw, double *w, int mem)
{
    (void)iw, (void)mem;
    if (res[0])
        cost(arg, res[0], w);
    if (res[1]) {
        clear(res[1], VARIABLES);
        evaluate(GRADIENT, 1, arg, res[1], w);
        for (int i = 0; i < SLACKS; ++i)
            res[1][VARIABLES - SLACKS + i] += slack_penalty(arg[1], i);
    }
    return 0;
}

INTERFACE(nlp_jac_g, 2, 2)
const char *nlp_jac_g_name_out(casadi_int i) { return i == 0 ? "g" : "jac_g_x"; }
const casadi_int *nlp_jac_g_sparsity_out(casadi_int i)
{
    return i == 0 ? of_g : sparsity(JACOBIAN, ROWS_IN_ALL, JACOBIAN_NONZEROS, jacobian_sparsity);
}
int nlp_jac_g(const double **arg, double **res, casadi_int *iw, double *w, int mem)
{
    (void)iw, (void)mem;
    if (res[0])
        evaluate(ROWS, 0, arg, res[0], w);
    if (res[1]) {
        if (JACOBIAN_ADDS)
            clear(res[1], JACOBIAN_NONZEROS);
        evaluate(JACOBIAN, JACOBIAN_ADDS, arg, res[1], w);
    }
    return 0;
}

INTERFACE(nlp_hess_l, 4, 1)
const char *nlp_hess_l_name_out(casadi_int i) { return i == 0 ? "hess_gamma_x_x" : 0; }
const casadi_int *nlp_hess_l_sparsity_out(casadi_int i)
{
    return i == 0 ? sparsity(HESSIAN, VARIABLES, HESSIAN_NONZEROS, hessian_sparsity) : 0;
}
int nlp_hess_l(const double **arg, double **res, casadi_int *iw, double *w, int mem)
{
    (void)iw, (void)mem;
    if (res[0]) {
        if (HESSIAN_ADDS)
            clear(res[0], HESSIAN_NONZEROS);
        evaluate(HESSIAN, HESSIAN_ADDS, arg, res[0], w);
    }
    return 0;
}
