/* The candle of the experiment that the project repeats: 59,704 triangles, unshared (A.
 * Tomaszewska, K. Stefanowski, "GPU based subsurface scattering effect"; their model is not to be
 * had, its number of vertices, 179,112, is).
 *
 * A closed shell made of half-planes about the y axis. In each of them runs one profile without
 * crossings, from the middle of the base outward, up the side, over the rim, down the inner wall
 * and along the molten hollow to the middle; so the whole cannot cut itself, whatever the
 * displacements are:
 *
 *      side      a slightly uneven cylinder, a foot of wax that has run down, and drips
 *      drip      a ridge that sets out at the rim, wanders a little, and ends in a drop
 *      rim       half an ellipse of varying height, width and place; in a notch wax ran over
 *      hollow    a quarter of an ellipse, from the inner edge of the rim to the floor, and a dish
 *
 * Rows of vertices lie along the profile, close where it bends: pieces have rows of their own, and
 * on the side they gather around the drops. Columns are 272 = 4 * 68, and 136 and 68 towards the
 * two centres, where 272 would be slivers. With k = 68, a band between two rows of 4k columns has
 * 8k triangles, of 2k 4k, of k 2k; a step from 4k to 2k has 6k, from 2k to k 3k; a fan has k. The
 * numbers of bands below make 878 k = 59,704.
 *
 * Noise is made of integer hashes, and all else of + - * / and the square root, which every
 * machine rounds alike: the same bytes everywhere. */
#include <diaphan/mesh.h>

#include "core/fail.h"
#include "core/memory.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define COLUMNS 272
#define TRIANGLES 59704

/* Bands of each piece, and how many columns they have. */
enum {
    BASE_INNER = 1, /* 68  */
    BASE_OUTER = 2, /* 136 */
    EDGE = 5,       /* 272, and so on until FLOOR_OUTER */
    SIDE = 59,
    RIM = 18,
    WALL = 16,
    FLOOR_OUTER = 14, /* 136 */
    FLOOR_INNER = 4,  /* 68  */
};

_Static_assert(8 * (EDGE + SIDE + RIM + WALL) + 4 * (BASE_OUTER + FLOOR_OUTER) +
                       2 * (BASE_INNER + FLOOR_INNER) + 2 * (6 + 3 + 1) ==
                   TRIANGLES / 68,
               "the bands do not add up");

/* Rows of vertices are numbered from the middle of the base, 0, to that of the hollow, LAST. */
#define LAST                                                                                       \
    (1 + BASE_INNER + 1 + BASE_OUTER + 1 + EDGE + SIDE + RIM + WALL + 1 + FLOOR_OUTER + 1 +        \
     FLOOR_INNER + 1)
#define POSITIONS (TRIANGLES / 2 + 2)

/* Angles are in turns, lengths in units before the last scaling. */
struct drip {
    double angle, width; /* of the ridge, half a width */
    double end;          /* height where the drop ends */
    double ridge, drop;  /* how far they stand out     */
    double wander;       /* sideways, at most          */
};

static const struct drip drips[] = {
    /* under the notch: one that has reached the ground, and its companions */
    {0.050, 0.034, 0.020, 0.040, 0.020, 0.010},
    {0.098, 0.024, 0.760, 0.034, 0.026, 0.008},
    {0.012, 0.020, 1.120, 0.030, 0.024, 0.006},
    /* elsewhere */
    {0.170, 0.017, 1.420, 0.024, 0.022, 0.006},
    {0.262, 0.026, 0.480, 0.032, 0.028, 0.014},
    {0.318, 0.018, 1.230, 0.026, 0.022, 0.006},
    {0.410, 0.021, 0.930, 0.028, 0.026, 0.010},
    {0.492, 0.030, 0.030, 0.034, 0.018, 0.016},
    {0.548, 0.017, 1.340, 0.026, 0.021, 0.005},
    {0.640, 0.023, 0.640, 0.030, 0.026, 0.010},
    {0.716, 0.017, 1.500, 0.022, 0.018, 0.004},
    {0.792, 0.027, 0.860, 0.034, 0.030, 0.012},
    {0.842, 0.018, 1.280, 0.026, 0.021, 0.006},
    {0.922, 0.022, 0.290, 0.030, 0.026, 0.012},
};

#define NDRIP (sizeof drips / sizeof *drips)
#define NOTCH_ANGLE 0.058
#define NOTCH_WIDTH 0.085

/* 0 to 1, from the numbers of a lattice point (the finalizer of MurmurHash3). */
static double lattice(uint32_t seed, uint32_t x, uint32_t y)
{
    uint32_t h = seed * 0x9e3779b9u ^ x * 0x85ebca6bu ^ y * 0xc2b2ae35u;
    h ^= h >> 16;
    h *= 0x85ebca6bu;
    h ^= h >> 13;
    h *= 0xc2b2ae35u;
    h ^= h >> 16;
    return h * (1.0 / 4294967296.0);
}

static double smooth(double t)
{
    return t <= 0 ? 0 : t >= 1 ? 1 : t * t * t * (t * (6 * t - 15) + 10);
}

/* Value noise, -1 to 1, twice differentiable: `cells` of them around the turn, one a unit of y. */
static double noise(uint32_t seed, double turn, uint32_t cells, double y)
{
    double x = (turn - floor(turn)) * cells;
    uint32_t i = (uint32_t)x % cells, next = (i + 1) % cells;
    double row = floor(y), u = smooth(x - floor(x)), v = smooth(y - row);
    uint32_t j = (uint32_t)(int32_t)row;
    double low = lattice(seed, i, j) * (1 - u) + lattice(seed, next, j) * u;
    double high = lattice(seed, i, j + 1) * (1 - u) + lattice(seed, next, j + 1) * u;
    return 2 * (low * (1 - v) + high * v) - 1;
}

/* The way from one angle to another, -1/2 to 1/2 turn. */
static double turn_between(double from, double to)
{
    double d = to - from;
    return d - floor(d + 0.5);
}

/* A bell of height 1 that ends at |x| = 1. */
static double bell(double x)
{
    double p = 1 - x * x;
    return p > 0 ? p * p : 0;
}

/* Everything about one half-plane that does not depend on the height. */
struct section {
    double turn;
    double top;        /* height of the rim     */
    double cap, width; /* its rounding and width */
    double floor;      /* height of the hollow  */
};

static struct section section_at(double turn)
{
    double notch = bell(turn_between(NOTCH_ANGLE, turn) / NOTCH_WIDTH);
    struct section s = {.turn = turn};
    s.top = 2 + 0.035 * noise(1, turn, 7, 0) + 0.018 * noise(2, turn, 17, 0) - 0.17 * notch;
    s.width = 0.092 + 0.022 * noise(3, turn, 6, 0) + 0.010 * noise(4, turn, 13, 0) - 0.02 * notch;
    s.cap = 0.052 + 0.012 * noise(5, turn, 9, 0);
    s.floor = 1.63;
    return s;
}

/* How far a drip stands out of the side. */
static double drip_height(const struct drip *d, const struct section *s, double y)
{
    double above = y - d->end;
    if (above <= 0)
        return 0;
    double wander = d->wander * noise(20 + (uint32_t)(1000 * d->angle), 0, 1, 2.3 * y);
    double swell = 1 + 0.22 * noise(40 + (uint32_t)(1000 * d->angle), 0, 1, 5 * y);
    double drop = bell((above - 0.062) / (above < 0.062 ? 0.09 : 0.19));
    double width = d->width * (0.84 + 0.12 * swell + 0.30 * drop);
    double x = turn_between(d->angle + wander, s->turn) / width;
    double end = above < 0.085 ? 1 - above / 0.085 : 0;
    double p = 1 - x * x - end * end; /* the end is round */
    if (p <= 0)
        return 0;
    double along = d->ridge * swell + d->drop * drop;
    /* towards the rim a drip flattens out into it */
    return along * p * sqrt(sqrt(p)) * (1 - 0.45 * smooth((y - s->top + 0.35) / 0.3));
}

/* The radius of the side at a height. */
static double side_radius(const struct section *s, double y)
{
    double r = 0.425 - 0.012 * y + 0.008 * noise(6, s->turn, 5, 1.7 * y) +
               0.0035 * noise(7, s->turn, 11, 4 * y);
    /* drips that meet flow into each other: a soft maximum */
    double most = 0, rest = 0;
    for (size_t i = 0; i < NDRIP; i++) {
        double h = drip_height(&drips[i], s, y);
        rest += h > most ? most : h;
        most = h > most ? h : most;
    }
    r += most + 0.35 * rest;
    /* the foot, wider where a drip has reached the ground */
    double foot = 0.030 + 0.014 * noise(8, s->turn, 9, 0);
    for (size_t i = 0; i < NDRIP; i++)
        if (drips[i].end < 0.1)
            foot += 0.075 * bell(turn_between(drips[i].angle, s->turn) / 0.085);
    double t = y < 0.19 ? 1 - y / 0.19 : 0;
    r += foot * t * t * t;
    /* the soft edge below the rim bends outward a little */
    double below = (y - s->top + 0.16) / 0.16;
    r += 0.012 * smooth(below) * (1 + noise(9, s->turn, 8, 0));
    return r;
}

/* Where on the side the rows of one section lie: closer near drops. Writes SIDE + 1 heights. */
static void place_side_rows(const struct section *s, double low, double high, double *height)
{
    enum { STEPS = 600 };
    double sum[STEPS + 1] = {0};
    for (int i = 0; i < STEPS; i++) {
        double y = low + (high - low) * (i + 0.5) / STEPS, density = 1;
        for (size_t k = 0; k < NDRIP; k++) {
            const struct drip *d = &drips[k];
            double beside = turn_between(d->angle, s->turn) / (3.2 * d->width);
            density += 2.6 * bell(beside) * bell((y - d->end - 0.055) / 0.16);
        }
        density += 1.5 * bell(y / 0.2);
        sum[i + 1] = sum[i] + density;
    }
    int at = 0;
    for (int row = 0; row <= SIDE; row++) {
        double wanted = sum[STEPS] * row / SIDE;
        while (at < STEPS - 1 && sum[at + 1] < wanted)
            at++;
        double part = (wanted - sum[at]) / (sum[at + 1] - sum[at]);
        height[row] = low + (high - low) * (at + part) / STEPS;
    }
    height[SIDE] = high;
}

/* sin and cos of a number of turns, by their series after a turn has been folded to an eighth. */
static void circle(double turn, double *sine, double *cosine)
{
    const double two_pi = 6.28318530717958647693;
    turn -= floor(turn);
    int quarter = (int)(4 * turn + 0.5);
    double x = two_pi * (turn - quarter / 4.0), square = x * x, s = 0, c = 0;
    for (int n = 17; n >= 1; n -= 2) {
        s = 1 - square / ((n + 1) * (n + 2)) * s;
        c = 1 - square / (n * (n + 1)) * c;
    }
    s *= x;
    *sine = quarter % 4 == 0 ? s : quarter % 4 == 1 ? c : quarter % 4 == 2 ? -s : -c;
    *cosine = quarter % 4 == 0 ? c : quarter % 4 == 1 ? -s : quarter % 4 == 2 ? -c : s;
}

/* The profile of one section: radius and height of every row. */
static void make_profile(const struct section *s, double (*point)[2])
{
    const double edge = 0.024;
    double shoulder = s->top - s->cap, sine, cosine;
    double base = side_radius(s, edge) - edge;
    size_t n = 0;
    point[n][0] = 0, point[n++][1] = 0;
    const int nbase = BASE_INNER + 1 + BASE_OUTER + 1;
    for (int i = 0; i <= nbase; i++) {
        point[n][0] = base * (0.25 + 0.75 * i / nbase), point[n++][1] = 0;
    }
    for (int i = 1; i <= EDGE; i++) {
        circle(0.25 * i / EDGE, &sine, &cosine);
        point[n][0] = base + edge * sine, point[n++][1] = edge * (1 - cosine);
    }
    double height[SIDE + 1];
    place_side_rows(s, edge, shoulder, height);
    for (int i = 1; i <= SIDE; i++)
        point[n][0] = side_radius(s, height[i]), point[n++][1] = height[i];
    double outer = side_radius(s, shoulder);
    /* the inner edge does not follow the drips outside */
    double inner = 0.405 + 0.006 * noise(6, s->turn, 5, 3) - s->width;
    double middle = (outer + inner) / 2, half = (outer - inner) / 2;
    for (int i = 1; i <= RIM; i++) {
        circle(0.5 * i / RIM, &sine, &cosine);
        point[n][0] = middle + half * cosine, point[n++][1] = shoulder + s->cap * sine;
    }
    double foot = inner - 0.15, depth = shoulder - s->floor;
    const int nwall = WALL + 1 + 4; /* with the first bands of the floor: one arc */
    for (int i = 1; i <= nwall; i++) {
        circle(0.25 * i / nwall, &sine, &cosine);
        point[n][0] = foot + (inner - foot) * cosine, point[n++][1] = shoulder - depth * sine;
    }
    const int nfloor = FLOOR_OUTER - 4 + 1 + FLOOR_INNER;
    for (int i = 1; i <= nfloor; i++) {
        double t = 1 - 0.9 * i / nfloor;
        point[n][0] = foot * t, point[n++][1] = s->floor - 0.030 * (1 - t * t) * (1 - t * t);
    }
    point[n][0] = 0, point[n++][1] = s->floor - 0.030;
}

/* How many columns a row has. */
static uint32_t columns_of(int row)
{
    int up = row, down = LAST - row;
    if (up == 0 || down == 0)
        return 1;
    if (up <= 1 + BASE_INNER || down <= 1 + FLOOR_INNER)
        return COLUMNS / 4;
    if (up <= 2 + BASE_INNER + BASE_OUTER || down <= 2 + FLOOR_INNER + FLOOR_OUTER)
        return COLUMNS / 2;
    return COLUMNS;
}

static uint32_t *put(uint32_t *out, uint32_t a, uint32_t b, uint32_t c)
{
    out[0] = a;
    out[1] = b;
    out[2] = c;
    return out + 3;
}

static double distance(const float *position, uint32_t a, uint32_t b)
{
    double sum = 0;
    for (int k = 0; k < 3; k++) {
        double d = (double)position[3 * a + k] - position[3 * b + k];
        sum += d * d;
    }
    return sum;
}

/* The triangles between a row of `n` columns that begins at position `a` and one of `m` at `b`. */
static uint32_t *connect(const float *position, uint32_t a, uint32_t n, uint32_t b, uint32_t m,
                         uint32_t *out)
{
    uint32_t most = n > m ? n : m;
    for (uint32_t j = 0; j < most; j++) {
        uint32_t next = (j + 1) % most;
        if (n == 1) {
            out = put(out, a, b + next, b + j);
        } else if (m == 1) {
            out = put(out, a + j, a + next, b);
        } else if (n == m) { /* the shorter diagonal */
            uint32_t p = a + j, q = a + next, r = b + next, s = b + j;
            if (distance(position, p, r) <= distance(position, q, s))
                out = put(put(out, p, q, r), p, r, s);
            else
                out = put(put(out, p, q, s), q, r, s);
        } else if (n < m) {
            uint32_t p = a + j / 2, q = a + (j / 2 + 1) % n, s = b + j;
            out = put(out, j % 2 ? q : p, b + next, s);
            if (j % 2 == 0)
                out = put(out, p, q, b + next);
        } else {
            uint32_t p = a + j, s = b + j / 2, r = b + (j / 2 + 1) % m;
            out = put(out, p, a + next, j % 2 ? r : s);
            if (j % 2 == 0)
                out = put(out, a + next, r, s);
        }
    }
    return out;
}

/* Positions and triangles with shared vertices. */
static void build(float *position, uint32_t *index)
{
    uint32_t start[LAST + 1], count = 0;
    for (int row = 0; row <= LAST; row++) {
        start[row] = count;
        count += columns_of(row);
    }
    double highest = 0;
    for (uint32_t column = 0; column < COLUMNS; column++) {
        double point[LAST + 1][2], sine, cosine;
        struct section s = section_at((double)column / COLUMNS);
        make_profile(&s, point);
        circle(s.turn, &sine, &cosine);
        for (int row = 0; row <= LAST; row++) {
            uint32_t n = columns_of(row);
            if (n == 1 ? column > 0 : column % (COLUMNS / n) != 0)
                continue;
            float *p = position + 3 * (start[row] + (n == 1 ? 0 : column / (COLUMNS / n)));
            p[0] = (float)(point[row][0] * sine);
            p[1] = (float)point[row][1];
            p[2] = (float)(point[row][0] * cosine);
            if (p[1] > highest)
                highest = p[1];
        }
    }
    for (uint32_t i = 0; i < count; i++) /* exactly 2 units tall */
        position[3 * i + 1] = (float)(2 * (position[3 * i + 1] / highest));
    for (int row = 0; row < LAST; row++)
        index = connect(position, start[row], columns_of(row), start[row + 1], columns_of(row + 1),
                        index);
}

bool dph_mesh_init_candle(struct dph_mesh *mesh, struct dph_error *err)
{
    bool ok = false;
    memset(mesh, 0, sizeof *mesh);
    float *position = dph_alloc(POSITIONS, 3 * sizeof *position);
    float *normal = dph_alloc(POSITIONS, 3 * sizeof *normal);
    uint32_t *index = dph_alloc(TRIANGLES, 3 * sizeof *index);
    if (!position || !normal || !index) {
        dph_fail_memory(err);
        goto error;
    }
    build(position, index);
    dph_mesh_position_normals(position, POSITIONS, index, TRIANGLES, normal);
    if (!dph_mesh_init(mesh, 3 * (size_t)TRIANGLES, TRIANGLES, true, false, err))
        goto error;
    for (size_t i = 0; i < mesh->nvert; i++) {
        memcpy(mesh->position + 3 * i, position + 3 * (size_t)index[i], 3 * sizeof *position);
        memcpy(mesh->normal + 3 * i, normal + 3 * (size_t)index[i], 3 * sizeof *normal);
        mesh->index[i] = (uint32_t)i;
    }
    ok = true;
error:
    free(position);
    free(normal);
    free(index);
    return ok;
}
