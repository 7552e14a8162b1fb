/*
 * The functions of an NLP that is a sum of blocks, each block being many copies of a few small functions.
 *
 * A library is one NLP: `nlp_tables` says where the functions of its blocks are (made by lanes.py) and where their
 * inputs and outputs belong, before CasADi's `external`, whose interface this is, asks for anything.
 */
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

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
    int copies, variables, parameters, first_parameter, rows, first_row;
    places index; /* local variables among x */
    stage *function[KINDS];
    int size[KINDS];
    places at[KINDS];                      /* outputs among the entries of the result; none for the cost */
    const int *row[KINDS], *column[KINDS]; /* of Jacobian and Hessian, in the block's own rows and variables */
} block;

static int block_count, variables, rows_in_all, nonzeros[KINDS], adds[KINDS], slacks;
static int work_size;          /* lanes for in, out and work of any function */
static const int *slack_level; /* the sigma of each slack variable */
static block *blocks;
static int *integers;
static casadi_int *jacobian_sparsity, *hessian_sparsity, of_x[] = {0, 1, 1}, of_g[] = {0, 1, 1};
static casadi_int of_p[] = {0, 1, 1};
static const casadi_int scalar[] = {1, 1, 1};

static const int *read_places(const int *next, int copies, places *p)
{
    const int patterns = next[1];
    p->entries = next[0];
    p->pattern = next + 2;
    p->which = p->pattern + patterns * p->entries;
    p->shift = p->which + copies;
    return p->shift + copies;
}

/* Keep the tables of the NLP, in the order in which nlp_compiler.py writes them; 1 if there is no room. */
int nlp_tables(const int *given, size_t count, void *const *functions)
{
    const int *next;
    integers = malloc(count * sizeof(int));
    if (!integers)
        return 1;
    next = memcpy(integers, given, count * sizeof(int));
    block_count = *next++;
    variables = *next++;
    of_p[0] = *next++;
    rows_in_all = *next++;
    work_size = *next++;
    for (int kind = JACOBIAN; kind <= HESSIAN; ++kind) {
        nonzeros[kind] = *next++;
        adds[kind] = *next++;
    }
    slacks = *next++;
    slack_level = next;
    next += slacks;
    blocks = calloc(block_count ? block_count : 1, sizeof(block));
    jacobian_sparsity = malloc((3 + variables + (size_t)nonzeros[JACOBIAN]) * sizeof(casadi_int));
    hessian_sparsity = malloc((3 + variables + (size_t)nonzeros[HESSIAN]) * sizeof(casadi_int));
    if (!blocks || !jacobian_sparsity || !hessian_sparsity)
        return 1;
    of_x[0] = variables;
    of_g[0] = rows_in_all;
    for (block *b = blocks; b < blocks + block_count; ++b) {
        b->copies = *next++;
        b->variables = *next++;
        b->parameters = *next++;
        b->first_parameter = *next++;
        b->rows = *next++;
        b->first_row = *next++;
        next = read_places(next, b->copies, &b->index);
        for (int kind = 0; kind < KINDS; ++kind) {
            b->size[kind] = *next++;
            if (!b->size[kind])
                continue;
            memcpy(&b->function[kind], functions++, sizeof(void *));
            if (kind == COST)
                continue;
            next = read_places(next, b->copies, &b->at[kind]);
            if (kind >= JACOBIAN) {
                b->row[kind] = next;
                b->column[kind] = next + b->size[kind];
                next += 2 * b->size[kind];
            }
        }
    }
    return 0;
}

__attribute__((destructor)) static void forget(void)
{
    free(integers);
    free(blocks);
    free(jacobian_sparsity);
    free(hessian_sparsity);
}

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
        to = copied(arg[1] ? arg[1] + b->first_parameter + k * b->parameters : 0, b->parameters, to);
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
    for (const block *b = blocks; b < blocks + block_count; ++b) {
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
    for (int i = 0; i < slacks; ++i)
        sum += slack_penalty(arg[1], i) * (arg[0] ? arg[0][variables - slacks + i] : 0.0);
    *result += sum;
}

/* The sparsity of a matrix as CasADi reads it: rows, columns, first entry of each column, row of each entry. */
static const casadi_int *sparsity(int kind, casadi_int rows, casadi_int *compressed)
{
    casadi_int *first = compressed + 2, *row = first + variables + 1;
    compressed[0] = rows;
    compressed[1] = variables;
    for (int i = 0; i <= variables; ++i)
        first[i] = nonzeros[kind];
    for (const block *b = blocks; b < blocks + block_count; ++b)
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
    for (int i = variables; i-- > 0;) /* a column without entries begins where the next one does */
        if (first[i] > first[i + 1])
            first[i] = first[i + 1];
    return compressed;
}

static int space(casadi_int *arg, casadi_int *res, casadi_int *iw, casadi_int *w)
{
    *arg = 4;
    *res = 2;
    *iw = 0;
    *w = (work_size + 1) * LANES;
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
        clear(res[1], variables);
        evaluate(GRADIENT, 1, arg, res[1], w);
        for (int i = 0; i < slacks; ++i)
            res[1][variables - slacks + i] += slack_penalty(arg[1], i);
    }
    return 0;
}

INTERFACE(nlp_jac_g, 2, 2)
const char *nlp_jac_g_name_out(casadi_int i) { return i == 0 ? "g" : "jac_g_x"; }
const casadi_int *nlp_jac_g_sparsity_out(casadi_int i)
{
    return i == 0 ? of_g : sparsity(JACOBIAN, rows_in_all, jacobian_sparsity);
}
int nlp_jac_g(const double **arg, double **res, casadi_int *iw, double *w, int mem)
{
    (void)iw, (void)mem;
    if (res[0])
        evaluate(ROWS, 0, arg, res[0], w);
    if (res[1]) {
        if (adds[JACOBIAN])
            clear(res[1], nonzeros[JACOBIAN]);
        evaluate(JACOBIAN, adds[JACOBIAN], arg, res[1], w);
    }
    return 0;
}

INTERFACE(nlp_hess_l, 4, 1)
const char *nlp_hess_l_name_out(casadi_int i) { return i == 0 ? "hess_gamma_x_x" : 0; }
const casadi_int *nlp_hess_l_sparsity_out(casadi_int i)
{
    return i == 0 ? sparsity(HESSIAN, variables, hessian_sparsity) : 0;
}
int nlp_hess_l(const double **arg, double **res, casadi_int *iw, double *w, int mem)
{
    (void)iw, (void)mem;
    if (res[0]) {
        if (adds[HESSIAN])
            clear(res[0], nonzeros[HESSIAN]);
        evaluate(HESSIAN, adds[HESSIAN], arg, res[0], w);
    }
    return 0;
}
