/* A naive engine in C, and in C++, for `kinetile conform --command`: discs with masses, in an arena or none,
 * whose axes may be periodic. All else is refused.
 *
 * Contacts are decided exactly, by the rules of docs/specification.md: doubles are whole numbers of a fine
 * grain, products of them have 1280 bits, and the tick of a contact is found by bisection. What does not fit
 * is refused too.
 *
 *     cc -O2 -ffp-contract=off engine.c -lm        (c++ -O2 -ffp-contract=off -x c++ engine.c)
 *
 * With -DTIMES it writes times in place of ticks, for `--within`; with -DFAULT=1 to 14 it has one of the faults
 * that the kit must find. */
#include <math.h>
#include <setjmp.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#ifndef FAULT
#define FAULT 0
#endif
#define MOST 1000
#define LIMBS 20                   /* 1280 bits */
#define GRAIN 200                  /* a velocity is a whole number times 2^-GRAIN */
#define NEVER INT64_MAX
#define FAR ((int64_t)1 << 61)     /* from here on the clock anchors bodies without periods: refused */
#define IMAGES 1e5                 /* images of a body that another one may pass, at most */
#define KEPT(x) (FAULT == 12 ? (double)(float)(x) : (x))

static jmp_buf refusal;
static const char *reason;
static void refuse(const char *why) { reason = why; longjmp(refusal, 1); }

/* Whole numbers modulo 2^1280, negative ones as two's complement. */
typedef struct { uint64_t w[LIMBS]; } Big;
static Big add(Big a, Big b) {
    unsigned __int128 carry = 0;
    for (int i = 0; i < LIMBS; i++) {
        carry += (unsigned __int128)a.w[i] + b.w[i];
        a.w[i] = (uint64_t)carry;
        carry >>= 64;
    }
    return a;
}
static Big whole(int64_t z) {
    Big a;
    for (int i = 0; i < LIMBS; i++) a.w[i] = i ? (z < 0 ? ~0ull : 0) : (uint64_t)z;
    return a;
}
static Big minus(Big a) { for (int i = 0; i < LIMBS; i++) a.w[i] = ~a.w[i]; return add(a, whole(1)); }
static Big sub(Big a, Big b) { return add(a, minus(b)); }
static Big mul(Big a, Big b) { /* quick where the first is small */
    Big c = whole(0);
    for (int i = 0; i < LIMBS; i++) {
        unsigned __int128 carry = 0;
        for (int j = 0; a.w[i] && i + j < LIMBS; j++) {
            carry += (unsigned __int128)a.w[i] * b.w[j] + c.w[i + j];
            c.w[i + j] = (uint64_t)carry;
            carry >>= 64;
        }
    }
    return c;
}
static int sign(Big a) {
    uint64_t any = 0;
    for (int i = 0; i < LIMBS; i++) any |= a.w[i];
    return a.w[LIMBS - 1] >> 63 ? -1 : any != 0;
}
/* x times 2^shift, which must be a whole number. */
static Big exact(double x, int shift) {
    int e;
    int64_t m = (int64_t)ldexp(frexp(x, &e), 53);
    if (m == 0) return whole(0);
    for (e += shift - 53; e < 0 && m % 2 == 0; e++) m /= 2;
    if (e < 0) refuse("a number is too small");
    Big power = whole(0);
    power.w[e / 64] = 1ull << e % 64;
    return mul(whole(m), power);
}

/* The scene, and the ticks to come: with[a][b] that of a pair a < b, side[a] that of a wall. */
typedef struct { double x[2], v[2], r, m; int64_t anchor, k[2]; Big X[2], V[2], R; } Body;
typedef struct { int64_t m[2]; } Image;
static Body body[MOST];
static int n, walled, alike, fine, side_wall[MOST];
static double arena[2], period[2], until, q;
static int64_t with[MOST][MOST], side[MOST], end;
static Image through[MOST][MOST], met[MOST][MOST]; /* of the contact to come, and of the last, if barred */
static char barred[MOST][MOST];

static const char *at;   /* what is left of the line */
static int take(char c) { at += strspn(at, " \t\r\n"); return *at == c ? (at++, 1) : 0; }
static void expect(char c) { if (!take(c)) refuse("the line is no scene of discs"); }
static const char *key(void) {
    static char word[32];
    expect('"');
    size_t length = strcspn(at, "\"");
    snprintf(word, sizeof word, "%.*s", (int)(length < 31 ? length : 31), at);
    at += length;
    expect('"'), expect(':');
    return word;
}
static double number(void) {
    char *end;
    double x = strtod(at, &end);
    if (end == at) refuse("it takes only numbers that are finite");
    at = end;
    return KEPT(x);
}
static void periods(void) {
    expect('"');
    for (; *at != '"'; at++) if (FAULT != 13) period[*at == 'y'] = 1;
    expect('"');
}
static void pair(double *p) { expect('['), p[0] = number(), expect(','), p[1] = number(), expect(']'); }
static void read_body(void) {
    if (n == MOST) refuse("there are too many bodies");
    Body *b = &body[n++];
    memset(b, 0, sizeof *b);
    b->m = 1;
    expect('{');
    do {
        const char *k = key();
        if (!strcmp(k, "position")) pair(b->x);
        else if (!strcmp(k, "velocity")) pair(b->v);
        else if (!strcmp(k, "radius")) b->r = number();
        else if (!strcmp(k, "mass")) b->m = number();
        else refuse("a body has more than a place, a velocity, a radius and a mass");
    } while (take(','));
    expect('}');
}
static void read_scene(const char *line) {
    at = line, n = walled = 0, period[0] = period[1] = 0;
    expect('{');
    do {
        const char *k = key();
        if (!strcmp(k, "arena")) pair(arena), walled = 1;
        else if (!strcmp(k, "periodic")) periods();
        else if (!strcmp(k, "until")) until = number();
        else if (!strcmp(k, "start")) { if (number() != 0) refuse("it starts at 0 only"); }
        else if (!strcmp(k, "bodies")) {
            expect('[');
            if (!take(']')) { do read_body(); while (take(',')); expect(']'); }
        } else refuse("the scene has more than an arena, an end and bodies");
    } while (take(','));
    expect('}');
    for (int i = 0; i < 2; i++) period[i] *= arena[i];
}

/* Rule 3: q. Places are whole numbers times 2^-fine, and so is what a velocity flies in a tick. */
static void clock_of_scene(void) {
    double S = 0, far = 0, r = 0;
    alike = 1;
    for (int i = 0; i < n; i++) {
        S = fmax(S, body[i].v[0] * body[i].v[0] + body[i].v[1] * body[i].v[1]);
        far = fmax(far, fmax(fabs(body[i].x[0]), fabs(body[i].x[1])));
        r = fmax(r, body[i].r);
        alike &= FAULT == 6 || body[i].m == body[0].m;
    }
    double c = sqrt(S) / (walled ? fmax(arena[0], arena[1]) : far + r) * (1 - 0x1p-20);
    int e = 0;
    while (n && c >= ldexp(1, e)) e++;
    if (walled) far = fmax(far, fmax(arena[0], arena[1]));
    if (e > 30 || far + r >= 0x1p40 || S >= 0x1p40) refuse("it is too fast or too far away");
    q = ldexp(1, -e - 52), fine = GRAIN + e + 52;
    if (until / q >= (double)FAR) refuse("it lasts too long");
}
/* Rules 4, 4p. */
static void anchor(Body *b, int64_t tick) {
    double d = (double)(tick - b->anchor) * q;
    for (int i = 0; i < 2; i++) {
        double x = KEPT(b->x[i] + b->v[i] * d);
        b->x[i] = period[i] ? remainder(x, period[i]) : x;
        if (period[i]) b->k[i] += llround((x - b->x[i]) / period[i]);
    }
    b->anchor = tick;
}
/* Rule 8p: when the clock anchors a body. */
static int64_t clock_tick(const Body *b) {
    return period[0] || period[1] ? (b->anchor / ((int64_t)1 << 53) + 2) << 53 : NEVER;
}
static Big dot(Big a[2], Big b[2]) { return add(mul(a[0], b[0]), mul(a[1], b[1])); }

/* Rule 5, through an image. The first zero of Q is not before a tick where Q >= 0 and B < 0. */
static int64_t image_tick(const Body *a, const Body *b, Image image) {
    int64_t s = a->anchor > b->anchor ? a->anchor : b->anchor, low = 0, high = FAR;
    Big d[2], v[2], R = FAULT == 7 ? add(a->R, a->R) : add(a->R, b->R);
    for (int i = 0; i < 2; i++) {
        Big there = add(b->X[i], mul(whole(s - b->anchor), b->V[i]));
        d[i] = sub(there, add(a->X[i], mul(whole(s - a->anchor), a->V[i])));
        if (period[i]) d[i] = add(d[i], mul(whole(image.m[i]), exact(period[i], fine)));
        v[i] = sub(b->V[i], a->V[i]);
    }
    Big B = dot(d, v);
    if (sign(B) >= (FAULT == 1 ? 1 : 0)) return NEVER;
    Big Q = sub(dot(d, d), mul(R, R));
    if (sign(Q) <= 0) return s;
    if (sign(sub(mul(B, B), mul(dot(v, v), Q))) <= (FAULT == 14 ? -1 : 0)) return NEVER;
    while (high - low > 1) {
        int64_t middle = low + (high - low) / 2;
        Big then[2];
        for (int i = 0; i < 2; i++) then[i] = add(d[i], mul(whole(middle), v[i]));
        *(sign(dot(then, v)) < 0 && sign(sub(dot(then, then), mul(R, R))) >= 0 ? &low : &high) = middle;
    }
    return s + (FAULT == 5 ? high : low);
}
/* Rule 5p: of the images that come near before the end, in doubles, the one that is met first. */
static int64_t pair_tick(int one, int other) {
    const Body *a = &body[one], *b = &body[other];
    int64_t s = a->anchor > b->anchor ? a->anchor : b->anchor, tick = NEVER;
    double t = (double)(end - s) * q, R = 1.001 * (a->r + b->r), d[2], v[2], from[2], to[2];
    for (int i = 0; i < 2; i++) {
        v[i] = b->v[i] - a->v[i];
        d[i] = b->x[i] - a->x[i] + (double)(b->k[i] - a->k[i]) * period[i];
        d[i] += b->v[i] * ((double)(s - b->anchor) * q) - a->v[i] * ((double)(s - a->anchor) * q);
        double least = fmin(d[i], d[i] + v[i] * t), most = fmax(d[i], d[i] + v[i] * t);
        from[i] = period[i] ? ceil((-R - most) / period[i]) : 0;
        to[i] = period[i] ? floor((R - least) / period[i]) : 0;
    }
    if ((to[0] - from[0] + 1) * (to[1] - from[1] + 1) > IMAGES) refuse("it flies too many periods");
    for (double m = from[0]; m <= to[0]; m++)
        for (double k = from[1]; k <= to[1]; k++) {
            double x = d[0] + m * period[0], y = d[1] + k * period[1], vv = v[0] * v[0] + v[1] * v[1];
            double near = vv ? fmin(fmax(-(x * v[0] + y * v[1]) / vv, 0), t) : 0;
            Image image = {{(int64_t)m, (int64_t)k}}, last = met[one][other];
            if ((period[0] || period[1]) && hypot(x + near * v[0], y + near * v[1]) > R) continue;
            if (barred[one][other] && image.m[0] == last.m[0] && image.m[1] == last.m[1]) continue;
            int64_t found = image_tick(a, b, image);
            if (found < tick) tick = found, through[one][other] = image;
        }
    return tick;
}

/* Rule 6. */
static void wall_tick(int k) {
    Body *b = &body[k];
    side[k] = NEVER;
    for (int i = 0; walled && i < 2; i++) {
        int ahead = sign(b->V[i]), wall = -1 - 2 * i - (ahead > 0);
        if (ahead == 0 || period[i] || (FAULT == 4 && wall == -4)) continue;
        Big gap = sub(ahead > 0 ? sub(exact(arena[i], fine), b->X[i]) : b->X[i], b->R);
        Big speed = ahead > 0 ? b->V[i] : minus(b->V[i]);
        int64_t low = 0, high = FAR;
        while (sign(gap) > 0 && high - low > 1) {
            int64_t middle = low + (high - low) / 2;
            *(sign(sub(gap, mul(whole(middle), speed))) >= 0 ? &low : &high) = middle;
        }
        if (b->anchor + low < side[k]) side[k] = b->anchor + low, side_wall[k] = wall;
    }
}

static void predict(int k) {
    wall_tick(k);
    for (int j = 0; j < n - (FAULT == 2); j++) {
        int a = j < k ? j : k, b = j < k ? k : j;
        if (a < b) with[a][b] = pair_tick(a, b);
    }
}
/* What follows from a new plan; `unbarred` ends the bars of rule 7. */
static void new_plan(int k, int unbarred) {
    for (int i = 0; i < 2; i++) {
        if (fabs(body[k].v[i]) >= 0x1p20) refuse("it is too fast");
        body[k].X[i] = exact(body[k].x[i], fine), body[k].V[i] = exact(body[k].v[i], GRAIN);
        if (body[k].k[i]) body[k].X[i] = add(body[k].X[i], mul(whole(body[k].k[i]), exact(period[i], fine)));
    }
    for (int j = 0; unbarred && j < n; j++) barred[j][k] = barred[k][j] = 0;
}

/* Rules 9, 9p. */
static double E(double a, double b) { return fma(a, b, -(a * b)); }
static double share(double m, double o, double speed) {
    double both = m + o, part = both - m, low = (m - (both - part)) + (o - part), f = 2 * o / both;
    double back = f * both, rest = ((2 * o - back) - E(f, both) - low * f) / both, taken = f * speed;
    return taken + (E(f, speed) + rest * speed);
}
static int exchange(Body *a, Body *b, Image image) {
    double d[2];
    for (int i = 0; i < 2; i++) {
        d[i] = b->x[i] - a->x[i];
        if (period[i]) d[i] = d[i] + (double)(image.m[i] + b->k[i] - a->k[i]) * period[i];
    }
    double dx = d[0], dy = d[1], l = sqrt(dx * dx + dy * dy);
    if (l == 0) return 0;
    double nx = dx / l, ny = dy / l, ux = b->v[0] - a->v[0], uy = b->v[1] - a->v[1];
    double xx = nx * nx, yy = ny * ny;
    double excess = ((xx - 0.5) + (yy - 0.5)) + (E(nx, nx) + E(ny, ny));
    double px = ux * nx, py = uy * ny, sum = px + py, part = sum - px;
    double low = ((px - (sum - part)) + (py - part)) + (E(ux, nx) + E(uy, ny));
    double speed = FAULT == 8 ? sum : sum + (low - sum * excess);
    double ga = alike ? speed : share(a->m, b->m, speed), gb = alike ? speed : share(b->m, a->m, speed);
    a->v[0] = a->v[0] + ga * nx, a->v[1] = a->v[1] + ga * ny;
    b->v[0] = b->v[0] - gb * nx, b->v[1] = b->v[1] - gb * ny;
    for (int i = 0; i < 2; i++) a->v[i] = KEPT(a->v[i]), b->v[i] = KEPT(b->v[i]);
    return 1;
}

/* Rule 8: the next event, until the end. */
static void run(FILE *answer) {
    const char *between = "";
    end = (int64_t)(until / q);
    for (int k = 0; k < n; k++) {
        body[k].R = exact(body[k].r, fine);
        if (period[0] || period[1]) anchor(&body[k], 0);
        new_plan(k, FAULT != 11);
    }
    for (int k = 0; k < n; k++) predict(k);
    for (;;) {
        int64_t tick = NEVER;
        int one = 0, other = 0, by_clock = 0;
        for (int a = 0; a < n; a++)
            if (clock_tick(&body[a]) < tick) tick = clock_tick(&body[a]), one = a, by_clock = 1;
        for (int a = 0; a < n; a++)
            if (side[a] < tick) tick = side[a], one = a, other = side_wall[a], by_clock = 0;
        for (int a = 0; a < n - (FAULT == 2); a++)
            for (int b = a + 1; b < n - (FAULT == 2); b++)
                if (with[a][b] < tick + (FAULT == 3 && tick < NEVER)) tick = with[a][b], one = a, other = b, by_clock = 0;
        if (tick > end - (FAULT == 10)) return;
        anchor(&body[one], tick);
        if (by_clock) {
            new_plan(one, 1), predict(one);
            continue;
        }
        if (other < 0) {
            double *v = &body[one].v[other < -2];
            *v = -*v;
            new_plan(one, FAULT != 9);
        } else {
            anchor(&body[other], tick);
            if (!exchange(&body[one], &body[other], through[one][other])) return;
            new_plan(one, 1), new_plan(other, 1);
            barred[one][other] = 1, met[one][other] = through[one][other];
            predict(other);
        }
        predict(one);
#ifdef TIMES
        fprintf(answer, "%s[%.17g, %d, %d]", between, (double)tick * q, one, other);
#else
        fprintf(answer, "%s[%lld, %lld, %d, %d]", between, (long long)(tick >> 52),
                (long long)(tick & (((int64_t)1 << 52) - 1)), one, other);
#endif
        between = ", ";
    }
}

int main(void) {
    char *line = NULL, *text;
    size_t room = 0, length;
    while (getline(&line, &room, stdin) > 0) {
        FILE *answer = open_memstream(&text, &length);
        if (setjmp(refusal)) {
            printf("{\"refused\": \"%s\"}\n", reason);
        } else {
            read_scene(line);
            clock_of_scene();
            run(answer);
            fflush(answer);
            printf("{\"contacts\": [%s]}\n", text);
        }
        fclose(answer), free(text);
        fflush(stdout);
    }
    return 0;
}
